"""The game: inputs and time in, events out. Rules: docs/tetris.md.

The engine has no clock. `Game.update` is told the time, does what was due until then at
the moment it was due, and then carries out the inputs. How time is cut into updates
therefore changes nothing, and seed, rules and timed inputs are a replay. Inside, time is
whole nanoseconds, so that sums are exact.
"""

from collections import deque
from collections.abc import Collection, Sequence
from typing import Final

from tetris.engine import events as happened
from tetris.engine import moves, scoring
from tetris.engine.board import GARBAGE, Board
from tetris.engine.events import Action, Event, Finish, Gravity, Input, TopOut
from tetris.engine.moves import Spin
from tetris.engine.pieces import KINDS, Kind, Piece
from tetris.engine.rules import LOCK_ROWS, Config, Phase, Randomizer, seconds_per_row
from tetris.engine.snapshot import CLOCK, NS, POSITION, Snapshot

__all__ = [
    "Action",
    "Config",
    "Event",
    "Finish",
    "Game",
    "Gravity",
    "Input",
    "Phase",
    "Snapshot",
    "TopOut",
]

# Members by their bare names: looking them up in their class takes longer than a shift.
_LEFT, _RIGHT, _DOWN, _HARD_DROP = Action.LEFT, Action.RIGHT, Action.DOWN, Action.HARD_DROP
_ROTATE_CW, _ROTATE_CCW, _HOLD = Action.ROTATE_CW, Action.ROTATE_CCW, Action.HOLD
_RUNNING: Final = Phase.RUNNING
_NEVER: Final = 1 << 62  # later than any moment, in nanoseconds
_TICK_NS: Final = 1  # "locks as soon as it touches": after the inputs of the same moment


