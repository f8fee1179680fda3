"""Names of keys and pad buttons in mappings, and their codes on each system.

A key is a position on a US keyboard; the character it types depends on the user's layout.
"""

import tomllib
from collections.abc import Collection
from dataclasses import dataclass
from importlib.resources import files
from typing import Final

EXTENDED: Final = 0xE000  # scan codes that the keyboard sends after a byte E0


@dataclass(frozen=True, slots=True)
class Key:
    """Codes of one key."""

    evdev: int  # Linux: linux/input-event-codes.h, KEY_ or BTN_
    keysym: int  # X11: X11/keysymdef.h
    mac: int  # macOS: a virtual key code of Carbon's Events.h; -1: none
    scan: int  # Windows: scan code of set 1, plus `EXTENDED` after a byte E0
    usage: int  # USB and Bluetooth: HID Usage Tables, "Keyboard/Keypad"; 0: none


@dataclass(frozen=True, slots=True)
class Axis:
    """One direction of a hat or stick of a pad: which axis, and which end of it."""

    code: int  # ABS_
    value: int


_CODES: Final = tomllib.loads((files(__package__) / "keys.toml").read_text("utf-8"))
KEYS: Final[dict[str, Key]] = {name: Key(*codes) for name, codes in _CODES["keys"].items()}
ALIASES: Final[dict[str, str]] = _CODES["aliases"]
STICK: Final = 32767  # a stick's end; its middle is 0
PAD: Final[dict[str, int | Axis]] = {
    name: code if isinstance(code, int) else Axis(*code) for name, code in _CODES["pad"].items()
}

# Chords that end programs and sessions, or reach past the program that has the focus.
DANGEROUS: Final = (
    ("meta",),
    ("alt", "f4"),
    *(("ctrl", "alt", f"f{n}") for n in range(1, 13)),
    ("ctrl", "alt", "delete"),
    ("ctrl", "alt", "backspace"),
)
_SIDES: Final = {"rctrl": "ctrl", "rshift": "shift", "altgr": "alt"}

Chord = tuple[str, ...]  # keys in the order of their presses; the last one is the main key


def danger(keys: Collection[str], allowed: Collection[Chord]) -> str:
    """Return the dangerous chord among keys held together, "" if there is none.

    A chord in `allowed` is permitted if no other key is held with it.
    """
    down = {_SIDES.get(key, key) for key in keys}
    for chord in DANGEROUS:
        if down.issuperset(chord) and not any(
            set(chord) <= {_SIDES.get(key, key) for key in one} >= down for one in allowed
        ):
            return "+".join(chord)
    return ""
