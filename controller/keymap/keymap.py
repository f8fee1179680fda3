"""Key mappings: the entry of each command by profile, and the outputs of targets."""

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Final, Literal

from controller.errors import UserError
from controller.keymap.key_names import KEYS, PAD, Chord

DOWN_S: Final = 0.05  # a tap lasts three pictures of a game at 60 Hz
EVERY_S: Final = 0.15  # from one press of a repeating key to the next
LONG_S: Final = 1.5  # a pinch in a game lasts half a second
NEXT_HOST: Final = 0  # in place of a host's number

Kind = Literal["keyboard", "gamepad"]


class KeyMapError(UserError, ValueError):
    """The mapping cannot be used; the message names the entry and the expected value.

    Attributes:
        path: The entry's place in the file: names of tables, and its own.
    """

    def __init__(self, message: str, path: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.path = path


class Mode(Enum):
    """Duration of a key press."""

    TAP = "tap"
    HOLD = "hold"
    REPEAT = "repeat"
    TOGGLE = "toggle"


@dataclass(frozen=True, slots=True)
class Press:
    """Keys or pad buttons of a command, and the timing of their press."""

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


@dataclass(frozen=True, slots=True)
class SelectHost:
    """The command connects another of the paired hosts: 1, 2 ..., or `NEXT_HOST`."""

    number: int


Entry = Press | Text | Arm | Switch | SelectHost


@dataclass(frozen=True, slots=True)
class Outputs:
    """The outputs of a target for mappings."""

    entries: tuple[str, ...]  # kinds of entries, such as "key" and "profile"
    names: Collection[str]  # keys and pad buttons
    plain: str = ""  # kind of an entry that is only a text; "" if the kind is required
    advice: str = "name a mapping with --mapping"  # advice about an unreadable file
    docs: str = "docs/keys.md"  # documentation page of the mapping


KEYBOARD: Final = Outputs(("key", "text", "arm", "profile"), frozenset(KEYS), "key")
GAMEPAD: Final = Outputs(("pad", "arm", "profile"), frozenset(PAD), "pad")


@dataclass(frozen=True, slots=True)
class KeyMap:
    """The entry of every command in every profile."""

    profiles: dict[str, dict[str, Entry]]  # by name, in the order of the file: command to entry
    arm_key: str = "f9"  # key of the program's window and terminal that arms and disarms
    profile_key: str = "f8"  # key that changes to the next profile
    allowed: tuple[Chord, ...] = ()  # dangerous chords that the user permits
    # entries of commands held for `long_s`, in every profile
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
            there = ", ".join(self.profiles)
            raise KeyMapError(f"there is no profile {profile!r}; there are: {there}")
        return replace(self, profiles={profile: self.profiles[profile], **self.profiles})

    @property
    def commands(self) -> frozenset[str]:
        """All commands with an entry in any profile."""
        return frozenset().union(self.long, *self.profiles.values())

    @property
    def keys(self) -> frozenset[str]:
        """All keys that can ever be pressed."""
        entries = [entry for profile in self.profiles.values() for entry in profile.values()]
        pressed = [entry.chord for entry in entries if isinstance(entry, Press)]
        typed = [chord for entry in entries if isinstance(entry, Text) for chord in entry.chords]
        return frozenset().union(*pressed, *typed)
