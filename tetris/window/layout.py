"""Layout of a game's parts inside a rectangle, in multiples of one cell."""

from dataclasses import dataclass
from typing import Final

import pygame

_COLUMNS: Final = 10  # a board with fewer stands in the middle of so many
_ROWS: Final = 20
_SIDE: Final = 4.8  # width of the column on either side, in cells
_GAP: Final = 0.6  # between the board and a side column
_HEAD: Final = 1.3  # above the board, for a piece that is just entering
_FOOT: Final = 0.6
_WIDTH: Final = 2 * (_SIDE + _GAP) + 0.5  # all but the board
_HOLD: Final = 4.4  # heights
_NEXT: Final = 15.7
_LEAST_CELL: Final = 6  # pixels; below, nothing could be told apart


@dataclass(frozen=True, slots=True)
class Layout:
    """Pixels of the window.

    Attributes:
        area: Everything.
        cell: The side of one block.
        columns: How many columns the board has.
        rows: How many visible rows.
        board: Its visible rows.
        hold: The card of the held piece.
        stats: The card of score, level, lines and pieces.
        next: The card of the next pieces.
        callout: Where a clear is named, beside the board so that it hides nothing.
    """

    area: pygame.Rect
    cell: int
    columns: int
    rows: int
    board: pygame.Rect
    hold: pygame.Rect
    stats: pygame.Rect
    next: pygame.Rect
    callout: pygame.Rect

    @classmethod
    def inside(cls, area: pygame.Rect, columns: int = _COLUMNS, rows: int = _ROWS) -> "Layout":
        """Fit the largest whole cell size into an area and centre everything in it."""
        wide, high = max(columns, _COLUMNS), max(rows, _ROWS)
        height = high + _HEAD + _FOOT
        cell = max(_LEAST_CELL, int(min(area.width / (wide + _WIDTH), area.height / height)))
        place = pygame.Rect(0, 0, wide * cell, high * cell)
        place.centerx = area.centerx
        place.top = area.top + round((area.height - height * cell) / 2 + _HEAD * cell)
        board = pygame.Rect(0, 0, columns * cell, rows * cell)
        board.midbottom = place.midbottom
        side, gap = round(_SIDE * cell), round(_GAP * cell)
        left, right = place.left - gap - side, place.right + gap
        hold = pygame.Rect(left, place.top, side, round(_HOLD * cell))
        stats = pygame.Rect(left, hold.bottom + gap, side, place.bottom - hold.bottom - gap)
        following = pygame.Rect(right, place.top, side, round(_NEXT * cell))
        below = following.bottom + gap
        callout = pygame.Rect(right, below, side, place.bottom - below)
        return cls(area.copy(), cell, columns, rows, board, hold, stats, following, callout)

    def at(self, x: float, y: float) -> tuple[int, int]:
        """Return the upper left pixel of a cell of the board."""
        return (
            round(self.board.left + x * self.cell),
            round(self.board.bottom - (y + 1) * self.cell),
        )
