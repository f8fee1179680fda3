"""The modes of play, and the pace of a slow hand; docs/tetris-modes.md describes them.

A mode is data over `Config`, and what counts in its best list; the engine knows of none.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from random import Random
from types import MappingProxyType
from typing import Final, Literal

from tetris.engine.board import EMPTY, GARBAGE
from tetris.engine.rules import LAST_GRAVITY_LEVEL, Config, seconds_per_row

Ranking = Literal["score", "time", "lines"]

_PLAIN: Final = Config()
_DIG_ROWS: Final = 10
_MARATHON_LINES: Final = 150  # docs/tetris-modes.md, and all below
_SPRINT_LINES: Final = 40
_ULTRA_S: Final = (120.0, 180.0)
_ORB_CAP: Final = 3  # 12 s for 20 rows: the slowest hand's eight commands
_ORB_LOCK_S: Final = 1.0
_ORB_GUARD_S: Final = 0.6  # a pinch that was meant for the piece before lasts about as long


@dataclass(frozen=True, slots=True)
class Mode:
    """One way to play."""

    name: str  # fit for file names, language files and the command line
    ranking: Ranking  # of its best list; "time" only counts games that reached the goal
    levels: bool = False  # whether the player chooses the level to start with
    rules: Config = _PLAIN  # less what differs from game to game; see `config`
    paced: bool = False  # whether gravity follows the player's measured rate, by `Pace`
    garbage_rows: int = 0  # to begin with, with one hole each, drawn by the game's seed

    def config(self, start_level: int = 1, seed: int = 0) -> Config:
        """Return the rules of one game; the seed draws the garbage of a dig."""
        rules = self.rules
        if self.levels:
            rules = replace(rules, start_level=start_level)
        if self.garbage_rows:
            rules = replace(rules, board=_garbage(seed, self.garbage_rows, rules.columns))
        return rules


def _garbage(seed: int, rows: int, columns: int) -> str:
    """Draw rows of garbage with one hole each, no two holes above one another."""
    source = Random(f"tetris garbage {seed}")
    picture, hole = [], -1
    for _ in range(rows):
        # random() alone is promised to give the same numbers in every Python version.
        step = 1 + int(source.random() * (columns - 1))
        hole = (hole + step) % columns if hole >= 0 else int(source.random() * columns)
        picture.append(GARBAGE * hole + EMPTY + GARBAGE * (columns - hole - 1))
    return "\n".join(picture)


_MODES: Final = (
    Mode("marathon", "score", levels=True, rules=Config(lines_goal=_MARATHON_LINES)),
    Mode("endless", "score", levels=True),
    Mode("sprint", "time", rules=Config(lines_goal=_SPRINT_LINES, gravity_cap=1)),
    Mode("ultra_2", "score", rules=Config(time_limit_s=_ULTRA_S[0])),
    Mode("ultra_3", "score", rules=Config(time_limit_s=_ULTRA_S[1])),
    Mode("zen", "lines", rules=Config(gravity=False, lock_resets=None, undo=True)),
    Mode(
        "dig",
        "time",
        # A board has to be there for the rules to hold; each game draws its own.
        rules=Config(dig=True, board=_garbage(0, _DIG_ROWS, _PLAIN.columns)),
        garbage_rows=_DIG_ROWS,
    ),
    Mode(
        "orb",
        "score",
        levels=True,
        rules=Config(gravity_cap=_ORB_CAP, lock_delay_s=_ORB_LOCK_S, guard_s=_ORB_GUARD_S),
        paced=True,
    ),
)
MODES: Final[Mapping[str, Mode]] = MappingProxyType({mode.name: mode for mode in _MODES})
"""By name, in the order of the menu."""


# -- orb pace ----------------------------------------------------------------------------------

FIRST_LEVEL: Final = 3  # until the player is known: docs/tetris-modes.md "orb pace", and all below
_COMMANDS: Final = 8  # what the worst placement needs
_ROWS: Final = 20  # and how far a piece falls meanwhile
_FEWEST: Final = 8  # intervals before the rate counts as known
_LATEST: Final = 24  # intervals that it is taken from
_LONGEST_S: Final = 4.0  # a longer rest is no measure of the player's speed


def level_for(rate_hz: float) -> int:
    """Return the highest level whose fall of 20 rows leaves time for 8 commands, at so many Hz."""
    needed_s = _COMMANDS / rate_hz
    level = 1
    while level < LAST_GRAVITY_LEVEL and _ROWS * seconds_per_row(level + 1) >= needed_s:
        level += 1
    return level


class Pace:
    """Measures how many commands a second the player gives, and which gravity leaves time for it.

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
