"""Points and levels: what a lock is worth. Source: docs/tetris.md "scoring" and "levels"."""

from dataclasses import dataclass
from typing import Final

from tetris.engine.moves import Spin

SOFT_DROP_POINTS: Final = 1  # a cell, never multiplied by the level, like the next
HARD_DROP_POINTS: Final = 2
_COMBO_POINTS: Final = 50
_LINES_A_LEVEL: Final = 10

# By lines cleared, 0 to 4; a mini clears at most two.
_POINTS: Final[dict[Spin, tuple[int, ...]]] = {
    Spin.NONE: (0, 100, 300, 500, 800),
    Spin.MINI: (100, 200, 400),  # a mini double: 400, "Where sources disagree"
    Spin.FULL: (400, 800, 1200, 1600),
}
_PERFECT: Final = (0, 800, 1200, 1800, 2000)  # added to the above
_PERFECT_B2B_QUAD: Final = 3200
_LINES: Final = ("", "single", "double", "triple", "tetris")
_SPINS: Final[dict[Spin, str]] = {Spin.NONE: "", Spin.MINI: "mini t-spin", Spin.FULL: "t-spin"}


@dataclass(frozen=True, slots=True)
class Clear:
    """Score of one lock."""

    lines: int  # rows cleared, 0 to 4
    spin: Spin
    b2b: bool  # whether it was paid as the second or later of a chain of difficult clears
    combo: int  # clears in a row before this one; -1 when this lock cleared nothing
    perfect: bool  # whether it emptied the board
    points: int  # the level included

    @property
    def name(self) -> str:
        """Name of the clear, such as "t-spin double"; empty for a plain lock."""
        return f"{_SPINS[self.spin]} {_LINES[self.lines]}".strip()

    @property
    def difficult(self) -> bool:
        """Whether it starts or goes on with a back-to-back chain."""
        return _difficult(self.lines, self.spin)


@dataclass(frozen=True, slots=True)
class Streak:
    """Effect of earlier locks on the next one."""

    b2b: bool = False  # the last clear was a difficult one
    combo: int = 0  # locks in a row that cleared lines


_NOTHING: Final = Clear(0, Spin.NONE, False, -1, False, 0)
_CALM: Final = (Streak(False, 0), Streak(True, 0))


def judge(
    lines: int, spin: Spin, *, level: int, streak: Streak, perfect: bool
) -> tuple[Clear, Streak]:
    """Return what a lock at this level is worth, and the streak that it leaves."""
    if not lines and spin is Spin.NONE:  # by far the most frequent lock
        return _NOTHING, _CALM[streak.b2b]
    difficult = _difficult(lines, spin)
    b2b = difficult and streak.b2b
    points = _POINTS[spin][lines]
    if b2b:
        points += points // 2  # 1.5 times; all difficult clears are even numbers
    if lines:
        points += _COMBO_POINTS * streak.combo
    if perfect:
        points += _PERFECT_B2B_QUAD if b2b and lines == 4 else _PERFECT[lines]
    clear = Clear(lines, spin, b2b, streak.combo if lines else -1, perfect, points * level)
    if not lines:  # breaks the combo, never the chain
        return clear, Streak(streak.b2b, 0)
    return clear, Streak(difficult, streak.combo + 1)


def _difficult(lines: int, spin: Spin) -> bool:
    return lines == 4 or (lines > 0 and spin is not Spin.NONE)


def level_of(lines: int, start_level: int) -> int:
    """Return the level after so many lines: the first goal is 10 times the start level."""
    return max(start_level, lines // _LINES_A_LEVEL + 1)


def goal_of(level: int, start_level: int) -> tuple[int, int]:
    """Return the lines with which a level begins, and those with which it ends."""
    first = 0 if level == start_level else _LINES_A_LEVEL * (level - 1)
    return first, _LINES_A_LEVEL * level
