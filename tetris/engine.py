"""The game: actions and time in, events out.

The engine has no clock. `Game.update` is told the time, does what was due until then at
the moment it was due, and then carries out the player's actions. How time is cut into
updates therefore changes nothing, and a seed with the timed actions is a replay. Inside,
time is whole nanoseconds, so that sums are exact.

Rules: docs/tetris.md, with its recommendations where sources disagree.
"""

from collections import deque
from collections.abc import Sequence
from random import Random
from typing import Final

from tetris import events as happened
from tetris import moves, scoring
from tetris.board import Board
from tetris.events import Action, Event, TopOut
from tetris.pieces import KINDS, VISIBLE_ROWS, Kind, Piece
from tetris.rules import Config, Phase, seconds_per_row

__all__ = ["Action", "Config", "Event", "Game", "Phase", "TopOut"]

_NS: Final = 1_000_000_000
_TICK_NS: Final = 1  # "locks as soon as it touches": after the actions of the same moment


class Game:
    """One game after another on one board.

    Attributes:
        config: The rules.
        phase: Whether the game runs, pauses or is over.
        board: The blocks.
        piece: The piece in play; when the game is over, the one that ended it.
        hold: The held piece, if any.
        can_hold: Whether hold is allowed before the next lock.
        score: Points so far.
        lines: Rows cleared so far.
        level: The present level.
        pieces_placed: Pieces locked so far.
        streak: Whether a back-to-back chain is alive, and the present combo.
    """

    def __init__(self, seed: int, config: Config | None = None) -> None:
        self.config = config or Config()
        self._random = Random(seed)
        self._wall_ns = self._offset_ns = 0  # the caller's time, and when the game began in it
        self._now_ns = self._soft_since_ns = 0  # the game's own time, which pauses
        self._soft = self._started = False
        self._events: list[Event] = []
        self._begin()

    def update(
        self, time_s: float, actions: Sequence[Action] = (), *, soft_drop: bool = False
    ) -> list[Event]:
        """Let time pass, then act, and return what happened, oldest first.

        Args:
            time_s: The present time, never earlier than before. The first call says when
                the game begins.
            actions: What the player does at that time, in order.
            soft_drop: Whether soft drop is held from that time on, until the next update.

        Raises:
            ValueError: Time went backwards.
        """
        wall_ns = round(time_s * _NS)
        if not self._started:
            self._started = True
            self._offset_ns = wall_ns
            self._events = [happened.Spawned(time_s, self.piece)]
        elif wall_ns < self._wall_ns:
            raise ValueError(f"time went back from {self._wall_ns / _NS} s to {time_s} s")
        self._wall_ns = wall_ns
        self._advance(wall_ns - self._offset_ns)
        for action in actions:
            self._act(action)
        if soft_drop and not self._soft:
            self._soft_since_ns = self._now_ns
        self._soft = soft_drop
        events, self._events = self._events, []
        return events

    def set_up(self, board: Board, piece: Piece) -> None:
        """Go on from another position, with a piece that has just come there.

        Raises:
            ValueError: The piece lies on blocks or outside.
        """
        if not board.fits(piece):
            raise ValueError(f"{piece} does not fit on the board; put it where cells are free")
        self.board = board
        self._take(piece)

    @property
    def next(self) -> tuple[Kind, ...]:
        """The next pieces, the nearest first."""
        return tuple(self._queue)[: self.config.previews]

    @property
    def ghost_y(self) -> int:
        """The y of the piece's box if it were dropped now."""
        return self.piece.y - moves.rows_to_fall(self.board.bits, self.piece)

    @property
    def time_s(self) -> float:
        """Seconds played, without pauses."""
        return self._now_ns / _NS

    # -- a game, a piece ---------------------------------------------------------------

    def _begin(self) -> None:
        self.phase = Phase.RUNNING
        self.board = Board()
        self.hold: Kind | None = None
        self.can_hold = True
        self.score = self.lines = self.pieces_placed = 0
        self.level = self.config.start_level
        self.streak = scoring.Streak()
        self._queue: deque[Kind] = deque()
        self._enter(self._draw())

    def _draw(self) -> Kind:
        """Take the next piece; a new shuffled bag of seven comes in when few are left."""
        while len(self._queue) <= self.config.previews:
            # random() alone is promised to give the same numbers in every Python version.
            self._queue.extend(sorted(KINDS, key=lambda _: self._random.random()))
        return self._queue.popleft()

    def _enter(self, kind: Kind) -> None:
        piece = Piece.entering(kind)
        if not self.board.fits(piece):
            self.piece = piece
            self._end(TopOut.BLOCK_OUT)
            return
        # At once one row down where nothing is in the way: docs/tetris.md "spawn".
        self._take(moves.shifted(self.board.bits, piece, 0, -1) or piece)

    def _take(self, piece: Piece) -> None:
        self.piece = piece
        self._row_since_ns = self._now_ns
        self._resets = 0
        self._touched = False
        self._lowest = self.piece.lowest_row
        self._kick: int | None = None
        self._rest()
        self._tell(happened.Spawned(self._time_s(), self.piece))

    def _end(self, reason: TopOut) -> None:
        self._tell(happened.ToppedOut(self._time_s(), reason))
        self.phase = Phase.OVER

    # -- time --------------------------------------------------------------------------

    def _advance(self, until_ns: int) -> None:
        """Do all that is due, each thing at its own moment."""
        if self.phase is not Phase.RUNNING:
            return
        while True:
            due_ns = self._fall_due_ns() if self._lock_ns is None else self._lock_ns
            if due_ns > until_ns:
                break
            self._now_ns = due_ns
            if self._lock_ns is None:
                self._fall(Action.DOWN if self._soft else None)
            else:
                self._lock()
                if self.phase is not Phase.RUNNING:
                    return
        self._now_ns = until_ns

    def _fall_due_ns(self) -> int:
        gravity_s = seconds_per_row(min(self.level, self.config.gravity_cap))
        due_ns = self._row_since_ns + round(gravity_s * _NS)
        if self._soft:
            soft_ns = round(gravity_s * _NS / self.config.soft_drop_factor)
            due_ns = min(due_ns, max(self._row_since_ns, self._soft_since_ns) + soft_ns)
        return due_ns

    def _fall(self, action: Action | None) -> bool:
        """Move one row down, by gravity (None) or by soft drop; False on the ground."""
        fallen = moves.shifted(self.board.bits, self.piece, 0, -1)
        if fallen is None:
            return False
        self.piece = fallen
        self._row_since_ns = self._now_ns
        self._kick = None
        if action is Action.DOWN:
            self.score += scoring.SOFT_DROP_POINTS
        self._rest()
        self._tell(happened.Moved(self._time_s(), fallen, 0, -1, action))
        return True

    def _rest(self) -> None:
        """Start the lock delay if the piece is on the ground: docs/tetris.md "lock_down"."""
        if self.piece.lowest_row < self._lowest:
            self._lowest = self.piece.lowest_row
            self._resets = 0
            self._touched = False
        if moves.shifted(self.board.bits, self.piece, 0, -1):
            self._lock_ns: int | None = None
            return
        self._touched = True
        spent = self._resets >= self.config.lock_resets
        self._lock_ns = self._now_ns + (
            _TICK_NS if spent else round(self.config.lock_delay_s * _NS)
        )

    def _lock(self) -> None:
        piece, level = self.piece, self.level
        spin = moves.spin(self.board.bits, piece, self._kick)
        self.board.place(piece)
        self.pieces_placed += 1
        rows = self.board.clear_full_rows()
        clear, self.streak = scoring.judge(
            len(rows),
            spin,
            level=level,
            streak=self.streak,
            perfect=bool(rows) and self.board.is_empty,
        )
        self.score += clear.points
        self.lines += clear.lines
        self.level = scoring.level_of(self.lines, self.config.start_level)
        self._tell(happened.Locked(self._time_s(), piece, rows, clear))
        if self.level > level:
            self._tell(happened.LevelUp(self._time_s(), self.level))
        if piece.lowest_row >= VISIBLE_ROWS:
            self._end(TopOut.LOCK_OUT)
            return
        self.can_hold = True
        self._enter(self._draw())

    # -- actions -----------------------------------------------------------------------

    def _act(self, action: Action) -> None:
        if action is Action.RESTART:
            self._restart()
        elif action is Action.PAUSE and self.phase is not Phase.OVER:
            self._pause()
        elif self.phase is not Phase.RUNNING or not self._move(action):
            self._tell(happened.Blocked(self._time_s(), action))

    def _move(self, action: Action) -> bool:
        match action:
            case Action.LEFT:
                return self._shift(-1, action)
            case Action.RIGHT:
                return self._shift(1, action)
            case Action.ROTATE_CW:
                return self._rotate(moves.CW, action)
            case Action.ROTATE_CCW:
                return self._rotate(moves.CCW, action)
            case Action.DOWN:
                return self._fall(action)
            case Action.HARD_DROP:
                return self._drop()
            case Action.HOLD:
                return self._swap()
        return False

    def _shift(self, dx: int, action: Action) -> bool:
        piece = moves.shifted(self.board.bits, self.piece, dx)
        if piece is None:
            return False
        self._handled(piece, None)
        self._tell(happened.Moved(self._time_s(), piece, dx, 0, action))
        return True

    def _rotate(self, direction: moves.Direction, action: Action) -> bool:
        turned = moves.rotated(self.board.bits, self.piece, direction)
        if turned is None:
            return False
        piece, kick = turned
        self._handled(piece, kick)
        self._tell(happened.Rotated(self._time_s(), piece, kick, action))
        return True

    def _handled(self, piece: Piece, kick: int | None) -> None:
        """Take the piece's new place; once it has touched ground, this costs a reset."""
        grounded = self._lock_ns is not None
        self.piece, self._kick = piece, kick
        if self._touched:
            self._resets += 1
        self._rest()
        if grounded and self._lock_ns is None:  # it went over an edge, and begins to fall now
            self._row_since_ns = self._now_ns

    def _drop(self) -> bool:
        rows = moves.rows_to_fall(self.board.bits, self.piece)
        if rows:
            self.piece = Piece(self.piece.kind, self.piece.x, self.piece.y - rows, self.piece.turn)
            self._kick = None
        self.score += scoring.HARD_DROP_POINTS * rows
        self._tell(happened.Dropped(self._time_s(), self.piece, rows))
        self._lock()
        return True

    def _swap(self) -> bool:
        if not self.can_hold:
            return False
        kind, self.hold = self.hold, self.piece.kind
        self._tell(happened.Held(self._time_s(), self.hold))
        self.can_hold = False
        self._enter(kind or self._draw())
        return True

    def _pause(self) -> None:
        if self.phase is Phase.RUNNING:
            self._tell(happened.Paused(self._time_s()))
            self.phase = Phase.PAUSED
        else:
            self.phase = Phase.RUNNING
            self._offset_ns = self._wall_ns - self._now_ns
            self._tell(happened.Resumed(self._time_s()))

    def _restart(self) -> None:
        """Begin anew with a fresh bag; the random numbers go on, so a replay stays one."""
        self._offset_ns = self._wall_ns
        self._now_ns = self._soft_since_ns = 0
        self.phase = Phase.RUNNING
        self._tell(happened.Restarted(self._time_s()))
        self._begin()

    # -- telling -----------------------------------------------------------------------

    def _time_s(self) -> float:
        running = self.phase is Phase.RUNNING
        return (self._offset_ns + self._now_ns if running else self._wall_ns) / _NS

    def _tell(self, event: Event) -> None:
        self._events.append(event)
