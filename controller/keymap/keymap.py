"""Key mappings: each command's entry, profile by profile."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Final, Literal

from controller.errors import UserError
from controller.keymap.key_names import Chord

DOWN_S: Final = 0.05  # a tap lasts three pictures of a game at 60 Hz
EVERY_S: Final = 0.15  # from one press of a repeating key to the next
LONG_S: Final = 1.5  # a pinch in a game lasts half a second

Kind = Literal["keyboard", "gamepad"]


class KeyMapError(UserError, ValueError):
    """The mapping cannot be used; the message names the entry, and what belongs there."""


class Mode(Enum):
    """How long a key stays down."""

    TAP = "tap"
    HOLD = "hold"
    REPEAT = "repeat"
    TOGGLE = "toggle"


@dataclass(frozen=True, slots=True)
class Press:
    """Keys that a command presses, and for how long."""

    chord: Chord
    mode: Mode = Mode.TAP
    down_s: float = DOWN_S
    every_s: float = EVERY_S


@dataclass(frozen=True, slots=True)
class Text:
    """A text that a command types, one chord a letter."""

    chords: tuple[Chord, ...]


@dataclass(frozen=True, slots=True)
class Arm:
    """The command arms; while armed, it disarms."""


@dataclass(frozen=True, slots=True)
class Switch:
    """The command changes to another profile."""

    profile: str


Entry = Press | Text | Arm | Switch


@dataclass(frozen=True, slots=True)
class KeyMap:
    """What every command does in every profile.

    Attributes:
        profiles: By name, in the order of the file: command to entry.
        arm_key: The key of our window and terminal that arms and disarms.
        profile_key: The one that changes to the next profile.
        allowed: Dangerous chords that the user wants.
        long: What a command does in every profile when it is held for `long_s`: arm, or change
            the profile.
        long_s: How long that is.
    """

    profiles: dict[str, dict[str, Entry]]
    arm_key: str = "f9"
    profile_key: str = "f8"
    allowed: tuple[Chord, ...] = ()
    long: dict[str, Entry] = field(default_factory=dict)
    long_s: float = LONG_S

    @property
    def first(self) -> str:
        """The profile to begin with."""
        return next(iter(self.profiles))

    def beginning(self, profile: str) -> "KeyMap":
        """Return the mapping with a profile first; "" leaves the file's order.

        Raises:
            KeyMapError: There is no such profile.
        """
        if not profile:
            return self
        if profile not in self.profiles:
            raise KeyMapError(
                f"there is no profile {profile!r}; there are: {', '.join(self.profiles)}"
            )
        first = {profile: self.profiles[profile]}
        return replace(self, profiles={**first, **self.profiles})

    @property
    def commands(self) -> frozenset[str]:
        """All commands that do something, in any profile."""
        return frozenset().union(self.long, *self.profiles.values())

    @property
    def keys(self) -> frozenset[str]:
        """All keys that can ever be pressed."""
        return frozenset(
            key for entries in self.profiles.values() for e in entries.values() for key in _keys(e)
        )


def _keys(entry: Entry) -> Iterator[str]:
    if isinstance(entry, Press):
        yield from entry.chord
    elif isinstance(entry, Text):
        for chord in entry.chords:
            yield from chord
