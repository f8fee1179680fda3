"""Statistics of play: pieces and commands, speed, finesse, and clears.

Pure: events and counted commands come in. Finesse asks of each piece whether its place could
have been reached with fewer inputs. An input is a turn or a shift that the player gave, whether
it succeeded or not; repeats of a held shift belong to the press that began them. Rows down,
drops and waiting are free.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from tetris.bots.placements import fewest
from tetris.engine import events as happened
from tetris.engine.board import Board, without_rows
from tetris.engine.events import Action, Event
from tetris.engine.game import Game
from tetris.engine.pieces import Piece
from tetris.engine.rules import Config

COMMANDS: Final = frozenset(Action) - {Action.PAUSE, Action.RESTART, Action.UNDO}
_STEPS: Final = (Action.LEFT, Action.RIGHT, Action.ROTATE_CW, Action.ROTATE_CCW)


@dataclass(frozen=True, slots=True)
class Summary:
    """The figures of one game, so far or at its end."""

    score: int
    lines: int
    level: int
    pieces: int  # locked
    time_s: float  # played, without pauses
    commands: int  # given by the player
    faults: int  # inputs more than were needed, over all pieces
    faultless: int  # pieces with none
    combo: int  # the most clears in a row
    b2b: int  # the most difficult clears in a row that were paid as such
    clears: Mapping[str, int]  # how often, by their names ("t-spin double"); plain locks left out

    @property
    def pieces_per_s(self) -> float:
        """Pieces a second; 0 before any time has passed."""
        return self.pieces / self.time_s if self.time_s > 0 else 0.0

    @property
    def commands_per_piece(self) -> float:
        """Commands for each piece; 0 before the first."""
        return self.commands / self.pieces if self.pieces else 0.0

    @property
    def finesse(self) -> float:
        """The share of pieces without a fault, 0 to 1; 1 before the first."""
        return self.faultless / self.pieces if self.pieces else 1.0


class _Lock(NamedTuple):
    bits: int  # the board before it
    name: str
    combo: int
    b2b: int
    faults: int


class Statistics:
    """Counts along with one game."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._begin()

    def _begin(self) -> None:
        config = self._config
        self._bits = Board.parse(config.board, config.columns).bits
        self._locks: list[_Lock] = []
        self._commands = self._b2b = 0
        self._entered: Piece | None = None
        self._inputs = 0  # of the piece in play

    def update(self, events: Iterable[Event], commands: int = 0) -> None:
        """Take what an update of the game gave, and how many `COMMANDS` the player gave for it.

        A repeat of a held key is none, and comes in an update of its own.
        """
        for event in events:
            match event:
                case (
                    happened.Moved(action=action)
                    | happened.Rotated(action=action)
                    | happened.Blocked(action=action)
                ):
                    self._inputs += commands > 0 and action in _STEPS
                case happened.Spawned(piece=piece):
                    self._entered = piece
                case happened.Locked():
                    self._lock(event)
                case happened.Undone() if self._locks:
                    self._bits = self._locks.pop().bits
                    self._b2b = self._locks[-1].b2b if self._locks else 0
                    self._inputs = 0
                case happened.Restarted():
                    self._begin()
        self._commands += commands

    def summary(self, game: Game) -> Summary:
        """Return the figures of the game as it is now."""
        locks = self._locks
        return Summary(
            score=game.score,
            lines=game.lines,
            level=game.level,
            pieces=game.pieces_placed,
            time_s=game.time_s,
            commands=self._commands,
            faults=sum(lock.faults for lock in locks),
            faultless=sum(not lock.faults for lock in locks),
            combo=max((lock.combo for lock in locks), default=0),
            b2b=max((lock.b2b for lock in locks), default=0),
            clears=dict(Counter(lock.name for lock in locks if lock.name)),
        )

    def _lock(self, event: happened.Locked) -> None:
        clear = event.clear
        if clear.lines:
            self._b2b = self._b2b + 1 if clear.b2b else 0
        needed = self._fewest(event.piece)
        faults = 0 if needed is None else max(0, self._inputs - needed)
        self._locks.append(_Lock(self._bits, clear.name, clear.combo + 1, self._b2b, faults))
        bits = self._bits | event.piece.mask
        self._bits = without_rows(bits, list(event.rows), self._config.columns)
        self._inputs = 0

    def _fewest(self, landing: Piece) -> int | None:
        """Return the inputs that a landing needs; None if they are unknown."""
        entered = self._entered
        if entered is None or entered.kind != landing.kind:
            return None
        return fewest(self._bits, entered, landing, self._config.kicks)
