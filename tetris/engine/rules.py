"""The rules that a player may change, and gravity. Source: docs/tetris.md."""

from dataclasses import dataclass
from enum import Enum
from typing import Final, Literal, get_args

from tetris.engine.board import GARBAGE, Board, full_rows
from tetris.engine.kicks import Kicks
from tetris.engine.pieces import COLUMNS, VISIBLE_ROWS

VERSION: Final = 1  # of the rules: raised when the same inputs would play another game

Randomiser = Literal["7-bag", "uniform"]
_LAST_GRAVITY_LEVEL: Final = 20  # beyond it nothing falls faster: docs/tetris.md "gravity"
_LEAST_DELAY_S: Final = 0.001
_LONGEST_S: Final = 1e6  # twelve days
_LEAST_SIDE: Final = 4  # I must fit
_MOST_ROWS: Final = 30  # leaves ten of the forty for what enters


class Phase(Enum):
    """Whether time passes in the game."""

    RUNNING = "running"
    PAUSED = "paused"
    OVER = "over"


@dataclass(frozen=True, slots=True)
class Config:
    """The rules that a player may change; docs/tetris.md has the reasons for each.

    Attributes:
        start_level: 1 or more; sets the first gravity and the first goal.
        gravity_cap: The level whose gravity is never exceeded, 1 to 20; scoring goes on
            with the real level. Slow controllers cap it at 3. `GravityCap` changes it
            while playing.
        gravity: False: nothing falls and nothing locks by itself.
        lock_delay_s: How long a piece rests on the ground before it locks, 0.001 or more.
        lock_resets: Shifts and rotations that restart the delay, until a new lowest row.
            None: any number. 0: none does, only a fall.
        soft_drop_factor: How many times faster than gravity a soft drop falls.
        generation_delay_s: The time between a lock and the next entrance.
        guard_s: The time after a lock in which no hard drop is taken, so that one that
            came too late does not drop the next piece.
        previews: How many next pieces are shown.
        hold: Whether a piece can be held.
        undo: Whether a lock can be taken back.
        lines_goal: The game is won with so many lines; None: it has no such end.
        time_limit_s: The game ends after so many seconds of play; None: it does not.
        board: The blocks to begin with, as `Board.parse` reads them.
        dig: The game is won when none of the board's blocks `#` is left.
        kicks: The kick table.
        randomiser: How pieces are drawn.
        columns: 4 to 10.
        rows: The visible ones, 4 to 30; pieces enter above them.
        partial_lock_out: Whether a piece that locks with one cell above the visible rows
            ends the game; else all four have to be there.
    """

    start_level: int = 1
    gravity_cap: int = _LAST_GRAVITY_LEVEL
    lock_delay_s: float = 0.5  # docs/tetris.md "lock_down", and the next
    lock_resets: int | None = 15
    soft_drop_factor: int = 20
    previews: int = 5
    gravity: bool = True
    generation_delay_s: float = 0.0
    guard_s: float = 0.0
    hold: bool = True
    undo: bool = False
    lines_goal: int | None = None
    time_limit_s: float | None = None
    board: str = ""
    dig: bool = False
    kicks: Kicks = "srs"
    randomiser: Randomiser = "7-bag"
    columns: int = COLUMNS
    rows: int = VISIBLE_ROWS
    partial_lock_out: bool = False

    def __post_init__(self) -> None:
        if self.start_level < 1:
            raise ValueError(f"start level {self.start_level} must be 1 or more")
        check_cap(self.gravity_cap)
        if min(self.soft_drop_factor, self.previews) < 1:
            raise ValueError("soft drop factor and previews must each be 1 or more")
        if self.lock_resets is not None and self.lock_resets < 0:
            raise ValueError(f"lock resets {self.lock_resets} must be 0 or more, or None")
        if self.lines_goal is not None and self.lines_goal < 1:
            raise ValueError(f"a goal of {self.lines_goal} lines must be 1 or more, or None")
        _check_time("lock delay", self.lock_delay_s, _LEAST_DELAY_S)
        _check_time("generation delay", self.generation_delay_s, 0.0)
        _check_time("guard", self.guard_s, 0.0)
        if self.time_limit_s is not None:
            _check_time("time limit", self.time_limit_s, _LEAST_DELAY_S)
        if self.kicks not in get_args(Kicks) or self.randomiser not in get_args(Randomiser):
            raise ValueError(
                f"kicks {self.kicks!r} must be one of {get_args(Kicks)}, "
                f"randomiser {self.randomiser!r} one of {get_args(Randomiser)}"
            )
        self._check_board()

    def _check_board(self) -> None:
        if not _LEAST_SIDE <= self.columns <= COLUMNS:
            raise ValueError(f"columns {self.columns} must be from {_LEAST_SIDE} to {COLUMNS}")
        if not _LEAST_SIDE <= self.rows <= _MOST_ROWS:
            raise ValueError(f"rows {self.rows} must be from {_LEAST_SIDE} to {_MOST_ROWS}")
        board = Board.parse(self.board, self.columns)
        if board.height > self.rows or full_rows(board.bits):
            raise ValueError(f"the first board must have {self.rows} rows or fewer, none full")
        if self.dig and not board.garbage:
            raise ValueError(f"a board to dig must have blocks {GARBAGE}")


def _check_time(name: str, time_s: float, least_s: float) -> None:
    if not least_s <= time_s <= _LONGEST_S:
        raise ValueError(f"{name} {time_s} s must be from {least_s:g} to {_LONGEST_S:g} s")


def check_cap(level: int) -> None:
    """Refuse a gravity cap that is no level.

    Raises:
        ValueError: It is not from 1 to 20.
    """
    if not 1 <= level <= _LAST_GRAVITY_LEVEL:
        raise ValueError(f"gravity cap {level} must be a level from 1 to {_LAST_GRAVITY_LEVEL}")


def seconds_per_row(level: int) -> float:
    """Return how long a piece takes to fall one row: docs/tetris.md "gravity"."""
    steps = min(level, _LAST_GRAVITY_LEVEL) - 1
    return float((0.8 - steps * 0.007) ** steps)
