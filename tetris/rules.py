"""The rules that a player may change, and gravity. Source: docs/tetris.md."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

_LAST_GRAVITY_LEVEL: Final = 20  # beyond it nothing falls faster: docs/tetris.md "gravity"
_LEAST_DELAY_S: Final = 0.001


class Phase(Enum):
    """Whether time passes in the game."""

    RUNNING = "running"
    PAUSED = "paused"
    OVER = "over"


@dataclass(frozen=True, slots=True)
class Config:
    """The rules that a player may change.

    Attributes:
        start_level: 1 or more; sets the first gravity and the first goal.
        gravity_cap: The level whose gravity is never exceeded, 1 to 20; scoring goes on
            with the real level. Slow controllers cap it at 3.
        lock_delay_s: How long a piece rests on the ground before it locks, 0.001 or more.
        lock_resets: Shifts and rotations that restart the delay, until a new lowest row.
        soft_drop_factor: How many times faster than gravity a soft drop falls.
        previews: How many next pieces are shown.
    """

    start_level: int = 1
    gravity_cap: int = _LAST_GRAVITY_LEVEL
    lock_delay_s: float = 0.5  # docs/tetris.md "lock_down", and the next
    lock_resets: int = 15
    soft_drop_factor: int = 20
    previews: int = 5

    def __post_init__(self) -> None:
        if self.start_level < 1:
            raise ValueError(f"start level {self.start_level} must be 1 or more")
        if not 1 <= self.gravity_cap <= _LAST_GRAVITY_LEVEL:
            raise ValueError(f"gravity cap {self.gravity_cap} must be a level from 1 to 20")
        if self.lock_delay_s < _LEAST_DELAY_S:
            raise ValueError(f"lock delay {self.lock_delay_s} s must be {_LEAST_DELAY_S} s or more")
        if min(self.soft_drop_factor, self.previews, self.lock_resets) < 1:
            raise ValueError("soft drop factor, previews and lock resets must each be 1 or more")


def seconds_per_row(level: int) -> float:
    """Return how long a piece takes to fall one row: docs/tetris.md "gravity"."""
    steps = min(level, _LAST_GRAVITY_LEVEL) - 1
    return float((0.8 - steps * 0.007) ** steps)
