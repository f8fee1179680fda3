"""Beam search over the pieces in sight, with the hold.

Each piece in turn is put to every place that it can reach, tucked in and spun too, and only
the best boards are pursued. A way is worth what its moves earn and what its last board is
worth, by the weights `greedy.BCTS`. On ten columns, as long as the stack is low, it builds for four
rows at once: the right column stays free, and rows that lack only it count as closed.
"""

from collections.abc import Iterator
from operator import itemgetter
from typing import Final, NamedTuple

from tetris.bots.greedy import BCTS, HEADROOM_ROWS, LOST, Plan, loses, middle, settled, surface
from tetris.bots.placements import find, path
from tetris.engine.board import open_row, row_shift
from tetris.engine.events import Action
from tetris.engine.game import Game
from tetris.engine.moves import entered
from tetris.engine.pieces import COLUMNS, Kind, Piece
from tetris.engine.rules import Config

QUAD: Final = 200.0  # for four rows at once
FEWER: Final = -160.0  # for one to three
IN_WELL: Final = -20.0  # for each block in the right column
LOW_ROWS: Final = 12  # a stack within them is low
WIDTH: Final = 14  # boards pursued after each piece
DEPTH: Final = 4  # pieces, the one in play included
_LEFT, _RIGHT, _QUAD_ROWS = 2, 1 << COLUMNS, 4  # bits of the first and the last column of a row


class _Way(NamedTuple):
    """Moves from the present to a board in the future."""

    worth: float  # what the moves have earned, and what the board is worth
    earned: float
    bits: int  # the board
    hold: Kind | None
    used: int  # pieces taken from the queue; the one in play is the first
    holding: bool  # whether the first move is to hold
    landing: Piece  # where the first move's piece locks


_worth = itemgetter(0)


def plan(
    game: Game, *, target: Piece | None = None, width: int = WIDTH, depth: int = DEPTH
) -> Plan:
    """Plan the piece in play, or the one that hold brings, from where it is now.

    Args:
        game: A game with a piece in play.
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
        kept = path(bits, piece, target, kicks)
        if kept:
            return Plan(kept, target, 0.0)
    best = _Search(game).best(width, depth)
    start = _entered(bits, best.landing.kind, game.config) if best.holding else piece
    assert start is not None
    actions = path(bits, start, best.landing, kicks)
    assert actions is not None  # it was found by the same rules
    return Plan(((Action.HOLD,) if best.holding else ()) + actions, best.landing, best.worth)


class _Search:
    def __init__(self, game: Game) -> None:
        self._game, self._config = game, game.config
        self._queue: tuple[Kind, ...] = (game.piece.kind, *game.next)
        rows = self._config.rows + HEADROOM_ROWS
        self._surface = surface(BCTS, self._config.columns, rows)
        self._builds = self._config.columns == COLUMNS and self._config.rows > LOW_ROWS
        self._right = sum(_RIGHT << row_shift(y) for y in range(rows))
        self._left = sum(_LEFT << row_shift(y) for y in range(rows))
        self._high = sum(open_row(COLUMNS) << row_shift(y) for y in range(LOW_ROWS, rows))

    def best(self, width: int, depth: int) -> _Way:
        """Return the best way; a short one where all longer ones end the game."""
        game = self._game
        here = _Way(0.0, 0.0, game.board.bits, game.hold, 0, False, game.piece)
        ways = list(self._next(here, first=True))
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

    def _next(self, way: _Way, first: bool = False) -> Iterator[_Way]:
        game, bits = self._game, way.bits
        choices = self._choices(way.hold, way.used, not first or game.can_hold)
        for holding, (kind, hold, used) in enumerate(choices):
            in_play = first and not holding
            piece = game.piece if in_play else _entered(bits, kind, self._config)
            if piece is None:
                continue
            for landing in find(bits, piece, self._config.kicks):
                after, earned = self._settled(bits, landing)
                earned += way.earned
                worth = earned + self._worth(after)
                begun = (bool(holding), landing) if first else (way.holding, way.landing)
                yield _Way(worth, earned, after, hold, used, *begun)

    def _choices(
        self, hold: Kind | None, used: int, can_hold: bool
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
        if eroded and self._builds and not bits & self._high:
            rows = (bits.bit_count() + len(landing.cells) - after.bit_count()) // COLUMNS
            earned += QUAD if rows == _QUAD_ROWS else FEWER
        return after, earned + (LOST if loses(landing, self._config) else 0.0)

    def _worth(self, bits: int) -> float:
        """Return what a board is worth; a low one without the cells that a long piece will fill."""
        if not self._builds or bits & self._high:
            return self._surface(bits)
        pair = bits & bits >> 1
        four = pair & pair >> 2
        ready = four & four >> 4 & bits >> 8 & self._left  # nine in a row, from the first column
        closed = bits | ready << COLUMNS - 1
        return self._surface(closed) + IN_WELL * (bits & self._right).bit_count()


def _entered(bits: int, kind: Kind, config: Config) -> Piece | None:
    """Return a piece that has just come; None where it cannot, and the game is over."""
    return entered(bits, Piece.entering(kind, config.columns, config.rows))
