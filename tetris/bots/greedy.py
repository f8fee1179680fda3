"""Greedy search: looks one piece ahead; callers may plan again after every command.

It tries every place that the piece can reach by turning and shifting at its present
height and then dropping, and takes the best by Dellacherie's six features and weights, as
C. Thiery and B. Scherrer report them: Building Controllers for Tetris, ICGA Journal, 2009.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from tetris.bots.features import DELLACHERIE, HEADROOM_ROWS, loses, middle, settled, surface
from tetris.bots.paths import neighbours
from tetris.engine import moves
from tetris.engine.events import Action
from tetris.engine.game import Game, Phase
from tetris.engine.kicks import Kicks
from tetris.engine.pieces import Piece
from tetris.engine.rules import Config

LOST: Final = -1e6  # of a landing that ends the game: the last resort

_GUIDELINE: Final = Config()


@dataclass(frozen=True, slots=True)
class Plan:
    """Placement of the piece, and the actions to it.

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
    for landing, actions in landings(bits, piece, config.kicks):
        worth = value(bits, landing, config) - command_cost * len(actions)
        found = Plan(actions, landing, worth)
        if landing.mask == kept:
            return found
        if best is None or worth > best.value:  # among equals the first needs fewest actions
            best = found
    assert best is not None  # a piece can always fall from where it is
    return best


def landings(
    bits: int, piece: Piece, kicks: Kicks = "srs"
) -> list[tuple[Piece, tuple[Action, ...]]]:
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
        for there, action, _ in neighbours(bits, here, moves.TABLES[kicks]):
            if action is not Action.DOWN and there not in seen:
                seen.add(there)
                queue.append((there, (*actions, action)))
    return found


def value(bits: int, landing: Piece, config: Config = _GUIDELINE) -> float:
    """Return Dellacherie's value of a landing; higher is better.

    Args:
        bits: The board before the piece locks.
        landing: The piece where it will lock.
        config: The rules; the size of the board is what matters.
    """
    after, eroded = settled(bits, landing, config.columns)
    return (
        DELLACHERIE.landing_height * middle(landing)
        + DELLACHERIE.eroded_cells * eroded
        + (LOST if loses(landing, config) else 0.0)
        + surface(DELLACHERIE, config.columns, config.rows + HEADROOM_ROWS)(after)
    )
