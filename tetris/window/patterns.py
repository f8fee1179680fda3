"""A mark for each piece, which distinguishes blocks without their colours."""

from collections.abc import Callable, Mapping
from typing import Final

import pygame

from tetris.window.theme import Colour

Size = tuple[int, int]  # pixels
_Draw = Callable[[pygame.Surface, pygame.Rect, Colour, int], object]


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


def _band(picture: pygame.Surface, box: pygame.Rect, colour: Colour, size: Size) -> None:
    band = pygame.Rect((0, 0), size)
    band.center = box.center
    pygame.draw.rect(picture, colour, band)


def _plus(picture: pygame.Surface, box: pygame.Rect, colour: Colour, stroke: int) -> None:
    wide = round(1.4 * stroke)
    _band(picture, box, colour, (box.width, wide))
    _band(picture, box, colour, (wide, box.height))


_PATTERNS: Final[Mapping[str, _Draw]] = {
    "I": lambda to, box, ink, stroke: _band(to, box, ink, (box.width, round(1.4 * stroke))),
    "O": lambda to, box, ink, stroke: pygame.draw.circle(
        to, ink, box.center, box.width // 2, stroke
    ),
    "T": lambda to, box, ink, stroke: pygame.draw.polygon(
        to, ink, (box.midtop, box.bottomright, box.bottomleft)
    ),
    "S": lambda to, box, ink, stroke: pygame.draw.line(
        to, ink, box.bottomleft, box.topright, round(1.6 * stroke)
    ),
    "Z": lambda to, box, ink, stroke: pygame.draw.line(
        to, ink, box.topleft, box.bottomright, round(1.6 * stroke)
    ),
    "J": lambda to, box, ink, stroke: pygame.draw.rect(to, ink, box, stroke),
    "L": _plus,
}
