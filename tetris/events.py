"""What a player can do, and what the engine says has happened."""

from dataclasses import dataclass
from enum import Enum

from tetris.pieces import Kind, Piece
from tetris.scoring import Clear


class Action(Enum):
    """One thing that the player can do; `PAUSE` also resumes."""

    LEFT = "left"
    RIGHT = "right"
    DOWN = "down"  # one row
    HARD_DROP = "hard_drop"
    ROTATE_CW = "rotate_cw"
    ROTATE_CCW = "rotate_ccw"
    HOLD = "hold"
    PAUSE = "pause"
    RESTART = "restart"


class TopOut(Enum):
    """How a game ended: docs/tetris.md "top_out"."""

    BLOCK_OUT = "block out"  # a piece entered where blocks are
    LOCK_OUT = "lock out"  # a piece locked wholly above the visible rows


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, at a time of the caller's clock."""

    time_s: float


@dataclass(frozen=True, slots=True)
class Spawned(Event):
    """A piece entered."""

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
    """An action that could not be carried out: no room, hold spent, or no game running."""

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
    """The game is over."""

    reason: TopOut


@dataclass(frozen=True, slots=True)
class Paused(Event):
    """Time stopped."""


@dataclass(frozen=True, slots=True)
class Resumed(Event):
    """Time goes on."""


@dataclass(frozen=True, slots=True)
class Restarted(Event):
    """A new game began on an empty board."""
