"""Statistics of play: commands, finesse, and great clears.

Pure: events and counted commands come in. Finesse asks of each piece whether its place could
have been reached with fewer inputs. An input is a turn or a shift that the player gave, whether
it succeeded or not; repeats of a held shift belong to the press that began them. Rows down,
drops and waiting are free.
"""

from collections.abc import Iterable
from typing import Final, NamedTuple

from tetris.bots.placements import fewest
from tetris.engine import events as happened
from tetris.engine.board import Board, without_rows
from tetris.engine.events import Action, Event
from tetris.engine.game import Game
from tetris.engine.pieces import Piece

COMMANDS: Final = frozenset(Action) - {Action.PAUSE, Action.RESTART, Action.UNDO}
_STEPS: Final = (Action.LEFT, Action.RIGHT, Action.ROTATE_CW, Action.ROTATE_CCW)


class _Lock(NamedTuple):
    bits: int  # the board before it
    name: str  # of its clear; "" for a plain lock
    faults: int  # inputs more than were needed


class Statistics:
    """Counts along with one game.

    Attributes:
        commands: Number of those that the player gave.
    """

    def __init__(self, game: Game) -> None:
        self._game = game
        self._begin()

    def _begin(self) -> None:
        config = self._game.config
        self._bits = Board.parse(config.board, config.columns).bits
        self._locks: list[_Lock] = []
        self.commands = self._inputs = 0  # the latter for the piece in play
        self._entered: Piece | None = None

    @property
    def commands_per_piece(self) -> float:
        """Commands for each piece; 0 before the first."""
        return self.commands / len(self._locks) if self._locks else 0.0

    @property
    def faults(self) -> int:
        """Inputs more than were needed, over all pieces."""
        return sum(lock.faults for lock in self._locks)

    @property
    def finesse(self) -> float:
        """The share of pieces without a fault, 0 to 1; 1 before the first."""
        faultless = sum(not lock.faults for lock in self._locks)
        return faultless / len(self._locks) if self._locks else 1.0

    @property
    def grand_clears(self) -> int:
        """Number of tetrises and T-spins."""
        return sum(lock.name == "tetris" or "t-spin" in lock.name for lock in self._locks)

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
                    self._inputs = 0
                case happened.Restarted():
                    self._begin()
        self.commands += commands

    def _lock(self, event: happened.Locked) -> None:
        needed = self._fewest(event.piece)
        faults = 0 if needed is None else max(0, self._inputs - needed)
        self._locks.append(_Lock(self._bits, event.clear.name, faults))
        bits = self._bits | event.piece.mask
        self._bits = without_rows(bits, list(event.rows), self._game.config.columns)
        self._inputs = 0

    def _fewest(self, landing: Piece) -> int | None:
        """Return the inputs that a landing needs; None if they are unknown."""
        entered = self._entered
        if entered is None or entered.kind != landing.kind:
            return None
        return fewest(self._bits, entered, landing, self._game.config.kicks)
