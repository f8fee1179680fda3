"""The table command -> key or pad button, read from TOML. docs/hid.md explains it to players.

[everywhere]                               # holds in every profile
menu = { host = "next" }                   # the next of the paired hosts

[profile.game]                             # the first profile is the one to begin with
left = { pad = "left" }                    # tap
down = { key = "down", mode = "hold" }     # as long as the orb is held
pause = { profile = "slides" }

[profile.slides]
right = { key = "pagedown" }
"""

import re
from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum
from importlib import resources
from pathlib import Path
from typing import Any, Final

from controller.config import ConfigError, parse_toml, read_toml
from controller.errors import UserError
from controller.links.bluetooth.hid.reports import KEY_USAGES, PAD_NAMES

DOWN_S: Final = 0.05  # a tap lasts three pictures of a game at 60 Hz
NEXT: Final = 0  # in place of a host's number
SHIPPED: Final = ("gamepad", "keyboard")
_DOWN_MS: Final = (10, 1000)
_MOST_HOSTS: Final = 9
_COMMAND: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")
_DOES: Final = ("key", "pad", "profile", "host")

# Chords that end programs and sessions, or reach past the program that has the focus.
_DANGEROUS: Final = (
    frozenset({"meta"}),
    frozenset({"alt", "f4"}),
    *(frozenset({"ctrl", "alt", f"f{n}"}) for n in range(1, 13)),
    frozenset({"ctrl", "alt", "delete"}),
    frozenset({"ctrl", "alt", "backspace"}),
)
_SIDES: Final = {"rctrl": "ctrl", "rshift": "shift", "altgr": "alt"}


class HidMapError(UserError, ValueError):
    """The mapping cannot be used; the message names the entry, and what belongs there."""


class Mode(Enum):
    """How long something stays down."""

    TAP = "tap"
    HOLD = "hold"


@dataclass(frozen=True, slots=True)
class Press:
    """What a command presses, and for how long.

    Attributes:
        keys: A chord of the keyboard, in the order in which its keys are named.
        pad: What is pressed on the pad.
        down_s: How long a tap lasts.
    """

    keys: tuple[str, ...] = ()
    pad: tuple[str, ...] = ()
    mode: Mode = Mode.TAP
    down_s: float = DOWN_S


@dataclass(frozen=True, slots=True)
class Switch:
    """The command changes to another profile."""

    profile: str


@dataclass(frozen=True, slots=True)
class Host:
    """The command gives the orb to another of the paired hosts: 1, 2 ..., or `NEXT`."""

    number: int


Entry = Press | Switch | Host


@dataclass(frozen=True, slots=True)
class HidMap:
    """What every command does in every profile.

    Attributes:
        profiles: By name, in the order of the file: command to entry.
        allowed: Dangerous chords that the user wants.
    """

    profiles: dict[str, dict[str, Entry]]
    allowed: tuple[frozenset[str], ...] = ()


def parse(table: dict[str, Any]) -> HidMap:
    """Return the mapping that a TOML table describes.

    Raises:
        HidMapError: An entry cannot be understood, or is not allowed.
    """
    for name in table:
        if name not in ("allow", "everywhere", "profile"):
            raise HidMapError(f"{name!r} is unknown; a mapping has allow, everywhere and profile")
    profiles = _table("profile", table.get("profile", {}))
    if not profiles:
        raise HidMapError("it has no profile; write [profile.NAME] above the commands")
    chords = table.get("allow", [])
    if not isinstance(chords, list):
        raise HidMapError('allow is no list; write allow = ["alt+f4"]')
    allowed = tuple(frozenset(_names("allow", "key", chord)) for chord in chords)
    common = table.get("everywhere", {})
    return HidMap(
        {
            name: {
                **_entries("everywhere", common, allowed, tuple(profiles)),
                **_entries(f"profile.{name}", entries, allowed, tuple(profiles)),
            }
            for name, entries in profiles.items()
        },
        allowed,
    )


def read(name: str) -> HidMap:
    """Return a mapping.

    Args:
        name: "gamepad" or "keyboard", which ship, or the path of a TOML file.

    Raises:
        HidMapError: The file cannot be read, is no TOML, or its table cannot be used.
    """
    try:
        if name in SHIPPED:
            return parse(parse_toml((resources.files(__package__) / f"{name}.toml").read_bytes()))
        return parse(read_toml(Path(name)))
    except ConfigError as error:
        raise HidMapError(f"{error}; name a file, or {' or '.join(SHIPPED)}") from None
    except HidMapError as error:
        raise HidMapError(f"{name}: {error} (docs/hid.md)") from None


