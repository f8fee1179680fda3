"""HID reports as bytes; `report_map` describes them to hosts."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

from controller.keymap.key_state import Stroke
from controller.keymap.keymap import Outputs
from controller.links.bluetooth.hid.report_map import GAMEPAD, HAT_MIDDLE, KEYBOARD, KEYS, STICK

# Names of keys are places on a US keyboard, as in docs/keys.md; numbers are usages of the page
# "Keyboard/Keypad" of the HID Usage Tables, section 10.
_ROWS: Final[dict[int, tuple[str, ...]]] = {  # the usage of the first one; the others follow
    0x04: tuple("abcdefghijklmnopqrstuvwxyz"),
    0x1E: tuple("1234567890"),
    0x28: ("enter", "escape", "backspace", "tab", "space"),
    0x2D: ("minus", "equal", "leftbracket", "rightbracket", "backslash"),
    0x33: ("semicolon", "apostrophe", "grave", "comma", "period", "slash"),
    0x3A: tuple(f"f{n}" for n in range(1, 13)),
    0x49: ("insert", "home", "pageup", "delete", "end", "pagedown"),
    0x4F: ("right", "left", "down", "up"),
    0x7F: ("mute", "volumeup", "volumedown"),
    0xE0: ("ctrl", "shift", "alt", "meta", "rctrl", "rshift", "altgr"),
}
KEY_USAGES: Final = {
    name: first + n for first, names in _ROWS.items() for n, name in enumerate(names)
}

# Button numbers count from 1, in the order in which Linux and Android name those of a gamepad:
# linux/input-event-codes.h, BTN_GAMEPAD and those that follow (3 and 6 are C and Z).
BUTTON_NUMBERS: Final = {
    "a": 1, "b": 2, "x": 4, "y": 5, "lb": 7, "rb": 8, "lt": 9, "rt": 10,
    "select": 11, "start": 12, "guide": 13, "l3": 14, "r3": 15,
}  # fmt: skip
_HAT: Final = {"up": (0, -1), "down": (0, 1), "left": (-1, 0), "right": (1, 0)}
_STICK: Final = {f"stick_{name}": way for name, way in _HAT.items()}
PAD_NAMES: Final = (*BUTTON_NUMBERS, *_HAT, *_STICK)

# Outputs of key mappings for this device.
OUTPUTS: Final = Outputs(
    ("pad", "key", "profile", "host"),
    frozenset({*KEY_USAGES, *(f"pad_{name}" for name in PAD_NAMES)}),
    advice="name a file, or gamepad or keyboard",
    docs="docs/hid.md",
)

# Steps of 45 degrees clockwise from up; (0, 0) is nowhere.
_HAT_VALUES: Final = {
    (0, -1): 0, (1, -1): 1, (1, 0): 2, (1, 1): 3, (0, 1): 4, (-1, 1): 5, (-1, 0): 6, (-1, -1): 7,
    (0, 0): HAT_MIDDLE,
}  # fmt: skip
_FIRST_MODIFIER: Final = KEY_USAGES["ctrl"]
_ROLL_OVER: Final = 0x01  # in every place: more keys are down than a report has room for


@dataclass(frozen=True, slots=True)
class Report:
    """One input report, without its id."""

    id: int
    data: bytes


def keyboard(keys: Sequence[str]) -> Report:
    """Return the keyboard's report of held keys, in the order in which they were pressed."""
    usages = [KEY_USAGES[name] for name in dict.fromkeys(keys)]
    modifiers = sum(1 << usage - _FIRST_MODIFIER for usage in usages if usage >= _FIRST_MODIFIER)
    plain = [usage for usage in usages if usage < _FIRST_MODIFIER]
    if len(plain) > KEYS:
        plain = [_ROLL_OVER] * KEYS
    return Report(KEYBOARD, bytes([modifiers, 0, *plain]).ljust(2 + KEYS, b"\0"))


def gamepad(names: Collection[str]) -> Report:
    """Return the gamepad's report of held buttons and directions of hat and stick.

    Opposite directions cancel each other.
    """
    buttons = sum(1 << number - 1 for name, number in BUTTON_NUMBERS.items() if name in names)
    hat = _HAT_VALUES[_way(_HAT, names)]
    stick = bytes(STICK * side & 0xFF for side in _way(_STICK, names))
    return Report(GAMEPAD, buttons.to_bytes(2, "little") + bytes([hat]) + stick)


def _way(ways: dict[str, tuple[int, int]], names: Collection[str]) -> tuple[int, int]:
    """Return the sum of the directions that are down, x to the right and y down."""
    down = [way for name, way in ways.items() if name in names]
    return sum(x for x, _ in down), sum(y for _, y in down)


RELEASED: Final = (keyboard(()), gamepad(()))


class HeldReports:
    """Held keys and pad buttons as reports; none at the beginning."""

    def __init__(self) -> None:
        self._down: list[str] = []
        self._latest = RELEASED

    def follow(self, strokes: Iterable[Stroke]) -> list[Report]:
        """Return the reports of strokes: keys that go down, or up, together share a report."""
        reports = []
        for down, group in groupby(strokes, lambda stroke: stroke.down):
            keys = [stroke.key for stroke in group]
            self._down = [key for key in self._down if key not in keys] + (keys if down else [])
            pad = {key.removeprefix("pad_") for key in self._down if key.startswith("pad_")}
            typed = [key for key in self._down if not key.startswith("pad_")]
            latest = (keyboard(typed), gamepad(pad))
            reports += [report for report in latest if report not in self._latest]
            self._latest = latest
        return reports

    def release(self) -> tuple[Report, ...]:
        """Release all keys; return the reports of that, also if nothing was held."""
        self._down, self._latest = [], RELEASED
        return RELEASED
