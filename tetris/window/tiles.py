"""Minos and ghosts as small pictures, drawn once for each size."""

from functools import lru_cache
from typing import Final

import pygame

from tetris.pieces import SHAPES, Kind
from tetris.window import theme
from tetris.window.theme import Colour

_FINE: Final = 4  # drawn so much larger, then scaled down, for soft edges
_GHOST_FILL_ALPHA: Final = 34
_GHOST_EDGE_ALPHA: Final = 170


@lru_cache(maxsize=64)
def mino(kind: Kind, size: int) -> pygame.Surface:
    """Return one bevelled block of size x size pixels, its corners transparent."""
    fine = size * _FINE
    colour = theme.PIECES[kind]
    gap = _FINE // 2  # blocks never quite touch
    outer = pygame.Rect(gap, gap, fine - 2 * gap, fine - 2 * gap)
    rim = max(_FINE, fine // 11)
    radius = fine // 7
    picture = pygame.Surface((fine, fine), pygame.SRCALPHA)
    pygame.draw.rect(picture, theme.mix(colour, theme.BLACK, 0.42), outer, border_radius=radius)
    lit = pygame.Rect(outer.x, outer.y, outer.width, outer.height - rim)
    pygame.draw.rect(picture, theme.mix(colour, theme.WHITE, 0.42), lit, border_radius=radius)
    face = pygame.Rect(outer.x, outer.y + rim, outer.width, outer.height - 2 * rim)
    _gradient(
        picture,
        face,
        theme.mix(colour, theme.WHITE, 0.10),
        theme.mix(colour, theme.BLACK, 0.16),
        radius,
    )
    inset = face.inflate(-fine // 3, -fine // 3)
    _gradient(
        picture,
        inset,
        theme.mix(colour, theme.BLACK, 0.06),
        theme.mix(colour, theme.WHITE, 0.07),
        radius // 2,
    )
    return pygame.transform.smoothscale(picture, (size, size))


@lru_cache(maxsize=64)
def ghost(kind: Kind, size: int) -> pygame.Surface:
    """Return one block of the ghost: an outline with a breath of colour inside."""
    fine = size * _FINE
    colour = theme.PIECES[kind]
    gap = _FINE
    outer = pygame.Rect(gap, gap, fine - 2 * gap, fine - 2 * gap)
    picture = pygame.Surface((fine, fine), pygame.SRCALPHA)
    radius = fine // 7
    pygame.draw.rect(picture, (*colour, _GHOST_FILL_ALPHA), outer, border_radius=radius)
    edge = max(_FINE, fine // 16)
    pygame.draw.rect(picture, (*colour, _GHOST_EDGE_ALPHA), outer, edge, border_radius=radius)
    return pygame.transform.smoothscale(picture, (size, size))


@lru_cache(maxsize=64)
def preview(kind: Kind, size: int, dim: bool = False) -> pygame.Surface:
    """Return a whole piece as it enters, of blocks of that size, cut to its outline."""
    cells = SHAPES[kind][0]
    left, bottom = min(x for x, _ in cells), min(y for _, y in cells)
    columns, rows = max(x for x, _ in cells) - left + 1, max(y for _, y in cells) - bottom + 1
    picture = pygame.Surface((columns * size, rows * size), pygame.SRCALPHA)
    for x, y in cells:
        picture.blit(mino(kind, size), ((x - left) * size, (rows - 1 - y + bottom) * size))
    if dim:
        picture.set_alpha(80)
    return picture


def _gradient(
    picture: pygame.Surface, rect: pygame.Rect, top: Colour, bottom: Colour, radius: int
) -> None:
    """Fill a rounded rectangle with colours from top to bottom."""
    band = pygame.Surface(rect.size, pygame.SRCALPHA)
    for row in range(rect.height):
        colour = theme.mix(top, bottom, row / rect.height)
        pygame.draw.line(band, colour, (0, row), (rect.width, row))
    shape = pygame.Surface(rect.size, pygame.SRCALPHA)
    pygame.draw.rect(shape, theme.WHITE, shape.get_rect(), border_radius=radius)
    band.blit(shape, (0, 0), special_flags=pygame.BLEND_RGBA_MIN)
    picture.blit(band, rect)