class Game:
    """One game after another on one board."""

    phase: Phase
    board: Board
    piece: Piece  # in play; else the one before, and at the end the one that ended the game
    result: TopOut | Finish | None  # how the game ended; None before
    hold: Kind | None
    score: int
    lines: int
    level: int
    pieces_placed: int
    streak: scoring.Streak
    row_us: int | None  # of the last `Gravity`; None while gravity is that of the level

    def __init__(self, seed: int, config: Config | None = None) -> None:
        config = config or Config()
        self.seed: Final = seed
        self.config: Final = config
        # Whether the piece can be moved: not between a lock and the next entrance, nor at the end.
        self.in_play = False
        self.can_hold = False  # before the next lock
        self._dealer = Randomizer(seed, config.randomiser)
        self._queue: deque[Kind] = deque()
        self._events: list[Event] = []
        self._past: Snapshot | None = None
        self._entrances = {
            kind: Piece.entering(kind, config.columns, config.rows) for kind in KINDS
        }
        self._table = moves.TABLES[config.kicks]
        self._started = self._soft = self._touched = False
        self._initial: Collection[Action] = ()
        self._wall_ns = self._offset_ns = 0  # the caller's time, and when the game began in it
        self._now_ns = self._soft_since_ns = 0  # the game's own time, which pauses
        self._at_s = 0.0  # the caller's time of what happens now
        self._row_since_ns = self._guard_ns = self._resets = self._lowest = 0
        self._lock_ns: int | None = None  # when the piece locks; None in the air
        self._enter_ns: int | None = None  # when the next one enters; None while one is in play
        self._ground_ns: int | None = None  # when it touched ground after its last fall
        self._kick: int | None = None  # of the turn that was the piece's last movement
        self._gravity_ns = self._soft_ns = self._next_ns = self._due_ns = _NEVER
        self._delay_ns = _NEVER
        self._guard_span_ns = round(config.guard_s * NS)
        self._generation_ns = round(config.generation_delay_s * NS)
        limit_s = config.time_limit_s
        self._limit_ns = _NEVER if limit_s is None else round(limit_s * NS)
        self._begin()

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
        return self._now_ns / NS

    @property
    def pieces_per_s(self) -> float:
        """Pieces placed a second; 0 before any time has passed."""
        return self.pieces_placed / self.time_s if self._now_ns else 0.0

    @property
    def garbage_rows(self) -> int:
        """Number of rows that hold blocks that no piece left."""
        return sum(GARBAGE in row for row in self.board.rows)

    def update(
        self,
        time_s: float,
        inputs: Sequence[Input] = (),
        *,
        soft_drop: bool = False,
        initial: Collection[Action] = (),
    ) -> list[Event]:
        """Let time pass, then act, and return what happened, oldest first.

        Args:
            time_s: The present time, never earlier than before; the game begins at the first.
            inputs: What the player does at that time, in order.
            soft_drop: Whether soft drop is held from that time on, until the next update.
            initial: Which of hold and the turns are held, for a piece that enters meanwhile.

        Raises:
            ValueError: Time went backwards.
        """
        wall_ns = round(time_s * NS)
        if not self._started:
            self._started = True
            self._offset_ns = wall_ns
            self._events = [happened.Spawned(time_s, self.piece)]
        elif wall_ns < self._wall_ns:
            raise ValueError(f"time went back from {self._wall_ns / NS} s to {time_s} s")
        self._wall_ns = wall_ns
        if self.phase is _RUNNING:
            now_ns = wall_ns - self._offset_ns
            if now_ns >= self._due_ns:
                self._advance(now_ns)
            if self.phase is _RUNNING:
                self._now_ns = now_ns
        self._at_s = wall_ns / NS
        self._initial = initial and tuple(initial)
        for given in inputs:
            self._act(given)
        if soft_drop is not self._soft:
            self._soft = soft_drop
            self._soft_since_ns = self._now_ns
            self._schedule()
        events, self._events = self._events, []
        return events

    def put(self, piece: Piece, kick: int | None = None) -> None:
        """Take the piece in play to a free place, as a turn by that kick does, or none."""
        self._take(piece)
        self._kick = kick

    def snapshot(self) -> Snapshot:
        """Return this moment, to come back to it."""
        return Snapshot(
            self.seed,
            self.config,
            tuple(getattr(self, name) for name in CLOCK),
            tuple(getattr(self, name) for name in POSITION),
            (self._dealer.drawn, tuple(self._queue)),
            (self.board.bits, self.board.planes),
            self.row_us,
            self._past,
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Go to a moment, before which the next update's time must not lie.

        Raises:
            ValueError: It is a moment of a game with another seed or other rules.
        """
        if (snapshot.seed, snapshot.config) != (self.seed, self.config):
            raise ValueError("the snapshot is of a game with another seed or other rules")
        for name, value in zip(CLOCK, snapshot.clock, strict=True):
            setattr(self, name, value)
        self.row_us = snapshot.row_us
        self._events = []
        self._return_to(snapshot)

    def _return_to(self, snapshot: Snapshot) -> None:
        """Take up the position, and leave the clock as it is."""
        for name, value in zip(POSITION, snapshot.position, strict=True):
            setattr(self, name, value)
        drawn, queue = snapshot.pieces
        self._dealer.rewind(drawn)
        self._queue = deque(queue)
        self.board = Board(self.config.columns)
        self.board.bits, self.board.planes = snapshot.board
        self._past = snapshot.before
        self._pace()
        self._schedule()

    # -- inputs ------------------------------------------------------------------------

    def _act(self, given: Input) -> None:
        if not (self.in_play and self.phase is _RUNNING):
            done = self._command(given)
        elif given is _LEFT or given is _RIGHT:
            done = self._shift(given)
        elif given is _ROTATE_CW or given is _ROTATE_CCW:
            done = self._rotate(given)
        elif given is _HARD_DROP:
            done = self._drop()
        elif given is _DOWN:
            done = self._fall(_DOWN)
        elif given is _HOLD:
            done = self._swap()
        else:
            done = self._command(given)
        if not done:
            assert isinstance(given, Action)
            self._events.append(happened.Blocked(self._at_s, given))

    def _shift(self, action: Action) -> bool:
        piece, dx = (self.piece.left, -1) if action is _LEFT else (self.piece.right, 1)
        bits = self.board.bits
        if bits & piece.mask:
            return False
        self.piece, self._kick = piece, None
        if self._touched:  # then moving costs a reset
            self._resets += 1
            self._rest()
        elif bits & piece.below.mask:
            self._rest()  # else it is in the air as before, and nothing timed has changed
        self._events.append(happened.Moved(self._at_s, piece, dx, 0, action))
        return True

    def _rotate(self, action: Action) -> bool:
        bits, kick = self.board.bits, 0
        for piece in self.piece.turned[self._table + (action is _ROTATE_CCW)]:
            if not bits & piece.mask:
                self.piece, self._kick = piece, kick
                if self._touched:
                    self._resets += 1
                    self._rest()
                elif piece.lowest_row < self._lowest or bits & piece.below.mask:
                    self._rest()
                self._events.append(happened.Rotated(self._at_s, piece, kick, action))
                return True
            kick += 1  # noqa: SIM113 (half as dear as enumerate)
        return False

    def _drop(self) -> bool:
        if self._now_ns < self._guard_ns:
            return False
        rows = moves.rows_to_fall(self.board.bits, self.piece)
        if rows:
            self.piece = moves.lowered(self.piece, rows)
            self._kick = None
            self.score += scoring.HARD_DROP_POINTS * rows
        self._events.append(happened.Dropped(self._at_s, self.piece, rows))
        self._lock()
        return True

    def _swap(self) -> bool:
        if not (self.can_hold and self.config.hold):
            return False
        kind, self.hold = self.hold, self.piece.kind
        self._events.append(happened.Held(self._at_s, self.hold))
        self.can_hold = False
        self._enter(kind or self._draw())
        return True

    def _command(self, given: Input) -> bool:
        """Carry out what concerns the game and not the piece; False if it cannot be."""
        if isinstance(given, Gravity):
            self.row_us = given.row_us
            self._pace()
            self._schedule()
        elif given is Action.RESTART:
            self._restart()
        elif given is Action.PAUSE and self.phase is not Phase.OVER:
            self._pause()
        elif given is Action.UNDO:
            return self._undo()
        else:
            return False
        return True

    def _pause(self) -> None:
        if self.phase is _RUNNING:
            self._events.append(happened.Paused(self._at_s))
            self.phase = Phase.PAUSED
        else:
            self.phase = Phase.RUNNING
            self._go_on()
            self._events.append(happened.Resumed(self._at_s))
        self._schedule()

    def _go_on(self) -> None:
        """Let the game's time pass again, from where it stood still."""
        self._offset_ns = self._wall_ns - self._now_ns

    def _restart(self) -> None:
        """Restart with a fresh bag; the random numbers go on, so a replay stays one."""
        self._offset_ns = self._wall_ns
        self._now_ns = self._soft_since_ns = 0
        self._events.append(happened.Restarted(self._at_s))
        self._begin()

    def _undo(self) -> bool:
        """Take the last lock back, and a lost end with it; time goes on."""
        if self.phase is Phase.PAUSED or isinstance(self.result, Finish) or self._past is None:
            return False
        past = self._past.before if self.in_play else self._past
        if past is None:
            return False
        if self.phase is Phase.OVER:
            self._go_on()
        self._events.append(happened.Undone(self._at_s))
        self._return_to(past)
        self._past = past
        self._take(self.piece)
        return True

    # -- pieces ------------------------------------------------------------------------

    def _begin(self) -> None:
        self.phase = Phase.RUNNING
        self.result = self.row_us = None
        self.board = Board.parse(self.config.board, self.config.columns)
        self.hold = None
        self.can_hold = True
        self.score = self.lines = self.pieces_placed = 0
        self.level = self.config.start_level
        self.streak = scoring.Streak()
        self._queue.clear()
        self._guard_ns = self._now_ns
        self._past = None
        self._pace()
        self._next_piece()

    def _draw(self) -> Kind:
        """Take the next piece; more are dealt when few are left."""
        while len(self._queue) <= self.config.previews:
            self._queue.extend(self._dealer.deal())
        return self._queue.popleft()

    def _next_piece(self) -> None:
        kind = self._draw()
        if _HOLD in self._initial and self.config.hold:
            kind, self.hold = self.hold or self._draw(), kind
            self.can_hold = False
            self._events.append(happened.Held(self._at_s, self.hold))
        self._enter(kind)
        if self.config.undo and self.in_play:
            self._past = self.snapshot()

    def _enter(self, kind: Kind) -> None:
        piece, bits = self._entrances[kind], self.board.bits
        if bits & piece.mask:
            self.piece = piece
            self._end(TopOut.BLOCK_OUT)
            return
        if self._initial:
            counter = _ROTATE_CCW in self._initial
            if counter is not (_ROTATE_CW in self._initial):
                turned = piece.turned[self._table + counter][0]
                piece = piece if bits & turned.mask else turned
        # At once one row down where nothing is in the way: docs/tetris.md "spawn".
        below = piece.below
        self._take(piece if bits & below.mask else below)

    def _take(self, piece: Piece) -> None:
        self.piece = piece
        self.in_play = True
        self._row_since_ns = self._now_ns
        self._lock_ns = self._enter_ns = self._ground_ns = self._kick = None
        self._resets = 0
        self._touched = False
        self._lowest = piece.lowest_row
        if self.board.bits & piece.below.mask:
            self._rest()
        else:
            self._schedule()
        self._events.append(happened.Spawned(self._at_s, piece))

    def _end(self, reason: TopOut | Finish) -> None:
        if isinstance(reason, TopOut):
            self._events.append(happened.ToppedOut(self._at_s, reason))
        else:
            self._events.append(happened.Finished(self._at_s, reason))
        self.result = reason
        self.phase = Phase.OVER
        self.in_play = False
        self._due_ns = _NEVER

    # -- time --------------------------------------------------------------------------

    def _advance(self, until_ns: int) -> None:
        """Do all that is due, each thing at its own moment."""
        while self._due_ns <= until_ns:
            self._now_ns = self._due_ns
            self._at_s = (self._offset_ns + self._now_ns) / NS
            if self._next_ns > self._now_ns:
                self._end(Finish.TIME)
            elif self._enter_ns is not None:
                self._next_piece()
            elif self._lock_ns is not None:
                self._lock()
            else:
                self._fall(_DOWN if self._soft else None)

    def _fall(self, action: Action | None) -> bool:
        """Move one row down, by gravity (None) or by soft drop; False on the ground."""
        fallen, bits = self.piece.below, self.board.bits
        if bits & fallen.mask:
            return False
        self.piece = fallen
        self._row_since_ns = self._now_ns
        self._kick = self._ground_ns = None
        if action is _DOWN:
            self.score += scoring.SOFT_DROP_POINTS
        if self._touched or bits & fallen.below.mask:
            self._rest()
        else:
            self._lowest = min(self._lowest, fallen.lowest_row)
            self._schedule_fall()
        self._events.append(happened.Moved(self._at_s, fallen, 0, -1, action))
        return True

    def _rest(self) -> None:
        """Start the lock delay if the piece is on the ground: docs/tetris.md "lock_down"."""
        piece = self.piece
        if piece.lowest_row < self._lowest:
            self._lowest = piece.lowest_row
            self._resets = 0
            self._touched = False
        if self.board.bits & piece.below.mask:
            self._touched = True
            self._lock_ns = self._lock_due_ns()
        elif self._lock_ns is not None:  # it went over an edge, and begins to fall now
            self._lock_ns = None
            self._row_since_ns = self._now_ns
        self._schedule()

    def _lock_due_ns(self) -> int:
        now_ns, resets = self._now_ns, self.config.lock_resets
        if resets == 0:  # "classic": only a fall restarts the delay
            if self._ground_ns is None:
                self._ground_ns = now_ns
            return max(self._ground_ns + self._delay_ns, now_ns + _TICK_NS)
        spent = resets is not None and self._resets >= resets
        return now_ns + (_TICK_NS if spent else self._delay_ns)

    def _lock(self) -> None:
        piece, level, board = self.piece, self.level, self.board
        spin = Spin.NONE if self._kick is None else moves.spin(board.bits, piece, self._kick)
        board.place(piece)
        self.in_play = False
        self.pieces_placed += 1
        rows = board.clear_full_rows(piece.lowest_row, piece.highest_row)
        perfect = bool(rows) and board.is_empty
        clear, self.streak = scoring.judge(
            len(rows), spin, level=level, streak=self.streak, perfect=perfect
        )
        self.score += clear.points
        self._events.append(happened.Locked(self._at_s, piece, rows, clear))
        if rows:
            self.lines += clear.lines
            self.level = scoring.level_of(self.lines, self.config.start_level)
            if self.level > level:
                self._pace()
                self._events.append(happened.LevelUp(self._at_s, self.level))
        config = self.config
        if (piece.highest_row if config.partial_lock_out else piece.lowest_row) >= config.rows:
            self._end(TopOut.LOCK_OUT)
        elif rows and self._reached_goal():
            self._end(Finish.GOAL)
        else:
            self._follow()

    def _reached_goal(self) -> bool:
        goal = self.config.lines_goal
        done = goal is not None and self.lines >= goal
        return done or (self.config.dig and not self.board.garbage)

    def _follow(self) -> None:
        """Let the next piece come, at once or after the generation delay."""
        self.can_hold = True
        self._guard_ns = self._now_ns + self._guard_span_ns
        if self._generation_ns:
            self._lock_ns = None
            self._enter_ns = self._now_ns + self._generation_ns
            self._schedule()
        else:
            self._next_piece()

    def _pace(self) -> None:
        config, delay_s = self.config, self.config.lock_delay_s
        if self.row_us is None:
            row_s = seconds_per_row(min(self.level, self.config.gravity_cap))
        else:
            row_s = self.row_us / 1e6
            delay_s = min(delay_s, LOCK_ROWS * row_s)
        self._gravity_ns = round(row_s * NS) if config.gravity else _NEVER
        self._delay_ns = round(delay_s * NS) if config.gravity else _NEVER
        self._soft_ns = round(row_s * NS / config.soft_drop_factor)

    def _schedule(self) -> None:
        """Work out when something happens next without the player."""
        if self.phase is not Phase.RUNNING:
            self._due_ns = _NEVER
        elif self._enter_ns is not None or self._lock_ns is not None:
            self._next_ns = self._enter_ns or self._lock_ns or 0
            self._due_ns = min(self._next_ns, self._limit_ns)
        else:
            self._schedule_fall()

    def _schedule_fall(self) -> None:
        next_ns = self._row_since_ns + self._gravity_ns
        if self._soft:
            soft_ns = max(self._row_since_ns, self._soft_since_ns) + self._soft_ns
            if soft_ns < next_ns:
                next_ns = soft_ns
        if next_ns <= self._now_ns:  # a change of pace made it overdue
            next_ns = self._now_ns + 1  # after the inputs of the same moment
        self._next_ns = next_ns
        self._due_ns = next_ns if next_ns < self._limit_ns else self._limit_ns
