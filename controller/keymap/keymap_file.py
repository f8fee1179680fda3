"""The table command -> key, chord, text or pad button, read from TOML.

arm_key = "f9"                     # in our window or terminal

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
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from controller.config import MAX_BYTES, ConfigError, parse_toml
from controller.errors import reason
from controller.files import read_text
from controller.keymap.key_names import ALIASES, KEYS, PAD, Chord, danger, typed
from controller.keymap.keymap import (
    DOWN_S,
    EVERY_S,
    LONG_S,
    Arm,
    Entry,
    KeyMap,
    KeyMapError,
    Kind,
    Mode,
    Press,
    Switch,
    Text,
)

_DOWN_MS: Final = (10, 1000)
_EVERY_MS: Final = (50, 5000)
_LONG_MS: Final = (500, 10_000)
_MOST_LETTERS: Final = 100  # of a text; while it is typed, commands wait for nobody
_COMMAND: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")
_HOT_KEYS: Final = ("f6", "f7", "f8", "f9", "f10", "f12", *"abcdefghijklmnopqrstuvwxyz0123456789")
_TOP: Final = ("allow", "arm_key", "profile_key", "long_ms", "everywhere", "profile", "long")
_DOES: Final = ("key", "pad", "text", "arm", "profile")


def parse(table: dict[str, Any], kind: Kind) -> KeyMap:
    """Return the mapping that a TOML table describes.

    Args:
        table: As in this module's docstring.
        kind: What is to be pressed: keys, or the buttons of a pad.

    Raises:
        KeyMapError: An entry cannot be understood, or is not allowed.
    """
    for name in table:
        if name not in _TOP:
            raise KeyMapError(f"{name!r} is unknown; a mapping has {', '.join(_TOP)}")
    profiles = _table("profile", table.get("profile", {}))
    if not profiles:
        raise KeyMapError("it has no profile; write [profile.NAME] above the commands")
    for name in profiles:
        if not name.isprintable():  # it is told on the terminal
            raise KeyMapError(
                f"the name of profile {name!r} has control characters; choose another"
            )
    allowed = tuple(_chord("allow", chord, KEYS) for chord in _list("allow", table))
    parser = _Parser(kind, allowed, tuple(profiles))
    common = parser.entries("everywhere", table.get("everywhere", {}))
    key_map = KeyMap(
        {
            name: {**common, **parser.entries(f"profile.{name}", entries)}
            for name, entries in profiles.items()
        },
        _hot_key("arm_key", table, "f9"),
        _hot_key("profile_key", table, "f8"),
        allowed,
        parser.held(table.get("long", {})),
        _seconds("", "long_ms", table, _LONG_MS, LONG_S),
    )
    if key_map.arm_key == key_map.profile_key:
        raise KeyMapError(f"arm_key and profile_key are both {key_map.arm_key!r}; choose two keys")
    for name in ("arm_key", "profile_key"):
        if getattr(key_map, name) in key_map.keys:
            raise KeyMapError(
                f"{name} is {getattr(key_map, name)!r}, which the mapping also presses; "
                "choose another, so that no command can press it"
            )
    return key_map


def read(path: Path, kind: Kind) -> KeyMap:
    """Return the mapping in a TOML file, for `--mapping`.

    Raises:
        KeyMapError: The file cannot be read, is no TOML, or its table cannot be used.
    """
    try:
        text = read_text(path, MAX_BYTES)
        table = parse_toml(text)
    except OSError as error:
        raise KeyMapError(
            f"cannot read {path}: {reason(error)}; name a mapping with --mapping (docs/keys.md)"
        ) from None
    except ConfigError as error:
        join = ", " if str(error).startswith("line ") else ": "
        raise KeyMapError(f"{path}{join}{error} (docs/keys.md)") from None
    try:
        return parse(table, kind)
    except KeyMapError as error:
        line = _line(text, str(error))
        raise KeyMapError(f"{path}{line}: {error} (docs/keys.md)") from None


@dataclass(frozen=True, slots=True)
class _Parser:
    """Reads entries for one kind of target."""

    kind: Kind
    allowed: tuple[Chord, ...]
    profiles: tuple[str, ...]

    def entries(self, where: str, table: Any) -> dict[str, Entry]:
        entries = {}
        for command, value in _table(where, table).items():
            at = f"[{where}] {command if command.isprintable() else ascii(command)}"
            if not _COMMAND.fullmatch(command):
                raise KeyMapError(f"{at}: a command is a name in small letters, such as drop")
            entries[command] = self.entry(at, value)
        return entries

    def held(self, table: Any) -> dict[str, Entry]:
        entries = self.entries("long", table)
        for command, entry in entries.items():
            if not isinstance(entry, Arm | Switch):
                raise KeyMapError(
                    f'[long] {command}: only arm and profile can wait; write mode = "hold" in a '
                    "profile for a key that is down as long as the orb is held"
                )
        return entries

    def entry(self, at: str, value: Any) -> Entry:
        if isinstance(value, str):
            value = {"key" if self.kind == "keyboard" else "pad": value}
        if not isinstance(value, dict) or len(does := [k for k in _DOES if k in value]) != 1:
            raise KeyMapError(f"{at}: it must have one of {', '.join(_DOES)}")
        known = {*does, *(("mode", "down_ms", "every_ms") if does[0] in ("key", "pad") else ())}
        for name in value:
            if name not in known:
                raise KeyMapError(f"{at}: {name!r} has no place beside {does[0]!r}")
        return self._does(at, does[0], value)

    def _does(self, at: str, what: str, value: dict[str, Any]) -> Entry:
        wrong = {"keyboard": ("pad",), "gamepad": ("key", "text")}[self.kind]
        if what in wrong:
            other = "gamepad" if self.kind == "keyboard" else "keyboard"
            raise KeyMapError(f"{at}: {what!r} needs --target {other}")
        match what:
            case "key" | "pad":
                return self._press(at, what, value)
            case "text":
                return Text(tuple(self._letters(at, value["text"])))
            case "arm":
                if value["arm"] is not True:
                    raise KeyMapError(f"{at}: arm is {value['arm']!r}; write arm = true")
                return Arm()
        if value["profile"] not in self.profiles:
            raise KeyMapError(
                f"{at}: there is no profile {value['profile']!r}; "
                f"there are: {', '.join(self.profiles)}"
            )
        return Switch(value["profile"])

    def _press(self, at: str, what: str, value: dict[str, Any]) -> Press:
        chord = _chord(at, value[what], KEYS if what == "key" else PAD)
        if risk := danger(chord, self.allowed):
            wanted = "+".join(chord)
            raise KeyMapError(
                f"{at}: {risk} reaches past the program that has the focus; if {wanted} is meant, "
                f'write allow = ["{wanted}"] at the top of the file'
            )
        try:
            mode = Mode(value.get("mode", "tap"))
        except ValueError:
            modes = ", ".join(mode.value for mode in Mode)
            raise KeyMapError(f"{at}: mode is {value['mode']!r}, not one of {modes}") from None
        if "every_ms" in value and mode is not Mode.REPEAT:
            raise KeyMapError(f'{at}: every_ms needs mode = "repeat"')
        if "down_ms" in value and mode not in (Mode.TAP, Mode.REPEAT):
            raise KeyMapError(f"{at}: down_ms has no meaning in mode {mode.value!r}")
        down_s = _seconds(at, "down_ms", value, _DOWN_MS, DOWN_S)
        every_s = _seconds(at, "every_ms", value, _EVERY_MS, max(EVERY_S, 2 * down_s))
        if down_s >= every_s:
            raise KeyMapError(f"{at}: every_ms must be more than down_ms")
        return Press(chord, mode, down_s, every_s)

    def _letters(self, at: str, text: Any) -> Iterator[Chord]:
        if not isinstance(text, str) or not 0 < len(text) <= _MOST_LETTERS:
            raise KeyMapError(f"{at}: text has 1 to {_MOST_LETTERS} letters")
        for char in text:
            chord = typed(char)
            if chord is None:
                raise KeyMapError(f"{at}: a US keyboard has no key for {char!r}")
            yield chord


def _chord(at: str, words: Any, known: dict[str, Any]) -> Chord:
    """Return the keys of a chord such as ctrl+shift+t."""
    if not isinstance(words, str):
        raise KeyMapError(f"{at}: {words!r} is no name of a key")
    prefix = "pad_" if known is PAD else ""
    names = [prefix + ALIASES.get(name, name) for name in words.lower().split("+")]
    for name in names:
        if name not in known:
            what = "pad button" if known is PAD else "key"
            raise KeyMapError(f"{at}: there is no {what} {name.removeprefix(prefix)!r}")
    if len(set(names)) < len(names):
        raise KeyMapError(f"{at}: {words!r} names a key twice")
    return tuple(names)


def _hot_key(name: str, table: dict[str, Any], default: str) -> str:
    key = table.get(name, default)
    if key not in _HOT_KEYS:
        raise KeyMapError(f"{name} is {key!r}; it is f6 to f10, f12, a letter or a digit")
    return str(key)


def _seconds(
    at: str, name: str, value: dict[str, Any], limits: tuple[int, int], default: float
) -> float:
    number = value.get(name, default * 1000)
    least, most = limits
    where = f"{at}: {name}" if at else name
    if isinstance(number, bool) or not isinstance(number, int | float) or number != number:
        raise KeyMapError(f"{where} is {number!r}, not a number")
    if not least <= number <= most:
        raise KeyMapError(f"{where} is {_short(number)}, not {least} to {most}")
    return float(number) / 1000


def _short(number: float) -> str:
    """Return a number in a few characters; TOML's whole numbers have no end."""
    return f"{number:g}" if abs(number) < 1e300 else "too large"


