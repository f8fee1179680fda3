"""Key mappings: the entry of each command by profile, parsed from TOML, and the outputs of targets.

[everywhere]                       # holds in every profile
pause = { profile = "slides" }

[profile.game]                     # the first profile is the one to begin with
left = "left"                      # tap a key
down = { key = "down", mode = "hold" }

[profile.slides]
right = "pagedown"

[long]                             # when the orb holds this command for long_ms
drop = { arm = true }

The language is the same for every target; `Outputs` names the entries that a target has.
"""

import re
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from enum import Enum
from importlib import resources
from pathlib import Path
from typing import Any, Final, Literal

from controller.shared import config
from controller.shared.config import ConfigError, settings
from controller.shared.errors import UserError
from controller.shared.keymap.key_names import ALIASES, KEYS, PAD, Chord, danger

DOWN_S: Final = 0.05  # a tap lasts three pictures of a game at 60 Hz
EVERY_S: Final = 0.15  # from one press of a repeating key to the next
LONG_S: Final = 1.5  # a pinch in a game lasts half a second
NEXT_HOST: Final = 0  # in place of a host's number

Kind = Literal["keyboard", "gamepad"]


class KeyMapError(UserError, ValueError):
    """The mapping cannot be used; the message names the entry and the expected value."""


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


Entry = Press | Arm | Switch | SelectHost


@dataclass(frozen=True, slots=True)
class Outputs:
    """The outputs of a target for mappings."""

    entries: tuple[str, ...]  # kinds of entries, such as "key" and "profile"
    names: Collection[str]  # keys and pad buttons
    plain: str = ""  # kind of an entry that is only a text; "" if the kind is required
    docs: str = "orbtouch docs keys"  # documentation page of the mapping


KEYBOARD: Final = Outputs(("key", "arm", "profile"), frozenset(KEYS), "key")
GAMEPAD: Final = Outputs(("pad", "arm", "profile"), frozenset(PAD), "pad")


@dataclass(frozen=True, slots=True)
class KeyMap:
    """The entry of every command in every profile."""

    profiles: dict[str, dict[str, Entry]]  # by name, in the order of the file: command to entry
    allowed: tuple[Chord, ...] = ()  # dangerous chords that the user permits
    # entries of commands held for `long_s`, in every profile
    long: dict[str, Entry] = field(default_factory=dict)
    long_s: float = LONG_S

    @property
    def first(self) -> str:
        """The profile to begin with."""
        return next(iter(self.profiles))

    def beginning(self, profile: str) -> "KeyMap":
        """Return the mapping with a profile first, "": as it is; KeyMapError if there is none."""
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
        return frozenset().union(*(one.chord for one in entries if isinstance(one, Press)))


# --- the file -------------------------------------------------------------------------------------

_SHIPPED: Final = {"keyboard": "arrows", "gamepad": "pad"}  # profiles of default.toml
_MOST_HOSTS: Final = 9
_COMMAND: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")
_TARGETS: Final = {  # of each kind of entry
    "key": "--target keyboard",
    "pad": "--target gamepad",
    "arm": "--target keyboard or gamepad",
    "profile": "",
    "host": "--link hid:",
}


@dataclass(frozen=True, slots=True)
class _File:
    """The whole file."""

    profile: dict[str, Any] = field(metadata={"expected": "a table [profile.NAME] for each"})
    everywhere: dict[str, Any] = field(default_factory=dict)
    long: dict[str, Any] = field(default_factory=dict)
    long_s: float = field(
        default=LONG_S, metadata={"key": "long_ms", "range": (500, 10_000), "divisor": 1000.0}
    )
    allow: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Timing:
    """What may stand beside a key or pad button."""

    mode: str = field(default="tap", metadata={"choices": tuple(mode.value for mode in Mode)})
    down_s: float = field(
        default=DOWN_S, metadata={"key": "down_ms", "range": (10, 1000), "divisor": 1000.0}
    )
    every_s: float = field(
        default=0.0, metadata={"key": "every_ms", "range": (50, 5000), "divisor": 1000.0}
    )


def load(path: Path, outputs: Outputs) -> KeyMap:
    """Return a shipped mapping, "keyboard" or "gamepad", or a file's; KeyMapError if it fails."""
    return read(path, outputs)[1]


def read(path: Path, outputs: Outputs) -> tuple[dict[str, Any], KeyMap]:
    """Return a mapping as the table of its file, too; otherwise as `load`."""

    def made(table: dict[str, Any]) -> tuple[dict[str, Any], KeyMap]:
        return table, parse(table, outputs)

    if str(path) in _SHIPPED:
        return made(_shipped(_SHIPPED[str(path)], outputs))
    return config.checked(path, made, KeyMapError, outputs.docs)


def _shipped(profile: str, outputs: Outputs) -> dict[str, Any]:
    """Return a profile of default.toml, without the entries that the target lacks."""
    table = config.parse_toml((resources.files(__package__) / "default.toml").read_bytes())
    table["profile"] = {profile: table["profile"][profile]}
    for name in ("everywhere", "long"):
        entries = table[name].items()
        table[name] = {key: entry for key, entry in entries if set(entry) & set(outputs.entries)}
    return table


