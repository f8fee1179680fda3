"""Statistics of play: commands, pieces, and great clears.

Pure: events and counted commands come in.
"""

from collections.abc import Iterable
from typing import Final

from tetris.engine import events as happened
from tetris.engine.events import Action, Event

COMMANDS: Final = frozenset(Action) - {Action.PAUSE, Action.RESTART, Action.UNDO}


class Statistics:
    """Counts along with one game.

    Attributes:
        commands: Number of those that the player gave.
    """

    def __init__(self) -> None:
        self.commands = 0
        self._clears: list[str] = []  # name of the clear of each lock; "" for a plain lock

    @property
    def commands_per_piece(self) -> float:
        """Commands for each piece; 0 before the first."""
        return self.commands / len(self._clears) if self._clears else 0.0

    @property
    def grand_clears(self) -> int:
        """Number of tetrises and T-spins."""
        return sum(name == "tetris" or "t-spin" in name for name in self._clears)

    def update(self, events: Iterable[Event], commands: int = 0) -> None:
        """Take what an update of the game gave, and how many `COMMANDS` the player gave for it.

        A repeat of a held key is none.
        """
        for event in events:
            match event:
                case happened.Locked(clear=clear):
                    self._clears.append(clear.name)
                case happened.Undone() if self._clears:
                    self._clears.pop()
                case happened.Restarted():
                    self._clears.clear()
                    self.commands = 0
        self.commands += commands