def _table(where: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise KeyMapError(f"{where} is no table; write [{where}] above its entries")
    return value


def _list(name: str, table: dict[str, Any]) -> list[Any]:
    value = table.get(name, [])
    if not isinstance(value, list):
        raise KeyMapError(f'{name} is no list; write {name} = ["alt+f4"]')
    return value


def _line(text: str, message: str) -> str:
    """Return ", line N" of the entry that a message begins with, "" if it cannot be found.

    An entry may stand anywhere that TOML lets it, such as `game.left = ...` below [profile], or in
    an inline table of several lines; then it is the line that comes closest above it.
    """
    found = re.match(r"\[([^]]*)\] ([^:]+):|'?([^\s':]+)", message)
    if found is None:
        return ""
    wanted = _path(f"{found[1]}.{found[2]}" if found[1] else found[3])
    header: list[str] = []
    closest, depth = "", 0
    for number, line in enumerate(text.splitlines(), 1):
        if opened := re.match(r"\s*\[([^]]*)\]", line):
            path = header = _path(opened[1])
        elif set_ := re.match(r"\s*([^=#]+?)\s*=", line):
            path = header + _path(set_[1])
        else:
            continue
        if path[: len(wanted)] == wanted:
            return f", line {number}"
        if depth < len(path) and wanted[: len(path)] == path:
            closest, depth = f", line {number}", len(path)
    return closest


def _path(key: str) -> list[str]:
    """Return the parts of a dotted key, without quotes and spaces."""
    return re.sub(r"[\s\"'\[]", "", key).split(".")
