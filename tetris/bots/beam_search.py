"""Beam search over the pieces in sight, with the hold.

Each piece in turn is put to every place that it can reach, tucked in and spun too, and only
the best boards are pursued. A way is worth what its moves earn and what its last board is
worth, by the features and weights of `features.BCTS`.
"""

from collections.abc import Iterator
from operator import itemgetter
from typing import Final, NamedTuple

from tetris.bots.features import BCTS, HEADROOM_ROWS, loses, middle, settled, surface
from tetris.bots.greedy import LOST, Plan
from tetris.bots.paths import path, paths
from tetris.bots.placements import find
from tetris.engine.events import Action
from tetris.engine.game import Game
from tetris.engine.moves import entered
from tetris.engine.pieces import Kind, Piece
from tetris.engine.rules import Config

WIDTH: Final = 8  # boards pursued after each piece
DEPTH: Final = 4  # pieces, the one in play included
_HOLE: Final = 4.0  # what a hole costs in the units of `command_cost`: Dellacherie's


class _Way(NamedTuple):
    """Moves from the present to a board in the future.

    Attributes:
        worth: What the moves have earned, and what the board is worth.
        earned: The first of these.
        bits: The board.
        hold: The held piece.
        used: Pieces taken from the queue; the one in play is the first.
        holding: Whether the first move is to hold.
        landing: Where the first move's piece locks.
    """

    worth: float
    earned: float
    bits: int
    hold: Kind | None
    used: int
    holding: bool
    landing: Piece


_worth = itemgetter(0)


def plan(
    game: Game,
    *,
    command_cost: float = 0.0,
    target: Piece | None = None,
    width: int = WIDTH,
    depth: int = DEPTH,
) -> Plan:
    """Plan the piece in play, or the one that hold brings, from where it is now.

    Args:
        game: A game with a piece in play.
        command_cost: What each action of this move takes off its value; as in `greedy.plan`.
        target: The landing of an earlier plan for this piece; kept while it can be reached.
        width: How many boards to pursue after each piece.
        depth: How many pieces to look ahead; no further than can be seen.

    Raises:
        ValueError: No piece is in play.
    """
    if not game.in_play:
        raise ValueError("no piece is in play; wait for one, or restart the game")
    bits, piece, kicks = game.board.bits, game.piece, game.config.kicks
    if target is not None and target.kind == piece.kind:
        kept = path(bits, piece, target, kicks=kicks)
        if kept:
            return Plan(kept, target, 0.0)
    best = _Search(game).best(width, depth, command_cost * BCTS.holes / -_HOLE)
    start = _entered(bits, best.landing.kind, game.config) if best.holding else piece
    assert start is not None
    actions = path(bits, start, best.landing, kicks=kicks)
    assert actions is not None  # it was found by the same rules
    return Plan(((Action.HOLD,) if best.holding else ()) + actions, best.landing, best.worth)


class _Search:
    def __init__(self, game: Game) -> None:
        self._game, self._config = game, game.config
        self._queue: tuple[Kind, ...] = (game.piece.kind, *game.next)
        rows = self._config.rows + HEADROOM_ROWS
        self._surface = surface(BCTS, self._config.columns, rows)

    def best(self, width: int, depth: int, action_cost: float) -> _Way:
        """Return the best way; a short one where all longer ones end the game."""
        ways = self._first(action_cost)
        best = max(ways, key=_worth)
        for _ in range(1, depth):
            ways.sort(key=_worth, reverse=True)
            further: dict[tuple[int, Kind | None, int], _Way] = {}
            for way in ways[:width]:
                for new in self._next(way):
                    key = (new.bits, new.hold, new.used)
                    if key not in further or further[key].worth < new.worth:
                        further[key] = new
            if not further:
                break
            ways = list(further.values())
            best = max(ways, key=_worth)
        return best

    def _first(self, action_cost: float) -> list[_Way]:
        """Return all ways of one move."""
        game, kicks = self._game, self._config.kicks
        bits = game.board.bits
        ways: list[_Way] = []
        for kind, hold, used in self._choices(game.hold, 0, can_hold=game.can_hold):
            holding = bool(ways)  # the piece in play comes first
            piece = _entered(bits, kind, self._config) if holding else game.piece
            if piece is None:
                continue
            costs: dict[int, float] = {}
            if action_cost:
                for place, actions in paths(bits, piece, kicks).items():
                    cost = action_cost * (len(actions) + holding)
                    costs.setdefault(place.piece.mask, cost)
            for landing in find(bits, piece, kicks).pieces():
                after, earned = self._settled(bits, landing)
                earned -= costs.get(landing.mask, 0.0)
                worth = earned + self._surface(after)
                ways.append(_Way(worth, earned, after, hold, used, holding, landing))
        return ways

    def _next(self, way: _Way) -> Iterator[_Way]:
        """Continue a way by one move."""
        bits, kicks = way.bits, self._config.kicks
        for kind, hold, used in self._choices(way.hold, way.used):
            piece = _entered(bits, kind, self._config)
            if piece is None:
                continue
            for landing in find(bits, piece, kicks).pieces():
                after, earned = self._settled(bits, landing)
                earned += way.earned
                worth = earned + self._surface(after)
                yield _Way(worth, earned, after, hold, used, way.holding, way.landing)

    def _choices(
        self, hold: Kind | None, used: int, *, can_hold: bool = True
    ) -> Iterator[tuple[Kind, Kind | None, int]]:
        """Return what may be played next, what is held then, and how much of the queue is used."""
        queue = self._queue
        if used >= len(queue):
            return
        yield queue[used], hold, used + 1
        if not (can_hold and self._config.hold):
            return
        if hold is not None:
            yield hold, queue[used], used + 1
        elif used + 1 < len(queue):
            yield queue[used + 1], queue[used], used + 2

    def _settled(self, bits: int, landing: Piece) -> tuple[int, float]:
        """Return the board after a move, and what the move earns."""
        after, eroded = settled(bits, landing, self._config.columns)
        earned = BCTS.landing_height * middle(landing) + BCTS.eroded_cells * eroded
        return after, earned + (LOST if loses(landing, self._config) else 0.0)


def _entered(bits: int, kind: Kind, config: Config) -> Piece | None:
    """Return a piece that has just come; None where it cannot, and the game is over."""
    return entered(bits, Piece.entering(kind, config.columns, config.rows))
