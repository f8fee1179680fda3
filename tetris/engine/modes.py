"""The modes of play, and the pace of the orb marathon; docs/tetris-modes.md describes them.

A mode is data over `Config`, and what counts in its best list; the engine knows of none.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from random import Random
from types import MappingProxyType
from typing import Final, Literal

from tetris.engine.board import EMPTY, GARBAGE
from tetris.engine.events import Gravity
from tetris.engine.rules import LONGEST_ROW_US, Config

Ranking = Literal["score", "time", "lines", "pace"]

_PLAIN: Final = Config()
_DIG_ROWS: Final = 10
_MARATHON_LINES: Final = 150  # docs/tetris-modes.md, and all below
_SPRINT_LINES: Final = 40
_ULTRA_S: Final = (120.0, 180.0)
_ORB_LINES: Final = 20
_ORB: Final = Config(
    gravity_cap=1,  # 20 s for 20 rows: the slowest hand's eight commands
    lock_delay_s=1.0,
    guard_s=0.6,  # a pinch that was meant for the piece before lasts about as long
)

_LONGEST_LOCK_S: Final = 2.0  # of the orb marathon, whose faster rows shorten it


@dataclass(frozen=True, slots=True)
class Mode:
    """One way to play."""

    name: str  # fit for file names, language files and the command line
    ranking: Ranking  # of its best list; "time" only counts games that reached the goal
    levels: bool = False  # whether the player chooses the level to start with
    rules: Config = _PLAIN  # less what differs from game to game; see `config`
    paced: bool = False  # whether gravity begins with the player's rate and rises, by `Pace`
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
    Mode("orb_marathon", "pace", rules=replace(_ORB, lock_delay_s=_LONGEST_LOCK_S), paced=True),
    Mode("orb_sprint", "time", rules=replace(_ORB, lines_goal=_ORB_LINES)),
    Mode("orb_ultra", "score", rules=replace(_ORB, time_limit_s=_ULTRA_S[1])),
)
MODES: Final[Mapping[str, Mode]] = MappingProxyType({mode.name: mode for mode in _MODES})
"""By name, in the order of the menu."""


# -- orb marathon ------------------------------------------------------------------------------

FIRST_HZ: Final = 0.65  # until the player is known: docs/tetris-modes.md "orb marathon", all below
PACE_LINES: Final = 10  # after which pieces fall faster
_GROWTH: Final = 1.1  # by which the pace is multiplied then
_COMMANDS: Final = 8  # what the worst placement needs
_ROWS: Final = 20  # and how far a piece falls meanwhile
_FEWEST: Final = 12  # intervals before the rate counts as known
_LATEST: Final = 24  # intervals that it is taken from
_LONGEST_S: Final = 4.0  # a longer rest is no measure of the player's speed
_LEAST_ROW_US: Final = 1_000


def gravity_for(pace_hz: float) -> Gravity:
    """Return the gravity whose 20 rows last as long as 8 commands, at so many Hz."""
    row_us = round(1e6 * _COMMANDS / _ROWS / pace_hz)
    return Gravity(max(_LEAST_ROW_US, min(LONGEST_ROW_US, row_us)))


def pace_of(row_us: int | None) -> float:
    """Return the commands a second for which a game's `row_us` leaves time; 0 for None."""
    return 1e6 * _COMMANDS / _ROWS / row_us if row_us else 0.0


class Pace:
    """Measures the player's commands a second; sets the pace at which pieces fall.

    The mean of the intervals counts, not the median: eight commands take eight times the mean.
    During the first ten lines the pace follows the greatest rate; then it rises with every ten.
    """

    def __init__(self, pace_hz: float = FIRST_HZ, lines: int = 0) -> None:
        """Begin with a pace, to which so many lines have led."""
        self._intervals_s: deque[float] = deque(maxlen=_LATEST)
        self._last_s: float | None = None
        self._base_hz = pace_hz / _GROWTH ** (lines // PACE_LINES)

    def command(self, time_s: float, lines: int = 0) -> None:
        """Take note of a command, at a time that is never earlier than the one before."""
        if self._last_s is not None and time_s - self._last_s <= _LONGEST_S:
            self._intervals_s.append(time_s - self._last_s)
        self._last_s = time_s
        if lines < PACE_LINES:
            self._base_hz = max(self._base_hz, self.rate_hz or 0.0)

    def interrupt(self) -> None:
        """Forget when the last command was, as after a pause: the next interval is none."""
        self._last_s = None

    @property
    def rate_hz(self) -> float | None:
        """The player's commands a second; None until enough have come."""
        if len(self._intervals_s) < _FEWEST:
            return None
        total_s = sum(self._intervals_s)
        return len(self._intervals_s) / total_s if total_s > 0 else float("inf")

    def gravity(self, lines: int) -> Gravity:
        """Return the gravity after so many lines."""
        return gravity_for(self._base_hz * _GROWTH ** (lines // PACE_LINES))
