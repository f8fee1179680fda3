"""A mark for each piece, so that blocks can be told apart without their colours."""

from collections.abc import Callable, Mapping
from typing import Final

import pygame

from tetris.window.theme import Colour

_Draw = Callable[[pygame.Surface, pygame.Rect, Colour, int], None]


def draw_pattern(picture: pygame.Surface, face: pygame.Rect, mark: str, colour: Colour) -> None:
    """Draw a piece's mark into the face of a block; debris has none.

    Args:
        picture: The block.
        face: Where its flat part is.
        mark: The piece.
        colour: Of the mark's strokes.
    """
    draw = _PATTERNS.get(mark)
    if draw:
        side = round(min(face.size) * 0.52)
        box = pygame.Rect(0, 0, side, side)
        box.center = face.center
        draw(picture, box, colour, max(1, side // 5))


def _bar(picture: pygame.Surface, box: pygame.Rect, colour: Colour, stroke: int) -> None:
    band = pygame.Rect(0, 0, box.width, round(1.4 * stroke))
    band.center = box.center
    pygame.draw.rect(picture, colour, band)


def _ring(picture: pygame.Surface, box: pygame.Rect, colour: Colour, stroke: int) -> None:
    pygame.draw.circle(picture, colour, box.center, box.width // 2, stroke)


def _triangle(picture: pygame.Surface, box: pygame.Rect, colour: Colour, stroke: int) -> None:
    pygame.draw.polygon(picture, colour, (box.midtop, box.bottomright, box.bottomleft))


def _rising(picture: pygame.Surface, box: pygame.Rect, colour: Colour, stroke: int) -> None:
    _stroke(picture, box.bottomleft, box.topright, colour, stroke)


def _sinking(picture: pygame.Surface, box: pygame.Rect, colour: Colour, stroke: int) -> None:
    _stroke(picture, box.topleft, box.bottomright, colour, stroke)


def _stroke(
    picture: pygame.Surface,
    start: tuple[int, int],
    end: tuple[int, int],
    colour: Colour,
    stroke: int,
) -> None:
    pygame.draw.line(picture, colour, start, end, round(1.6 * stroke))


def _square(picture: pygame.Surface, box: pygame.Rect, colour: Colour, stroke: int) -> None:
    pygame.draw.rect(picture, colour, box, stroke)


def _plus(picture: pygame.Surface, box: pygame.Rect, colour: Colour, stroke: int) -> None:
    _bar(picture, box, colour, stroke)
    band = pygame.Rect(0, 0, round(1.4 * stroke), box.height)
    band.center = box.center
    pygame.draw.rect(picture, colour, band)


_PATTERNS: Final[Mapping[str, _Draw]] = {
    "I": _bar,
    "O": _ring,
    "T": _triangle,
    "S": _rising,
    "Z": _sinking,
    "J": _square,
    "L": _plus,
}
