"""Actions of a player, and events of the engine."""

from dataclasses import dataclass
from enum import Enum

from tetris.engine.pieces import Kind, Piece
from tetris.engine.rules import LAST_GRAVITY_LEVEL
from tetris.engine.scoring import Clear


class Action(Enum):
    """One thing that the player can do; `PAUSE` also resumes."""

    LEFT = "left"
    RIGHT = "right"
    DOWN = "down"  # one row
    HARD_DROP = "hard_drop"
    ROTATE_CW = "rotate_cw"
    ROTATE_CCW = "rotate_ccw"
    HOLD = "hold"
    UNDO = "undo"  # takes a lock back where the rules allow it
    PAUSE = "pause"
    RESTART = "restart"


@dataclass(frozen=True, slots=True)
class GravityCap:
    """From now on gravity is not faster than at this level, 1 to 20; points stay as they are."""

    level: int

    def __post_init__(self) -> None:
        if not 1 <= self.level <= LAST_GRAVITY_LEVEL:
            raise ValueError(f"gravity cap {self.level} must be from 1 to {LAST_GRAVITY_LEVEL}")


Input = Action | GravityCap  # of `Game.update`


class TopOut(Enum):
    """Reason for a lost game: docs/tetris.md "top_out"."""

    BLOCK_OUT = "block out"  # a piece entered where blocks are
    LOCK_OUT = "lock out"  # a piece locked above the visible rows


class Finish(Enum):
    """Reason for the end of a game that was not lost."""

    GOAL = "goal reached"
    TIME = "time over"


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, at a time of the caller's clock."""

    time_s: float


@dataclass(frozen=True, slots=True)
class Spawned(Event):
    """A piece entered; it is turned already if the player held a turn down."""

    piece: Piece


@dataclass(frozen=True, slots=True)
class Moved(Event):
    """The piece moved by (dx, dy) to its present place; without an action, by gravity."""

    piece: Piece
    dx: int
    dy: int
    action: Action | None


@dataclass(frozen=True, slots=True)
class Rotated(Event):
    """The piece turned; kick is the test (0..4) that made it fit."""

    piece: Piece
    kick: int
    action: Action


@dataclass(frozen=True, slots=True)
class Dropped(Event):
    """A hard drop let the piece fall so many rows to its present place."""

    piece: Piece
    rows: int


@dataclass(frozen=True, slots=True)
class Held(Event):
    """The piece in play went into the hold."""

    kind: Kind


@dataclass(frozen=True, slots=True)
class Blocked(Event):
    """An action that could not be carried out: no room, not allowed, or no game running."""

    action: Action


@dataclass(frozen=True, slots=True)
class Locked(Event):
    """The piece became blocks; rows are those it completed, as they were before they fell."""

    piece: Piece
    rows: tuple[int, ...]
    clear: Clear


@dataclass(frozen=True, slots=True)
class LevelUp(Event):
    """A new level began."""

    level: int


@dataclass(frozen=True, slots=True)
class ToppedOut(Event):
    """The game is over, and lost."""

    reason: TopOut


@dataclass(frozen=True, slots=True)
class Finished(Event):
    """The game is over, and was played to its end."""

    reason: Finish


@dataclass(frozen=True, slots=True)
class Undone(Event):
    """The last lock was taken back; its piece enters again."""


@dataclass(frozen=True, slots=True)
class Paused(Event):
    """Time stopped."""


@dataclass(frozen=True, slots=True)
class Resumed(Event):
    """Time goes on."""


@dataclass(frozen=True, slots=True)
class Restarted(Event):
    """A new game began."""