def danger(keys: Collection[str], allowed: Collection[frozenset[str]]) -> str:
    """Return the dangerous chord that lies in these keys, "" if there is none.

    Args:
        keys: What would be down at one time.
        allowed: Chords that the user wants in spite of it; nothing else may be down beside one.
    """
    down = {_SIDES.get(key, key) for key in keys}
    wanted = [{_SIDES.get(key, key) for key in chord} for chord in allowed]
    for chord in _DANGEROUS:
        if chord <= down and not any(chord <= one >= down for one in wanted):
            return "+".join(sorted(chord, key=lambda key: (len(key) < 3, key != "ctrl", key)))
    return ""


def _entries(
    where: str, table: Any, allowed: tuple[frozenset[str], ...], profiles: tuple[str, ...]
) -> dict[str, Entry]:
    entries = {}
    for command, value in _table(where, table).items():
        at = f"[{where}] {command}"
        if not _COMMAND.fullmatch(command):
            raise HidMapError(f"{at}: a command is a name in small letters, such as drop")
        entries[command] = _entry(at, value, allowed, profiles)
    return entries


def _entry(
    at: str, value: Any, allowed: tuple[frozenset[str], ...], profiles: tuple[str, ...]
) -> Entry:
    if not isinstance(value, dict) or len(does := [name for name in _DOES if name in value]) != 1:
        raise HidMapError(f'{at}: write {{ pad = "a" }}; it has one of {", ".join(_DOES)}')
    what = does[0]
    for name in value:
        if name != what and (what not in ("key", "pad") or name not in ("mode", "down_ms")):
            raise HidMapError(f"{at}: {name!r} has no place beside {what!r}")
    wanted = value[what]
    if what == "profile":
        if wanted not in profiles:
            raise HidMapError(
                f"{at}: there is no profile {wanted!r}; there are: {', '.join(profiles)}"
            )
        return Switch(wanted)
    if what == "host":
        if wanted == "next":
            return Host(NEXT)
        if isinstance(wanted, bool) or wanted not in range(1, _MOST_HOSTS + 1):
            raise HidMapError(f'{at}: host is {wanted!r}; write "next", or 1 to {_MOST_HOSTS}')
        return Host(wanted)
    return _press(at, what, value, allowed)


def _press(at: str, what: str, value: dict[str, Any], allowed: tuple[frozenset[str], ...]) -> Press:
    names = _names(at, what, value[what])
    if what == "key" and (risk := danger(names, allowed)):
        wanted = "+".join(names)
        raise HidMapError(
            f"{at}: {risk} reaches past the program that has the focus; if {wanted} is meant, "
            f'write allow = ["{wanted}"] at the top of the file'
        )
    try:
        mode = Mode(value.get("mode", "tap"))
    except ValueError:
        raise HidMapError(f"{at}: mode is {value['mode']!r}, not tap or hold") from None
    down_ms = value.get("down_ms", DOWN_S * 1000)
    if mode is Mode.HOLD and "down_ms" in value:
        raise HidMapError(f"{at}: down_ms has no meaning in mode 'hold'")
    least, most = _DOWN_MS
    if isinstance(down_ms, bool) or not isinstance(down_ms, int | float):
        raise HidMapError(f"{at}: down_ms is {down_ms!r}, not a number")
    if not least <= down_ms <= most:
        raise HidMapError(f"{at}: down_ms is {down_ms:g}, not {least} to {most}")
    keys, pad = (names, ()) if what == "key" else ((), names)
    return Press(keys, pad, mode, down_ms / 1000)


def _names(at: str, what: str, words: Any) -> tuple[str, ...]:
    """Return the names in a chord such as ctrl+shift+t, or lb+rb on the pad."""
    if not isinstance(words, str):
        raise HidMapError(f"{at}: {words!r} is no name of a {what}")
    names = tuple(words.lower().split("+"))
    for name in names:
        if name not in (KEY_USAGES if what == "key" else PAD_NAMES):
            kind = "key" if what == "key" else "pad button"
            raise HidMapError(f"{at}: there is no {kind} {name!r}")
    if len(set(names)) < len(names):
        raise HidMapError(f"{at}: {words!r} names one twice")
    return names


def _table(where: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise HidMapError(f"{where} is no table; write [{where}] above its entries")
    return value
