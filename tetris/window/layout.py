"""Where the parts of a game are drawn inside a rectangle, in multiples of one cell."""

from dataclasses import dataclass
from typing import Final

import pygame

from tetris.pieces import COLUMNS, VISIBLE_ROWS

_SIDE: Final = 4.8  # width of the column on either side, in cells
_GAP: Final = 0.6  # between the board and a side column
_HEAD: Final = 1.3  # above the board, for a piece that is just entering
_FOOT: Final = 0.6
_WIDTH: Final = COLUMNS + 2 * (_SIDE + _GAP) + 0.5
_HEIGHT: Final = VISIBLE_ROWS + _HEAD + _FOOT
_LEAST_CELL: Final = 6  # pixels; below, nothing could be told apart


@dataclass(frozen=True, slots=True)
class Layout:
    """Pixels of the window.

    Attributes:
        area: Everything.
        cell: The side of one block.
        board: The visible twenty rows.
        hold: The card of the held piece.
        stats: The card of score, level, lines and pieces.
        next: The card of the next pieces.
    """

    area: pygame.Rect
    cell: int
    board: pygame.Rect
    hold: pygame.Rect
    stats: pygame.Rect
    next: pygame.Rect

    @classmethod
    def inside(cls, area: pygame.Rect) -> "Layout":
        """Fit the largest whole cell size into an area and centre everything in it."""
        cell = max(_LEAST_CELL, int(min(area.width / _WIDTH, area.height / _HEIGHT)))
        board = pygame.Rect(0, 0, COLUMNS * cell, VISIBLE_ROWS * cell)
        board.centerx = area.centerx
        board.top = area.top + round((area.height - _HEIGHT * cell) / 2 + _HEAD * cell)
        side, gap = round(_SIDE * cell), round(_GAP * cell)
        left, right = board.left - gap - side, board.right + gap
        hold = pygame.Rect(left, board.top, side, round(4.4 * cell))
        stats = pygame.Rect(left, hold.bottom + gap, side, board.bottom - hold.bottom - gap)
        following = pygame.Rect(right, board.top, side, round(15.7 * cell))
        return cls(area.copy(), cell, board, hold, stats, following)

    def at(self, x: float, y: float) -> tuple[int, int]:
        """Return the upper left pixel of a cell of the board."""
        return (
            round(self.board.left + x * self.cell),
            round(self.board.bottom - (y + 1) * self.cell),
        )
