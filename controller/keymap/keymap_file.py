"""Parser of key mappings: the table command -> key, chord, text, pad button or host, in TOML.

arm_key = "f9"                     # in the program's window or terminal

[everywhere]                       # holds in every profile
menu = { arm = true }              # a gesture that arms and disarms
pause = { profile = "slides" }

[profile.game]                     # the first profile is the one to begin with
left = "left"                      # tap a key
down = { key = "down", mode = "hold" }

[profile.slides]
drop = { text = "Thank you" }

[long]                             # when the orb holds this command for long_ms
drop = { arm = true }

The language is the same for every target; `Outputs` names the entries that a target has.
"""

import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any, Final, NamedTuple

from controller.config import MAX_BYTES, ConfigError, line_of, parse_toml
from controller.errors import reason
from controller.files import read_text
from controller.keymap.key_names import ALIASES, KEYS, Chord, danger, typed
from controller.keymap.keymap import (
    DOWN_S,
    EVERY_S,
    LONG_S,
    NEXT_HOST,
    Arm,
    Entry,
    KeyMap,
    KeyMapError,
    Mode,
    Outputs,
    Press,
    SelectHost,
    Switch,
    Text,
)

_SHIPPED: Final = {"keyboard": "arrows", "gamepad": "pad"}  # profiles of default.toml
_DOWN_MS: Final = (10, 1000)
_EVERY_MS: Final = (50, 5000)
_LONG_MS: Final = (500, 10_000)
_MOST_LETTERS: Final = 100  # of a text, during which commands are dropped
_MOST_HOSTS: Final = 9
_COMMAND: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")
_HOT_KEYS: Final = ("f6", "f7", "f8", "f9", "f10", "f12", *"abcdefghijklmnopqrstuvwxyz0123456789")
_TOP: Final = ("allow", "arm_key", "profile_key", "long_ms", "everywhere", "profile", "long")
_BESIDE: Final = {"key": ("mode", "down_ms", "every_ms"), "pad": ("mode", "down_ms", "every_ms")}
_TARGETS: Final = {  # of each kind of entry
    "key": "--target keyboard",
    "pad": "--target gamepad",
    "text": "--target keyboard",
    "arm": "--target keyboard or gamepad",
    "profile": "",
    "host": "--link hid:",
}


def load(path: Path, outputs: Outputs) -> KeyMap:
    """Return a shipped mapping, "keyboard" or "gamepad", or that of a TOML file.

    Raises:
        KeyMapError: The file cannot be read, is no TOML, or its table cannot be used.
    """
    text = ""
    try:
        if str(path) in _SHIPPED:
            return parse(_shipped(_SHIPPED[str(path)], outputs), outputs)
        text = read_text(path, MAX_BYTES)
        return parse(parse_toml(text), outputs)
    except OSError as error:
        found = f"cannot read {path}: {reason(error)}; {outputs.advice}"
    except ConfigError as error:
        found = f"{path}{', ' if str(error).startswith('line ') else ': '}{error}"
    except KeyMapError as error:
        found = f"{path}{line_of(text, '.'.join(error.path), near=True)}: {error}"
    raise KeyMapError(f"{found} ({outputs.docs})")


def _shipped(profile: str, outputs: Outputs) -> dict[str, Any]:
    """Return a profile of default.toml, without the entries that the target lacks."""
    table = parse_toml((resources.files(__package__) / "default.toml").read_bytes())
    table["profile"] = {profile: table["profile"][profile]}
    for name in ("everywhere", "long"):
        entries = table[name].items()
        table[name] = {key: entry for key, entry in entries if set(entry) & set(outputs.entries)}
    return table


