"""Features of the field for evaluating a stack, counted on the board's bits.

C. Thiery and B. Scherrer, Building Controllers for Tetris, ICGA Journal, 2009, define the
features; the weights are Dellacherie's, set by hand, and theirs, found by search ("BCTS").
"""

from collections.abc import Callable
from functools import cache
from typing import Final, NamedTuple

from tetris.engine.board import ROW, full_rows, open_row, row_shift, without_rows
from tetris.engine.pieces import COLUMNS, STRIDE, VISIBLE_ROWS, Piece
from tetris.engine.rules import Config

HEADROOM_ROWS: Final = 4  # above the visible ones; a piece can lock there


class Weights(NamedTuple):
    """Weight of each feature; the first two belong to the move, the others to the stack.

    Attributes:
        landing_height: The row of the piece's middle, from 0.
        eroded_cells: Rows cleared, times the piece's own cells in them.
        row_transitions: Neighbours in a row of which one is filled; walls are.
        column_transitions: The same in a column; the floor is filled, and the top has no
            neighbour.
        holes: Empty cells with a block anywhere above.
        wells: For each run of d empty cells in a column with both sides filled, 1 + ... + d.
        hole_depth: Blocks right above holes.
        rows_with_holes: Rows with at least one.
    """

    landing_height: float
    eroded_cells: float
    row_transitions: float
    column_transitions: float
    holes: float
    wells: float
    hole_depth: float = 0.0
    rows_with_holes: float = 0.0


DELLACHERIE: Final = Weights(-1.0, 1.0, -1.0, -1.0, -4.0, -1.0)
BCTS: Final = Weights(-12.63, 6.60, -9.22, -19.77, -13.08, -10.49, -1.61, -24.04)

Surface = Callable[[int], float]  # a board's bits, without full rows, to what its stack is worth


class _Masks(NamedTuple):
    cells: int
    row_pairs: int  # the left one of each two neighbours, walls included
    column_pairs: int  # the lower one of each two, floor included
    left: int  # the first column
    falls: tuple[int, ...]  # shifts by 1, 2, 4, ... rows, enough for all


@cache
def _masks(columns: int, rows: int) -> _Masks:
    row = open_row(columns)
    cells = sum(row << row_shift(y) for y in range(rows))
    below = sum(row << row_shift(y) for y in range(-1, rows - 1))
    falls, fall = [], 1
    while fall < rows:
        falls.append(fall * STRIDE)
        fall *= 2
    left = sum(2 << row_shift(y) for y in range(rows))
    return _Masks(cells, cells | cells >> 1, below, left, tuple(falls))


@cache
def surface(
    weights: Weights = DELLACHERIE,
    columns: int = COLUMNS,
    rows: int = VISIBLE_ROWS + HEADROOM_ROWS,
) -> Surface:
    """Return a function from a board's bits to what its stack is worth.

    Args:
        weights: The features' weights.
        columns: Of the board.
        rows: How many to look at, from the lowest.
    """
    cells, row_pairs, column_pairs, left, falls = _masks(columns, rows)
    _, _, by_row, by_column, by_hole, by_well, by_depth, by_holed = weights

    def worth(bits: int) -> float:
        empty = ~bits & cells
        cover = bits & cells
        for fall in falls:  # every cell at or below a block
            cover |= cover >> fall
        wells = deeper = empty & bits << 1 & bits >> 1
        depth_sum = 0
        while deeper:  # the second time around, what has one more above it, and so on
            depth_sum += deeper.bit_count()
            deeper = deeper >> STRIDE & wells
        holes = cover & empty
        value = (
            by_row * ((bits ^ bits >> 1) & row_pairs).bit_count()
            + by_column * ((bits ^ bits >> STRIDE) & column_pairs).bit_count()
            + by_well * depth_sum
        )
        if holes:
            value += by_hole * holes.bit_count()
            if by_depth:
                value += by_depth * _depth(bits & cells, holes)
            if by_holed:
                value += by_holed * _holed_rows(holes, left)
        return value

    return worth


def middle(landing: Piece) -> float:
    """Return the row of a piece's middle: its landing height."""
    return (landing.lowest_row + landing.highest_row) / 2


def loses(landing: Piece, config: Config) -> bool:
    """Return whether a piece that locks there ends the game, rows that it clears aside."""
    row = landing.highest_row if config.partial_lock_out else landing.lowest_row
    return row >= config.rows


def settled(bits: int, landing: Piece, columns: int = COLUMNS) -> tuple[int, int]:
    """Return the board after a piece has locked and its rows are gone, and the eroded cells."""
    mask = landing.mask
    bits |= mask
    rows = full_rows(bits, landing.lowest_row, landing.highest_row)
    if not rows:
        return bits, 0
    cells = sum((mask >> row_shift(y) & ROW).bit_count() for y in rows)
    return without_rows(bits, rows, columns), len(rows) * cells


def _depth(blocks: int, holes: int) -> int:
    depth = 0
    above = holes << STRIDE & blocks
    while above:
        depth += above.bit_count()
        above = above << STRIDE & blocks
    return depth


def _holed_rows(holes: int, left: int) -> int:
    """Fold each row into its first column; the shifts reach over nine columns."""
    holes |= holes >> 1
    holes |= holes >> 2
    holes |= holes >> 4
    holes |= holes >> 2
    return (holes & left).bit_count()
