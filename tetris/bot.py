"""A player that looks one piece ahead and may be asked again after every command.

It tries every place that the piece can reach by turning and shifting at its present
height and then dropping, and takes the best by Dellacherie's six features and weights, as
C. Thiery and B. Scherrer report them: Building Controllers for Tetris, ICGA Journal, 2009.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from tetris import moves
from tetris.board import ROW, full_rows, row_shift, without_rows
from tetris.engine import Game, Phase
from tetris.events import Action
from tetris.pieces import STRIDE, VISIBLE_ROWS, Piece

_HEIGHT: Final = -1.0
_ERODED: Final = 1.0
_ROW_TRANSITIONS: Final = -1.0
_COLUMN_TRANSITIONS: Final = -1.0
_HOLES: Final = -4.0
_WELLS: Final = -1.0
_LOCK_OUT: Final = -1e6  # a landing that ends the game is the last resort

_SEEN_ROWS: Final = VISIBLE_ROWS + 4  # what the features look at
_CELLS: Final = sum(ROW << row_shift(y) for y in range(_SEEN_ROWS))
_PAIRS: Final = _CELLS | _CELLS >> 1  # the left one of each two neighbours, walls included
_STACKED: Final = _CELLS | ROW << row_shift(-1)  # the lower one of each two, floor included
_TURNS: Final[tuple[tuple[Action, moves.Direction], ...]] = (
    (Action.ROTATE_CW, moves.CW),
    (Action.ROTATE_CCW, moves.CCW),
)
_SHIFTS: Final = ((Action.LEFT, -1), (Action.RIGHT, 1))


@dataclass(frozen=True, slots=True)
class Plan:
    """Where to put the piece, and how.

    Attributes:
        actions: What to do from the present position, in order; the last is a hard drop.
        landing: The piece where it will lock. Give it back as `target` to keep to it.
        value: How good the landing is, the cost of the commands included; comparable
            between plans for one board and piece.
    """

    actions: tuple[Action, ...]
    landing: Piece
    value: float


def plan(game: Game, *, command_cost: float = 0.0, target: Piece | None = None) -> Plan:
    """Plan the piece in play from where it is now.

    Args:
        game: A game that is not over.
        command_cost: What each action takes off a landing's value. 0 plays best; with 1 or
            2 the bot prefers landings that need few actions, as a slow hand would.
        target: The landing of an earlier plan for this piece; kept while it can be reached.

    Raises:
        ValueError: The game is over.
    """
    if game.phase is Phase.OVER:
        raise ValueError("the game is over; restart it before planning")
    return plan_piece(game.board.bits, game.piece, command_cost=command_cost, target=target)


def plan_piece(
    bits: int, piece: Piece, *, command_cost: float = 0.0, target: Piece | None = None
) -> Plan:
    """Plan a piece on a board's bits; otherwise like `plan`."""
    kept = None if target is None else target.mask
    best: Plan | None = None
    for landing, actions in landings(bits, piece):
        worth = value(bits, landing) - command_cost * len(actions)
        found = Plan(actions, landing, worth)
        if landing.mask == kept:
            return found
        if best is None or worth > best.value:  # among equals the first needs fewest actions
            best = found
    assert best is not None  # a piece can always fall from where it is
    return best


def landings(bits: int, piece: Piece) -> list[tuple[Piece, tuple[Action, ...]]]:
    """Return every landing in reach with the fewest actions to it, the shortest first."""
    found: list[tuple[Piece, tuple[Action, ...]]] = []
    landed_masks: set[int] = set()
    seen = {piece}
    queue: deque[tuple[Piece, tuple[Action, ...]]] = deque([(piece, ())])
    while queue:
        here, actions = queue.popleft()
        landing = moves.landed(bits, here)
        mask = landing.mask
        if mask not in landed_masks:  # turned pieces often fill the same cells
            landed_masks.add(mask)
            found.append((landing, (*actions, Action.HARD_DROP)))
        for there, action in _steps(bits, here):
            if there not in seen:
                seen.add(there)
                queue.append((there, (*actions, action)))
    return found


def _steps(bits: int, piece: Piece) -> list[tuple[Piece, Action]]:
    steps = []
    for action, dx in _SHIFTS:
        if shifted := moves.shifted(bits, piece, dx):
            steps.append((shifted, action))
    if piece.kind != "O":
        for action, direction in _TURNS:
            if turned := moves.rotated(bits, piece, direction):
                steps.append((turned[0], action))
    return steps


def value(bits: int, landing: Piece) -> float:
    """Return Dellacherie's value of a landing; higher is better.

    Args:
        bits: The board before the piece locks.
        landing: The piece where it will lock.
    """
    cells = landing.cells
    rows = {y for _, y in cells}
    lowest, highest = min(rows), max(rows)
    bits |= landing.mask
    cleared = full_rows(bits, lowest, highest)
    worth = _HEIGHT * (lowest + highest) / 2 + (_LOCK_OUT if lowest >= VISIBLE_ROWS else 0.0)
    if cleared:
        worth += _ERODED * len(cleared) * sum(y in cleared for _, y in cells)
        bits = without_rows(bits, cleared)
    return worth + surface(bits)


def surface(bits: int) -> float:
    """Return the weighted transitions, holes and wells of a board without full rows."""
    empty = ~bits & _CELLS
    cover = bits & _CELLS
    for rows in (1, 2, 4, 8, 16):  # every cell at or below a block
        cover |= cover >> rows * STRIDE
    wells = well = empty & bits << 1 & bits >> 1
    depth_sum = wells.bit_count()
    while well:  # a well cell counts once more for every empty cell right below it
        well = well >> STRIDE & empty
        depth_sum += well.bit_count()
    return (
        _ROW_TRANSITIONS * ((bits ^ bits >> 1) & _PAIRS).bit_count()
        + _COLUMN_TRANSITIONS * ((bits ^ bits >> STRIDE) & _STACKED).bit_count()
        + _HOLES * (cover & empty).bit_count()
        + _WELLS * depth_sum
    )