def parse(table: dict[str, Any], outputs: Outputs) -> KeyMap:
    """Return the mapping that a TOML table describes.

    Args:
        table: As in this module's docstring.
        outputs: Of the target.

    Raises:
        KeyMapError: An entry cannot be understood, or is not allowed.
    """
    for name in table:
        if name not in _TOP:
            raise KeyMapError(f"{name!r} is unknown; a mapping has {', '.join(_TOP)}", (name,))
    profiles = _table(table, ("profile",))
    if not profiles:
        raise KeyMapError("it has no profile; write [profile.NAME] above the commands")
    for name in profiles:
        if not name.isprintable():  # it is printed on the terminal
            raise KeyMapError(
                f"the name of profile {name!r} has control characters; choose another"
            )
    chords = table.get("allow", [])
    if not isinstance(chords, list):
        raise KeyMapError('allow is no list; write allow = ["alt+f4"]', ("allow",))
    allowed = tuple(_chord(_Place(("allow",)), "key", chord, KEYS) for chord in chords)
    parser = _Parser(outputs, allowed, tuple(profiles))
    everywhere = parser.entries(table, ("everywhere",))
    key_map = KeyMap(
        {name: everywhere | parser.entries(profiles, ("profile", name)) for name in profiles},
        allowed=allowed,
        long=parser.entries(table, ("long",)),
        long_s=_seconds(_Place(), table, "long_ms", _LONG_MS, LONG_S),
    )
    arm_key, profile_key = _hot_keys(table, key_map.keys)
    return replace(key_map, arm_key=arm_key, profile_key=profile_key)


class _Place(NamedTuple):
    """An entry's place in the file: the tables that it is in, and its name."""

    path: tuple[str, ...] = ()

    def wrong(self, problem: str, *names: str) -> KeyMapError:
        """Return the error of this entry, or of a name below it."""
        path = [name if name.isprintable() else ascii(name) for name in self.path]
        table = f"[{'.'.join(path[:-1])}] " if path[:-1] else ""
        where = f"{table}{path[-1]}: " if path else ""
        return KeyMapError(where + problem, (*self.path, *names))


@dataclass(frozen=True, slots=True)
class _Parser:
    """Reads entries for one target."""

    outputs: Outputs
    allowed: tuple[Chord, ...]
    profiles: tuple[str, ...]

    def entries(self, above: dict[str, Any], path: tuple[str, ...]) -> dict[str, Entry]:
        entries = {}
        for command, value in _table(above, path).items():
            place = _Place((*path, command))
            if not _COMMAND.fullmatch(command):
                raise place.wrong("a command is a name in small letters, such as drop")
            entries[command] = self._entry(place, value)
        return entries

    def _entry(self, place: _Place, value: Any) -> Entry:
        if isinstance(value, str) and self.outputs.plain:
            value = {self.outputs.plain: value}
        if not isinstance(value, dict) or len(does := [k for k in _TARGETS if k in value]) != 1:
            raise place.wrong(
                f"it must have one of {', '.join(_TARGETS)}, "
                f'as in {{ {self.outputs.entries[0]} = "a" }}'
            )
        what = does[0]
        for name in value:
            if name != what and name not in _BESIDE.get(what, ()):
                raise place.wrong(f"{name!r} has no place beside {what!r}")
        if what not in self.outputs.entries:
            raise place.wrong(f"{what!r} needs {_TARGETS[what]}")
        if place.path[0] == "long" and what in ("key", "pad", "text"):
            raise place.wrong(
                'only arm and profile can wait; write mode = "hold" in a profile for a key that is '
                "down as long as the orb is held"
            )
        return self._read(place, what, value)

    def _read(self, place: _Place, what: str, value: dict[str, Any]) -> Entry:
        wanted = value[what]
        match what:
            case "key" | "pad":
                return self._press(place, what, value)
            case "text":
                return _text(place, wanted)
            case "arm":
                if wanted is not True:
                    raise place.wrong(f"arm is {wanted!r}; write arm = true")
                return Arm()
            case "profile":
                if wanted not in self.profiles:
                    there = ", ".join(self.profiles)
                    raise place.wrong(f"there is no profile {wanted!r}; there are: {there}")
                return Switch(wanted)
        if wanted == "next":
            return SelectHost(NEXT_HOST)
        if isinstance(wanted, bool) or wanted not in range(1, _MOST_HOSTS + 1):
            raise place.wrong(f'host is {wanted!r}; write "next", or 1 to {_MOST_HOSTS}')
        return SelectHost(wanted)

    def _press(self, place: _Place, what: str, value: dict[str, Any]) -> Press:
        chord = _chord(place, what, value[what], self.outputs.names)
        if risk := danger(chord, self.allowed):
            wanted = "+".join(chord)
            raise place.wrong(
                f"{risk} reaches past the program that has the focus; if {wanted} is meant, "
                f'write allow = ["{wanted}"] at the top of the file'
            )
        try:
            mode = Mode(value.get("mode", "tap"))
        except ValueError:
            modes = ", ".join(mode.value for mode in Mode)
            raise place.wrong(f"mode is {value['mode']!r}, not one of {modes}") from None
        if "every_ms" in value and mode is not Mode.REPEAT:
            raise place.wrong('every_ms needs mode = "repeat"')
        if "down_ms" in value and mode not in (Mode.TAP, Mode.REPEAT):
            raise place.wrong(f"down_ms has no meaning in mode {mode.value!r}")
        down_s = _seconds(place, value, "down_ms", _DOWN_MS, DOWN_S)
        every_s = _seconds(place, value, "every_ms", _EVERY_MS, max(EVERY_S, 2 * down_s))
        if down_s >= every_s:
            raise place.wrong("every_ms must be more than down_ms")
        return Press(chord, mode, down_s, every_s)


