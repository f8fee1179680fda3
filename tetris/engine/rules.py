"""Rules that a player may change, gravity, and the deal of pieces. Source: docs/tetris.md."""

from dataclasses import dataclass
from enum import Enum
from random import Random
from typing import Final, Literal, get_args

from tetris.engine.board import GARBAGE, Board, full_rows
from tetris.engine.pieces import COLUMNS, KINDS, VISIBLE_ROWS, Kicks, Kind

VERSION: Final = 1  # of the rules: raised when the same inputs would play another game

Randomiser = Literal["7-bag", "uniform"]
LAST_GRAVITY_LEVEL: Final = 20  # beyond it nothing falls faster: docs/tetris.md "gravity"
LONGEST_ROW_US: Final = 9_999_999  # of a `Gravity`
LOCK_ROWS: Final = 2.5  # the same, how long a piece lies on the ground before it locks, at most
_LEAST_S: Final = 0.001  # of a delay
_LONGEST_S: Final = 1e6  # twelve days
_LIMITS: Final = {  # the least and the most; a replay costs no more than its file says
    "start_level": (1, 10_000),
    "gravity_cap": (1, LAST_GRAVITY_LEVEL),
    "lock_delay_s": (_LEAST_S, _LONGEST_S),
    "lock_resets": (0, 10_000),
    "soft_drop_factor": (1, 10_000),
    "previews": (1, 100),
    "generation_delay_s": (0, _LONGEST_S),
    "guard_s": (0, _LONGEST_S),
    "lines_goal": (1, 10_000),
    "time_limit_s": (_LEAST_S, _LONGEST_S),
    "columns": (4, COLUMNS),  # I must fit
    "rows": (4, 30),  # leaves ten of the forty for what enters
}


class Phase(Enum):
    """Whether time passes in the game."""

    RUNNING = "running"
    PAUSED = "paused"
    OVER = "over"


@dataclass(frozen=True, slots=True)
class Config:
    """The rules that a player may change; docs/tetris.md has the reasons for each."""

    start_level: int = 1  # sets the first gravity and the first goal
    gravity_cap: int = LAST_GRAVITY_LEVEL  # not exceeded; scoring goes on with the real level
    lock_delay_s: float = 0.5  # of a piece on the ground: docs/tetris.md "lock_down"
    lock_resets: int | None = 15  # shifts and turns that restart it, until a new lowest row
    soft_drop_factor: int = 20  # how many times faster than gravity a soft drop falls
    previews: int = 5
    gravity: bool = True  # else nothing falls and nothing locks by itself
    generation_delay_s: float = 0.0  # between a lock and the next entrance
    guard_s: float = 0.0  # after a lock, in which no hard drop is taken: it came too late
    hold: bool = True
    undo: bool = False  # whether a lock can be taken back
    lines_goal: int | None = None  # with which the game is won
    time_limit_s: float | None = None  # of play
    board: str = ""  # the blocks to begin with, as `Board.parse` reads them
    dig: bool = False  # the game is won when none of the board's blocks `#` is left
    kicks: Kicks = "srs"
    randomiser: Randomiser = "7-bag"
    columns: int = COLUMNS  # 4 to 10
    rows: int = VISIBLE_ROWS  # 4 to 30; pieces enter above them
    partial_lock_out: bool = False  # one cell above the visible rows loses; else all four

    def __post_init__(self) -> None:
        for name, (least, most) in _LIMITS.items():
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise ValueError(f"{name} {value} must be from {least:g} to {most:g}")
        if self.kicks not in get_args(Kicks) or self.randomiser not in get_args(Randomiser):
            raise ValueError(
                f"kicks {self.kicks!r} must be one of {get_args(Kicks)}, "
                f"randomiser {self.randomiser!r} one of {get_args(Randomiser)}"
            )
        board = Board.parse(self.board, self.columns)
        if board.height > self.rows or full_rows(board.bits):
            raise ValueError(f"the first board must have {self.rows} rows or fewer, none full")
        if self.dig and not board.garbage:
            raise ValueError(f"a board to dig must have blocks {GARBAGE}")


def seconds_per_row(level: int) -> float:
    """Return how long a piece takes to fall one row: docs/tetris.md "gravity"."""
    steps = min(level, LAST_GRAVITY_LEVEL) - 1
    return float((0.8 - steps * 0.007) ** steps)


class Randomizer:
    """Deals pieces from a seed: docs/tetris.md "randomizer"."""

    __slots__ = ("_randomiser", "_source", "drawn", "seed")

    def __init__(self, seed: int, randomiser: Randomiser = "7-bag") -> None:
        self.seed: Final = seed
        self._randomiser = randomiser
        self._source = Random(seed)
        self.drawn = 0  # random numbers used so far: with the seed, all there is to know

    def deal(self) -> list[Kind]:
        """Return the next pieces: a shuffled bag of all seven, or one of any kind."""
        # random() alone is promised to give the same numbers in every Python version.
        number = self._source.random
        if self._randomiser == "uniform":
            self.drawn += 1
            return [KINDS[int(number() * len(KINDS))]]
        self.drawn += len(KINDS)
        return sorted(KINDS, key=lambda _: number())

    def rewind(self, drawn: int) -> None:
        """Go to where so many random numbers have been used."""
        self._source = Random(self.seed)
        for _ in range(drawn):
            self._source.random()
        self.drawn = drawn