def parse(table: dict[str, Any], outputs: Outputs) -> KeyMap:
    """Return the mapping in a TOML table; ConfigError if an entry cannot be understood."""
    file = settings(_File, table)
    if not file.profile:
        raise ConfigError("has no profile; write [profile.NAME] above the commands")
    for name in file.profile:
        if not name.isprintable():  # it is printed on the terminal
            raise ConfigError(f"has a profile {name!r}, whose name has control characters")
    reader = _EntryReader(outputs, tuple(file.profile), name="allow")
    reader = replace(reader, allowed=tuple(reader.chord("key", one, KEYS) for one in file.allow))
    everywhere = reader.entries("everywhere", file.everywhere)
    return KeyMap(
        {
            name: everywhere | reader.entries(f"profile.{name}", entries)
            for name, entries in file.profile.items()
        },
        reader.allowed,
        reader.entries("long", file.long),
        file.long_s,
    )


@dataclass(frozen=True, slots=True)
class _EntryReader:
    """Reads entries for one target."""

    outputs: Outputs
    profiles: tuple[str, ...]
    allowed: tuple[Chord, ...] = ()
    table: str = ""  # that it is reading
    name: str = ""  # of the entry

    def wrong(self, problem: str) -> ConfigError:
        """Return the error of the present entry."""
        name = self.name if self.name.isprintable() else ascii(self.name)
        where = f"[{self.table}] {name}" if self.table else name
        return ConfigError(f"has {where}: {problem}", self.table, self.name)

    def entries(self, name: str, table: Any) -> dict[str, Entry]:
        """Return the entries of a table of that name, by command."""
        if not isinstance(table, dict):
            raise ConfigError(f"has {name} = {table!r}; expected is a table [{name}]", name)
        return {
            command: replace(self, table=name, name=command).entry(value)
            for command, value in table.items()
        }

    def entry(self, value: Any) -> Entry:
        """Return the present entry."""
        if not _COMMAND.fullmatch(self.name):
            raise self.wrong("a command is a name in small letters, such as drop")
        if isinstance(value, str) and self.outputs.plain:
            value = {self.outputs.plain: value}
        if not isinstance(value, dict) or len(does := [k for k in _TARGETS if k in value]) != 1:
            raise self.wrong(
                f"it must have one of {', '.join(_TARGETS)}, "
                f'as in {{ {self.outputs.entries[0]} = "a" }}'
            )
        what = does[0]
        wanted = value[what]
        beside = {name: value[name] for name in value if name != what}
        if what not in self.outputs.entries:
            raise self.wrong(f"{what!r} needs {_TARGETS[what]}")
        if self.table == "long" and what not in ("arm", "profile"):
            raise self.wrong('only arm and profile can wait; in a profile, mode = "hold" holds')
        if what in ("key", "pad"):
            timing = settings(_Timing, beside, f"{self.table}.{self.name}")
            return self.press(self.chord(what, wanted, self.outputs.names), timing)
        if beside:
            raise self.wrong(f"{next(iter(beside))!r} has no place beside {what!r}")
        if what == "arm" and wanted is True:
            return Arm()
        if what == "profile" and wanted in self.profiles:
            return Switch(wanted)
        if what == "host" and wanted == "next":
            return SelectHost(NEXT_HOST)
        if what == "host" and type(wanted) is int and 0 < wanted <= _MOST_HOSTS:
            return SelectHost(wanted)
        possible = {
            "arm": "write arm = true",
            "profile": f"there are: {', '.join(self.profiles)}",
            "host": f'write "next", or 1 to {_MOST_HOSTS}',
        }
        raise self.wrong(f"{what} is {wanted!r}; {possible[what]}")

    def press(self, chord: Chord, timing: _Timing) -> Press:
        """Return the press of a chord."""
        if risk := danger(chord, self.allowed):
            wanted = "+".join(chord)
            raise self.wrong(
                f"{risk} reaches past the program that has the focus; if {wanted} is meant, "
                f'write allow = ["{wanted}"] at the top of the file'
            )
        every_s = timing.every_s or max(EVERY_S, 2 * timing.down_s)
        if timing.down_s >= every_s:
            raise self.wrong("every_ms must be more than down_ms")
        return Press(chord, Mode(timing.mode), timing.down_s, every_s)

    def chord(self, what: str, words: Any, known: Collection[str]) -> Chord:
        """Return the names in a chord such as ctrl+shift+t, or lb+a on the pad."""
        if not isinstance(words, str):
            raise self.wrong(f"{words!r} is no name of a {what}")
        prefix = "pad_" if what == "pad" else ""
        names = tuple(prefix + ALIASES.get(name, name) for name in words.lower().split("+"))
        for name in names:
            if name not in known:
                kind = "pad button" if prefix else "key"
                raise self.wrong(f"there is no {kind} {name.removeprefix(prefix)!r}")
        if len(set(names)) < len(names):
            raise self.wrong(f"{words!r} names a {what} twice")
        return names
