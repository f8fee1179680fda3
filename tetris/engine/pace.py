"""Orb pace: how many commands a second the player gives, and the gravity that leaves time for them.

Pure: commands come in with their times, a level comes out.
"""

from collections import deque
from typing import Final

from tetris.engine.rules import seconds_per_row

FIRST_LEVEL: Final = 3  # until the player is known: docs/tetris-modes.md "orb pace", and all below
LAST_LEVEL: Final = 20  # beyond it nothing falls faster
_COMMANDS: Final = 8  # what the worst placement needs
_ROWS: Final = 20  # and how far a piece falls meanwhile
_FEWEST: Final = 8  # intervals before the rate counts as known
_LATEST: Final = 24  # intervals that it is taken from
_LONGEST_S: Final = 4.0  # a longer rest is no measure of the player's speed


def level_for(rate_hz: float) -> int:
    """Return the highest level whose fall of 20 rows leaves time for 8 commands.

    Args:
        rate_hz: Commands a second, above 0.

    Raises:
        ValueError: The rate is not above 0.
    """
    if rate_hz <= 0:
        raise ValueError(f"a rate of {rate_hz} commands a second must be above 0")
    needed_s = _COMMANDS / rate_hz
    level = 1
    while level < LAST_LEVEL and _ROWS * seconds_per_row(level + 1) >= needed_s:
        level += 1
    return level


class Pace:
    """Measures one player while they play.

    The mean counts, not the median: eight commands take eight times the mean.
    """

    def __init__(self) -> None:
        self._intervals_s: deque[float] = deque(maxlen=_LATEST)
        self._last_s: float | None = None

    def command(self, time_s: float) -> None:
        """Take note of a command, at a time that is never earlier than the one before."""
        if self._last_s is not None and time_s - self._last_s <= _LONGEST_S:
            self._intervals_s.append(time_s - self._last_s)
        self._last_s = time_s

    def interrupt(self) -> None:
        """Forget when the last command was, as after a pause: the next interval is none."""
        self._last_s = None

    @property
    def rate_hz(self) -> float | None:
        """Commands a second; None until enough have come."""
        if len(self._intervals_s) < _FEWEST:
            return None
        total_s = sum(self._intervals_s)
        return len(self._intervals_s) / total_s if total_s > 0 else float("inf")

    @property
    def level(self) -> int:
        """The level at which gravity is to be capped now."""
        rate_hz = self.rate_hz
        return FIRST_LEVEL if rate_hz is None else level_for(rate_hz)
