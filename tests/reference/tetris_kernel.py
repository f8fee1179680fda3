"""Reference game of pieces and blocks, without time, points and events.

With the same seed, rules and actions it deals, turns, drops, clears and tops out as
`engine.Game` does while no time passes, which tests check move by move.
"""

from collections import deque
from typing import Final

from tetris.engine.board import Board, full_rows, without_rows
from tetris.engine.events import Action
from tetris.engine.game import Game, Phase
from tetris.engine.moves import TABLES, lowered, rows_to_fall
from tetris.engine.pieces import KINDS, STRIDE, Kind, Piece
from tetris.engine.rules import Config, Randomizer

# Members by their bare names: looking them up in their class takes longer than a shift.
_LEFT, _RIGHT, _DOWN, _HARD_DROP = Action.LEFT, Action.RIGHT, Action.DOWN, Action.HARD_DROP
_ROTATE_CW, _ROTATE_CCW, _HOLD = Action.ROTATE_CW, Action.ROTATE_CCW, Action.HOLD
MOVES: Final = (_LEFT, _RIGHT, _DOWN, _HARD_DROP, _ROTATE_CW, _ROTATE_CCW, _HOLD)
_STANDARD: Final = Config()


class Kernel:
    """One game after another, action by action; what can be seen has the names of `Game`."""

    __slots__ = (
        "_columns", "_dealer", "_entrances", "_holds", "_partial", "_previews", "_queue", "_rows",
        "_start", "_table", "bits", "can_hold", "hold", "lines", "over", "piece", "pieces_placed",
    )  # fmt: skip
    piece: Piece  # when the game is over, the one that ended it

    def __init__(self, seed: int, config: Config = _STANDARD) -> None:
        """Begin a game; of the rules, those count that have nothing to do with time."""
        self._dealer = Randomizer(seed, config.randomiser)
        self._columns, self._rows = config.columns, config.rows
        self._entrances = {
            kind: Piece.entering(kind, config.columns, config.rows) for kind in KINDS
        }
        self._table = TABLES[config.kicks]
        self._previews = config.previews
        self._holds = config.hold
        self._partial = config.partial_lock_out
        self._start = Board.parse(config.board, config.columns).bits
        self._queue: deque[Kind] = deque()
        self.restart()

    def restart(self) -> None:
        """Begin anew; the random numbers go on."""
        self.bits = self._start  # the board: see `tetris.engine.board`
        self.hold: Kind | None = None
        self.can_hold = self._holds
        self.lines = self.pieces_placed = 0
        self.over = False
        self._queue.clear()
        self._enter(self._draw())

    @property
    def next(self) -> tuple[Kind, ...]:
        """The next pieces, the nearest first."""
        return tuple(self._queue)[: self._previews]

    def step(self, action: Action) -> bool:
        """Carry an action out; False if there is no room for it or no game."""
        if self.over:
            return False
        if action is _LEFT:
            piece = self.piece.left
        elif action is _RIGHT:
            piece = self.piece.right
        elif action is _HARD_DROP:
            self._drop()
            return True
        elif action is _ROTATE_CW or action is _ROTATE_CCW:
            bits = self.bits
            for piece in self.piece.turned[self._table + (action is _ROTATE_CCW)]:
                if not bits & piece.mask:
                    self.piece = piece
                    return True
            return False
        elif action is _DOWN:
            piece = self.piece.below
        elif action is _HOLD:
            return self._swap()
        else:
            return False
        if self.bits & piece.mask:
            return False
        self.piece = piece
        return True

    def _drop(self) -> None:
        piece = self.piece
        fall = rows_to_fall(self.bits, piece)
        bits = self.bits | piece.mask >> fall * STRIDE
        lowest, highest = piece.lowest_row - fall, piece.highest_row - fall
        rows = full_rows(bits, lowest, highest)
        if rows:
            bits = without_rows(bits, rows, self._columns)
            self.lines += len(rows)
        self.bits = bits
        self.pieces_placed += 1
        if (highest if self._partial else lowest) >= self._rows:
            self.over = True
            self.piece = lowered(piece, fall)
            return
        self.can_hold = self._holds
        self._enter(self._draw())

    def _swap(self) -> bool:
        if not self.can_hold:
            return False
        kind, self.hold = self.hold, self.piece.kind
        self.can_hold = False
        self._enter(kind or self._draw())
        return True

    def _draw(self) -> Kind:
        queue = self._queue
        while len(queue) <= self._previews:
            queue.extend(self._dealer.deal())
        return queue.popleft()

    def _enter(self, kind: Kind) -> None:
        piece, bits = self._entrances[kind], self.bits
        if bits & piece.mask:
            self.over = True
        elif not bits & piece.below.mask:
            piece = piece.below
        self.piece = piece


def agree(kernel: Kernel, game: Game) -> bool:
    """Return whether a kernel and a game stand at the same moment."""
    return (
        game.phase is (Phase.OVER if kernel.over else Phase.RUNNING)
        and all(
            getattr(kernel, name) == getattr(game, name)
            for name in ("piece", "hold", "next", "lines", "pieces_placed")
        )
        and kernel.bits == game.board.bits
    )
