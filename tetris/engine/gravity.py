"""Gravity and its consequences: pieces enter, fall, come to rest, lock, and end the game."""

from typing import Final

from tetris.engine import events, moves, scoring
from tetris.engine.board import Board
from tetris.engine.events import Action, Finish, TopOut
from tetris.engine.moves import Spin
from tetris.engine.pieces import Kind, Piece
from tetris.engine.rules import Phase
from tetris.engine.state import NEVER, NS, State

_TICK_NS: Final = 1  # "locks as soon as it touches": after the inputs of the same moment
_DOWN, _HOLD = Action.DOWN, Action.HOLD  # see `tetris.engine.game`
_ROTATE_CW, _ROTATE_CCW = Action.ROTATE_CW, Action.ROTATE_CCW


class GravityGame(State):
    """A game to which time is given, and no inputs."""

    def _begin(self) -> None:
        self.phase = Phase.RUNNING
        self.result = None
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
            self._events.append(events.Held(self._at_s, self.hold))
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
        self._events.append(events.Spawned(self._at_s, piece))

    def _end(self, reason: TopOut | Finish) -> None:
        if isinstance(reason, TopOut):
            self._events.append(events.ToppedOut(self._at_s, reason))
        else:
            self._events.append(events.Finished(self._at_s, reason))
        self.result = reason
        self.phase = Phase.OVER
        self.in_play = False
        self._due_ns = NEVER

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
        self._events.append(events.Moved(self._at_s, fallen, 0, -1, action))
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
        self._events.append(events.Locked(self._at_s, piece, rows, clear))
        if rows:
            self.lines += clear.lines
            self.level = scoring.level_of(self.lines, self.config.start_level)
            if self.level > level:
                self._pace()
                self._events.append(events.LevelUp(self._at_s, self.level))
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
