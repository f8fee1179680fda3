"""The game: inputs and time in, events out. Rules: docs/tetris.md.

The engine has no clock. `Game.update` is told the time, does what was due until then at
the moment it was due, and then carries out the inputs. How time is cut into updates
therefore changes nothing, and seed, rules and timed inputs are a replay. Inside, time is
whole nanoseconds, so that sums are exact.
"""

from collections.abc import Collection, Sequence
from typing import Final

from tetris.engine import events as happened
from tetris.engine import moves, scoring
from tetris.engine.events import Action, Event, Finish, GravityCap, Input, TopOut
from tetris.engine.gravity import GravityGame
from tetris.engine.pieces import Piece
from tetris.engine.rules import Config, Phase
from tetris.engine.state import NS, Snapshot

__all__ = [
    "Action",
    "Config",
    "Event",
    "Finish",
    "Game",
    "GravityCap",
    "Input",
    "Phase",
    "Snapshot",
    "TopOut",
]

# Members by their bare names: looking them up in their class takes longer than a shift.
_LEFT, _RIGHT, _DOWN, _HARD_DROP = Action.LEFT, Action.RIGHT, Action.DOWN, Action.HARD_DROP
_ROTATE_CW, _ROTATE_CCW, _HOLD = Action.ROTATE_CW, Action.ROTATE_CCW, Action.HOLD
_RUNNING: Final = Phase.RUNNING


class Game(GravityGame):
    """One game after another on one board; `State` has what can be seen of it."""

    def __init__(self, seed: int, config: Config | None = None) -> None:
        super().__init__(seed, config or Config())
        self._begin()

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
        if isinstance(given, GravityCap):
            self.gravity_cap = given.level
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