def _text(place: _Place, text: Any) -> Text:
    if not isinstance(text, str) or not 0 < len(text) <= _MOST_LETTERS:
        raise place.wrong(f"text has 1 to {_MOST_LETTERS} letters")
    chords = []
    for char in text:
        chord = typed(char)
        if chord is None:
            raise place.wrong(f"a US keyboard has no key for {char!r}")
        chords.append(chord)
    return Text(tuple(chords))


def _chord(place: _Place, what: str, words: Any, known: Collection[str]) -> Chord:
    """Return the names in a chord such as ctrl+shift+t, or lb+a on the pad."""
    if not isinstance(words, str):
        raise place.wrong(f"{words!r} is no name of a {what}")
    prefix = "pad_" if what == "pad" else ""
    names = [prefix + ALIASES.get(name, name) for name in words.lower().split("+")]
    for name in names:
        if name not in known:
            kind = "pad button" if prefix else "key"
            raise place.wrong(f"there is no {kind} {name.removeprefix(prefix)!r}")
    if len(set(names)) < len(names):
        raise place.wrong(f"{words!r} names a {what} twice")
    return tuple(names)


def _hot_keys(table: dict[str, Any], pressed: Collection[str]) -> list[str]:
    """Return the keys of the window that arm, and that change the profile."""
    keys = {"arm_key": "f9", "profile_key": "f8"}
    for name, usual in keys.items():
        key = keys[name] = table.get(name, usual)
        if key not in _HOT_KEYS:
            wanted = "f6 to f10, f12, a letter or a digit"
            raise KeyMapError(f"{name} is {key!r}; it is {wanted}", (name,))
        if key in pressed:
            raise KeyMapError(
                f"{name} is {key!r}, which the mapping also presses; choose another, so that no "
                "command can press it",
                (name,),
            )
    if len(set(keys.values())) < len(keys):
        both = keys["arm_key"]
        raise KeyMapError(
            f"arm_key and profile_key are both {both!r}; choose two keys", ("arm_key",)
        )
    return list(keys.values())


def _seconds(
    place: _Place, value: dict[str, Any], name: str, limits: tuple[int, int], usual_s: float
) -> float:
    number = value.get(name, usual_s * 1000)
    least, most = limits
    if isinstance(number, bool) or not isinstance(number, int | float) or number != number:
        raise place.wrong(f"{name} is {number!r}, not a number", name)
    if not least <= number <= most:
        # config.parse_toml leaves no whole number that is too large for a float
        raise place.wrong(f"{name} is {number:g}, not {least} to {most}", name)
    return number / 1000


def _table(above: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    table = above.get(path[-1], {})
    if not isinstance(table, dict):
        where = ".".join(path)
        raise KeyMapError(f"{where} is no table; write [{where}] above its entries", path)
    return table
