"""Greedy search, and the features of a stack that all bots judge it by.

C. Thiery and B. Scherrer, Building Controllers for Tetris, ICGA Journal, 2009, define the
features; the weights are Dellacherie's, set by hand, and theirs, found by search ("BCTS"). The
greedy bot tries every place that the piece can reach by turning and shifting at its present
height and then dropping, and takes the best by Dellacherie's.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final, NamedTuple, Protocol

from tetris.bots.placements import paths
from tetris.engine.board import ROW, full_rows, open_row, row_shift, without_rows
from tetris.engine.events import Action
from tetris.engine.game import Game, Phase
from tetris.engine.pieces import COLUMNS, STRIDE, VISIBLE_ROWS, Piece
from tetris.engine.rules import Config

LOST: Final = -1e6  # of a landing that ends the game: the last resort
HEADROOM_ROWS: Final = 4  # above the visible ones; a piece can lock there
_GUIDELINE: Final = Config()


class Weights(NamedTuple):
    """Weight of each feature; the first two belong to the move, the others to the stack."""

    landing_height: float  # the row of the piece's middle, from 0
    eroded_cells: float  # rows cleared, times the piece's own cells in them
    row_transitions: float  # neighbours in a row of which one is filled; walls are
    column_transitions: float  # in a column; the floor is filled, the top has no neighbour
    holes: float  # empty cells with a block anywhere above
    wells: float  # 1 + ... + d for each run of d empty cells with both sides filled
    hole_depth: float = 0.0  # blocks right above holes
    rows_with_holes: float = 0.0


DELLACHERIE: Final = Weights(-1.0, 1.0, -1.0, -1.0, -4.0, -1.0)
BCTS: Final = Weights(-12.63, 6.60, -9.22, -19.77, -13.08, -10.49, -1.61, -24.04)

Surface = Callable[[int], float]  # a board's bits, without full rows, to what its stack is worth


@cache
def surface(
    weights: Weights = DELLACHERIE,
    columns: int = COLUMNS,
    rows: int = VISIBLE_ROWS + HEADROOM_ROWS,
) -> Surface:
    """Return a function from a board's bits, of which it sees so many rows, to its worth."""
    row = open_row(columns)
    cells = sum(row << row_shift(y) for y in range(rows))
    row_pairs = cells | cells >> 1  # the left one of each two neighbours, walls included
    column_pairs = sum(row << row_shift(y) for y in range(-1, rows - 1))  # the lower ones
    left = sum(2 << row_shift(y) for y in range(rows))  # the first column
    falls = [STRIDE << n for n in range((rows - 1).bit_length())]  # shifts by 1, 2, 4, ... rows
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


# -- the search --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Plan:
    """Placement of a piece; the value compares plans for one board and piece."""

    actions: tuple[Action, ...]  # from the present position; the last is a hard drop
    landing: Piece  # to be given back as `target` by who wants to keep to it
    value: float  # of the landing, less what the commands cost


class Planner(Protocol):
    """A bot; asked again after an action, it is told the landing that it wanted."""

    def __call__(self, game: Game, *, target: Piece | None = None) -> Plan:
        """Plan the piece in play from where it is now."""
        ...


def plan(game: Game, *, command_cost: float = 0.0, target: Piece | None = None) -> Plan:
    """Plan the piece in play from where it is now.

    Args:
        game: A game that is not over.
        command_cost: What each action takes off a landing's value; 0 plays best, 1 or 2 as a
            slow hand would.
        target: The landing of an earlier plan for this piece; kept while it can be reached.

    Raises:
        ValueError: The game is over.
    """
    if game.phase is Phase.OVER:
        raise ValueError("the game is over; restart it before planning")
    return plan_piece(
        game.board.bits, game.piece, game.config, command_cost=command_cost, target=target
    )


def plan_piece(
    bits: int,
    piece: Piece,
    config: Config = _GUIDELINE,
    *,
    command_cost: float = 0.0,
    target: Piece | None = None,
) -> Plan:
    """Plan a piece on a board's bits; otherwise like `plan`."""
    kept = None if target is None else target.mask
    best: Plan | None = None
    for landing, _, actions in paths(bits, piece, config.kicks, lowers=False):
        worth = value(bits, landing, config) - command_cost * len(actions)
        found = Plan(actions, landing, worth)
        if landing.mask == kept:
            return found
        if best is None or worth > best.value:  # among equals the first needs fewest actions
            best = found
    assert best is not None  # a piece can always fall from where it is
    return best


def value(bits: int, landing: Piece, config: Config = _GUIDELINE) -> float:
    """Return Dellacherie's value of a landing on a board's bits; higher is better."""
    after, eroded = settled(bits, landing, config.columns)
    return (
        DELLACHERIE.landing_height * middle(landing)
        + DELLACHERIE.eroded_cells * eroded
        + (LOST if loses(landing, config) else 0.0)
        + surface(DELLACHERIE, config.columns, config.rows + HEADROOM_ROWS)(after)
    )
