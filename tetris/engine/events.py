"""Actions of a player, and events of the engine."""

from dataclasses import dataclass
from enum import Enum
from typing import TypeVar, dataclass_transform

from tetris.engine.pieces import Kind, Piece
from tetris.engine.rules import LONGEST_ROW_US
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

    __hash__ = object.__hash__  # members are single; a name's hash takes ten times as long


@dataclass(frozen=True, slots=True)
class Gravity:
    """From now on a row takes so long, whatever the level, until the game is restarted.

    A piece on the ground locks after `LOCK_ROWS` such rows if that is before the lock delay.
    """

    row_us: int  # microseconds, 1 to 9,999,999

    def __post_init__(self) -> None:
        if not 1 <= self.row_us <= LONGEST_ROW_US:
            raise ValueError(f"a row in {self.row_us} us must take from 1 to {LONGEST_ROW_US} us")


Input = Action | Gravity  # of `Game.update`


class TopOut(Enum):
    """Reason for a lost game: docs/tetris.md "top_out"."""

    BLOCK_OUT = "block out"  # a piece entered where blocks are
    LOCK_OUT = "lock out"  # a piece locked above the visible rows


class Finish(Enum):
    """Reason for the end of a game that was not lost."""

    GOAL = "goal reached"
    TIME = "time over"


EventT = TypeVar("EventT")


@dataclass_transform(frozen_default=True)
def _event(cls: type[EventT]) -> type[EventT]:
    """Make a value class that only the type checker keeps constant.

    One that is constant at run time takes four times as long to make.
    """
    return dataclass(slots=True, unsafe_hash=True)(cls)


@_event
class Event:
    """Something that happened, at a time of the caller's clock."""

    time_s: float


@_event
class Spawned(Event):
    """A piece entered; it is turned already if the player held a turn down."""

    piece: Piece


@_event
class Moved(Event):
    """The piece moved by (dx, dy) to its present place; without an action, by gravity."""

    piece: Piece
    dx: int
    dy: int
    action: Action | None


@_event
class Rotated(Event):
    """The piece turned; kick is the test (0..4) that made it fit."""

    piece: Piece
    kick: int
    action: Action


@_event
class Dropped(Event):
    """A hard drop let the piece fall so many rows to its present place."""

    piece: Piece
    rows: int


@_event
class Held(Event):
    """The piece in play went into the hold."""

    kind: Kind


@_event
class Blocked(Event):
    """An action that could not be carried out: no room, not allowed, or no game running."""

    action: Action


@_event
class Locked(Event):
    """The piece became blocks; rows are those it completed, as they were before they fell."""

    piece: Piece
    rows: tuple[int, ...]
    clear: Clear


@_event
class LevelUp(Event):
    """A new level began."""

    level: int


@_event
class ToppedOut(Event):
    """The game is over, and lost."""

    reason: TopOut


@_event
class Finished(Event):
    """The game is over, and was played to its end."""

    reason: Finish


@_event
class Undone(Event):
    """The last lock was taken back; its piece enters again."""


@_event
class Paused(Event):
    """Time stopped."""


@_event
class Resumed(Event):
    """Time goes on."""


@_event
class Restarted(Event):
    """A new game began."""
