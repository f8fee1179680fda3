"""Blocks and ghosts as small pictures, with a mark for each piece."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import cos, pi, sin
from typing import Final

import pygame

from tetris.engine.board import GARBAGE
from tetris.engine.pieces import KINDS, SHAPES
from tetris.kit import theme
from tetris.kit.settings import Look
from tetris.kit.theme import Colour, Palette

_FINE: Final = 4  # drawn so much larger, then scaled down, for soft edges
_GHOST_FILL: Final = 0.2  # of the outline's opacity
_DIM_ALPHA: Final = 80
_LEAST: Final = 5  # pixels; a smaller block is plain
_MOST: Final = 64  # pictures kept of a kind: a window that is dragged passes through many sizes


def colours(palette: Palette) -> dict[str, Colour]:
    """Return the colour of each mark of the board."""
    return dict(zip((*KINDS, GARBAGE), palette.pieces, strict=True))


@lru_cache(maxsize=4)
def tiles_of(look: Look) -> "Tiles":
    """Return the blocks of a look, the same ones each time."""
    return Tiles(look.palette, patterns=look.settings.patterns)


class Tiles:
    """The blocks of one theme; each picture is drawn once for a mark and a size in pixels.

    Attributes:
        mino: Returns one block, its corners transparent.
        ghost: Returns one block of the ghost: an outline with a breath of colour inside.
        hint: Returns one block of a hint: a dot in the colour of its piece.
        preview: Returns a whole piece as it enters, cut to its outline.
        dimmed: Returns the same, faint.
    """

    def __init__(self, palette: Palette, *, patterns: bool = False) -> None:
        """Use a theme's colours; patterns tell the pieces apart without them."""
        self._palette, self._patterns = palette, patterns
        self._colours = colours(palette)
        keep = lru_cache(maxsize=_MOST)
        self.mino, self.ghost = keep(self._draw_mino), keep(self._draw_ghost)
        self.hint, self.preview = keep(self._draw_hint), keep(self._draw_whole)
        self.dimmed = keep(self._draw_dim)

    def colour(self, mark: str) -> Colour:
        """Return the colour of a mark of the board; that of garbage for any other."""
        return self._colours.get(mark) or self._colours[GARBAGE]

    def _draw_mino(self, mark: str, size: int) -> pygame.Surface:
        if size < _LEAST:
            picture = pygame.Surface((size, size))
            picture.fill(self.colour(mark))
            return picture
        fine = size * _FINE
        colour, bevel, edge = self.colour(mark), self._palette.bevel, self._palette.edge
        gap = _FINE // 2  # blocks never quite touch
        outer = pygame.Rect(gap, gap, fine - 2 * gap, fine - 2 * gap)
        radius = fine // 7
        picture = pygame.Surface((fine, fine), pygame.SRCALPHA)
        if edge:
            pygame.draw.rect(picture, edge, outer, border_radius=radius)
            rim = max(_FINE, fine // 14)
            face = outer.inflate(-2 * rim, -2 * rim)
            pygame.draw.rect(picture, colour, face, border_radius=radius)
        else:
            rim = max(_FINE, fine // 11)
            dark, lit = theme.shade(colour, -0.42 * bevel), theme.shade(colour, 0.42 * bevel)
            pygame.draw.rect(picture, dark, outer, border_radius=radius)
            upper = pygame.Rect(outer.x, outer.y, outer.width, outer.height - rim)
            pygame.draw.rect(picture, lit, upper, border_radius=radius)
            face = pygame.Rect(outer.x, outer.y + rim, outer.width, outer.height - 2 * rim)
            top, bottom = theme.shade(colour, 0.10 * bevel), theme.shade(colour, -0.16 * bevel)
            _gradient(picture, face, top, bottom, radius)
            inset = face.inflate(-fine // 3, -fine // 3)
            top, bottom = theme.shade(colour, -0.06 * bevel), theme.shade(colour, 0.07 * bevel)
            _gradient(picture, inset, top, bottom, radius // 2)
        if self._patterns:
            _draw_pattern(picture, face, mark, theme.shade(colour, -0.62))
        return pygame.transform.smoothscale(picture, (size, size))

    def _draw_ghost(self, mark: str, size: int) -> pygame.Surface:
        fine = size * _FINE
        colour, alpha = self.colour(mark), self._palette.ghost_alpha
        outer = pygame.Rect(_FINE, _FINE, fine - 2 * _FINE, fine - 2 * _FINE)
        picture = pygame.Surface((fine, fine), pygame.SRCALPHA)
        radius = fine // 7
        fill = (*colour, round(alpha * _GHOST_FILL))
        pygame.draw.rect(picture, fill, outer, border_radius=radius)
        edge = max(_FINE, fine // (10 if self._palette.edge else 16))
        pygame.draw.rect(picture, (*colour, alpha), outer, edge, border_radius=radius)
        return pygame.transform.smoothscale(picture, (size, size))

    def _draw_hint(self, mark: str, size: int) -> pygame.Surface:
        picture = pygame.Surface((size, size), pygame.SRCALPHA)
        radius = max(2, round(size * 0.2))
        centre = size // 2, size // 2
        pygame.draw.circle(picture, self._palette.text, centre, radius)
        pygame.draw.circle(picture, self.colour(mark), centre, max(1, radius - max(1, size // 16)))
        return picture

    def _draw_whole(self, mark: str, size: int) -> pygame.Surface:
        cells = SHAPES[mark][0]  # type: ignore[index]
        left, bottom = min(x for x, _ in cells), min(y for _, y in cells)
        columns, rows = max(x for x, _ in cells) - left + 1, max(y for _, y in cells) - bottom + 1
        picture = pygame.Surface((columns * size, rows * size), pygame.SRCALPHA)
        for x, y in cells:
            place = (x - left) * size, (rows - 1 - y + bottom) * size
            picture.blit(self.mino(mark, size), place)
        return picture

    def _draw_dim(self, mark: str, size: int) -> pygame.Surface:
        picture = self._draw_whole(mark, size)
        picture.set_alpha(_DIM_ALPHA)
        return picture


def _gradient(
    picture: pygame.Surface, rect: pygame.Rect, top: Colour, bottom: Colour, radius: int
) -> None:
    band = pygame.Surface(rect.size, pygame.SRCALPHA)
    for row in range(rect.height):
        colour = theme.mix(top, bottom, row / rect.height)
        pygame.draw.line(band, colour, (0, row), (rect.width, row))
    shape = pygame.Surface(rect.size, pygame.SRCALPHA)
    pygame.draw.rect(shape, theme.WHITE, shape.get_rect(), border_radius=radius)
    band.blit(shape, (0, 0), special_flags=pygame.BLEND_RGBA_MIN)
    picture.blit(band, rect)


def _draw_pattern(picture: pygame.Surface, face: pygame.Rect, mark: str, colour: Colour) -> None:
    """Draw a piece's mark into the face of a block; garbage has none."""
    side = round(min(face.size) * 0.52)
    box = pygame.Rect(0, 0, side, side)
    box.center = face.center
    for line in _PATTERNS.get(mark, ()):
        points = [(box.left + x * side, box.top + y * side) for x, y in line]
        pygame.draw.lines(picture, colour, False, points, max(1, side // 4))


# Lines through points (x, y) of a square, from 0 to 1: bar, ring, triangle, slopes, square, cross.
_PATTERNS: Final[Mapping[str, Sequence[Sequence[tuple[float, float]]]]] = {
    "I": [[(0, 0.5), (1, 0.5)]],
    "O": [[(cos(turn * pi / 8) / 2 + 0.5, sin(turn * pi / 8) / 2 + 0.5) for turn in range(17)]],
    "T": [[(0.5, 0), (1, 1), (0, 1), (0.5, 0)]],
    "S": [[(0, 1), (1, 0)]],
    "Z": [[(0, 0), (1, 1)]],
    "J": [[(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]],
    "L": [[(0, 0.5), (1, 0.5)], [(0.5, 0), (0.5, 1)]],
}
