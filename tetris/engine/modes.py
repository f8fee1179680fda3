"""The modes of play: each a set of rules, and what counts in its best list.

A mode is data over `Config`; the engine knows of none. docs/tetris-modes.md describes them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from random import Random
from types import MappingProxyType
from typing import Final, Literal

from tetris.engine.board import EMPTY, GARBAGE
from tetris.engine.rules import Config

Ranking = Literal["score", "time", "lines"]
LAST_START_LEVEL: Final = 20  # beyond it nothing falls faster: docs/tetris.md "gravity"

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
    """One way to play.

    Attributes:
        name: Its key, fit for file names, language files and the command line.
        ranking: What its best list goes by: "time" only counts games that reached the
            goal, the shortest first; "score" and "lines" count all, the highest first.
        levels: Whether the player chooses the level to start with.
        rules: What differs from game to game is still missing; see `config`.
        paced: Whether gravity follows the player's measured rate (`pace.Pace`).
        garbage_rows: Rows with one hole each to begin with, drawn by the game's seed.
    """

    name: str
    ranking: Ranking
    levels: bool = False
    rules: Config = _PLAIN
    paced: bool = False
    garbage_rows: int = 0

    def config(self, start_level: int = 1, seed: int = 0) -> Config:
        """Return the rules of one game.

        Args:
            start_level: 1 or more; looked at only where `levels` says so.
            seed: The game's seed; the garbage of a dig depends on it.
        """
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


def _table(*modes: Mode) -> Mapping[str, Mode]:
    return MappingProxyType({mode.name: mode for mode in modes})


MODES: Final[Mapping[str, Mode]] = _table(
    Mode("marathon", "score", levels=True, rules=Config(lines_goal=_MARATHON_LINES)),
    Mode("endless", "score", levels=True),
    Mode("sprint", "time", rules=Config(lines_goal=_SPRINT_LINES)),
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
"""By name, in the order of the menu."""
