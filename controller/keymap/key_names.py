"""Names of keys and pad buttons in mappings, and their codes on each system.

A key is a position on a US keyboard; the character it types depends on the user's layout.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Final

EXTENDED: Final = 0xE000  # scan codes that the keyboard sends after a byte E0


@dataclass(frozen=True, slots=True)
class Key:
    """Codes of one key."""

    evdev: int  # Linux: linux/input-event-codes.h, KEY_ or BTN_
    keysym: int  # X11: X11/keysymdef.h
    mac: int  # macOS: a virtual key code of Carbon's Events.h; -1: none
    scan: int  # Windows: scan code of set 1, plus `EXTENDED` after a byte E0


@dataclass(frozen=True, slots=True)
class Axis:
    """One direction of a hat or stick of a pad: which axis, and which end of it."""

    code: int  # ABS_
    value: int


def _plain(codes: str, first: int, macs: Iterable[int]) -> dict[str, Key]:
    """Return the keys of a keyboard row by the characters that they type."""
    return {
        _CHARACTERS.get(char, char): Key(code, ord(char), mac, code)
        for code, (char, mac) in enumerate(zip(codes, macs, strict=True), first)
    }


_CHARACTERS: Final = {
    "-": "minus", "=": "equal", "[": "leftbracket", "]": "rightbracket", "\\": "backslash",
    ";": "semicolon", "'": "apostrophe", "`": "grave", ",": "comma", ".": "period", "/": "slash",
    " ": "space", "\n": "enter", "\t": "tab",
}  # fmt: skip
_SHIFTED: Final = dict(zip('_+{}|:"~<>?!@#$%^&*()', "-=[]\\;'`,./1234567890", strict=True))
_FUNCTION_MACS: Final = (0x7A, 0x78, 0x63, 0x76, 0x60, 0x61, 0x62, 0x64, 0x65, 0x6D, 0x67, 0x6F)

# Below 89, evdev's codes are the scan codes of set 1.
KEYS: Final[dict[str, Key]] = {
    **_plain("1234567890-=", 2, (18, 19, 20, 21, 23, 22, 26, 28, 25, 29, 27, 24)),
    **_plain("qwertyuiop[]", 16, (12, 13, 14, 15, 17, 16, 32, 34, 31, 35, 33, 30)),
    **_plain("asdfghjkl;'`", 30, (0, 1, 2, 3, 5, 4, 38, 40, 37, 41, 39, 50)),
    **_plain("\\zxcvbnm,./", 43, (42, 6, 7, 8, 9, 11, 45, 46, 43, 47, 44)),
    "escape": Key(1, 0xFF1B, 0x35, 1),
    "backspace": Key(14, 0xFF08, 0x33, 14),
    "tab": Key(15, 0xFF09, 0x30, 15),
    "enter": Key(28, 0xFF0D, 0x24, 28),
    "ctrl": Key(29, 0xFFE3, 0x3B, 29),
    "shift": Key(42, 0xFFE1, 0x38, 42),
    "rshift": Key(54, 0xFFE2, 0x3C, 54),
    "alt": Key(56, 0xFFE9, 0x3A, 56),
    "space": Key(57, 0x20, 0x31, 57),
    **{
        f"f{n}": Key(code, 0xFFBD + n, _FUNCTION_MACS[n - 1], code)
        for n, code in enumerate((*range(59, 69), 87, 88), 1)
    },
    "rctrl": Key(97, 0xFFE4, 0x3E, EXTENDED + 0x1D),
    "altgr": Key(100, 0xFFEA, 0x3D, EXTENDED + 0x38),
    "home": Key(102, 0xFF50, 0x73, EXTENDED + 0x47),
    "up": Key(103, 0xFF52, 0x7E, EXTENDED + 0x48),
    "pageup": Key(104, 0xFF55, 0x74, EXTENDED + 0x49),
    "left": Key(105, 0xFF51, 0x7B, EXTENDED + 0x4B),
    "right": Key(106, 0xFF53, 0x7C, EXTENDED + 0x4D),
    "end": Key(107, 0xFF57, 0x77, EXTENDED + 0x4F),
    "down": Key(108, 0xFF54, 0x7D, EXTENDED + 0x50),
    "pagedown": Key(109, 0xFF56, 0x79, EXTENDED + 0x51),
    "insert": Key(110, 0xFF63, -1, EXTENDED + 0x52),
    "delete": Key(111, 0xFFFF, 0x75, EXTENDED + 0x53),
    "mute": Key(113, 0x1008FF12, 0x4A, EXTENDED + 0x20),
    "volumedown": Key(114, 0x1008FF11, 0x49, EXTENDED + 0x2E),
    "volumeup": Key(115, 0x1008FF13, 0x48, EXTENDED + 0x30),
    "meta": Key(125, 0xFFEB, 0x37, EXTENDED + 0x5B),
    "next": Key(163, 0x1008FF17, -1, EXTENDED + 0x19),
    "play": Key(164, 0x1008FF14, -1, EXTENDED + 0x22),
    "previous": Key(165, 0x1008FF16, -1, EXTENDED + 0x10),
}
ALIASES: Final = {
    "esc": "escape", "return": "enter", "control": "ctrl", "del": "delete", "option": "alt",
    "super": "meta", "win": "meta", "cmd": "meta", "pgup": "pageup", "pgdn": "pagedown",
}  # fmt: skip

STICK: Final = 32767  # a stick's end; its middle is 0
# Buttons are BTN_ codes, as Linux names those of a pad; the others are axes.
PAD: Final[dict[str, int | Axis]] = {
    "pad_a": 0x130, "pad_b": 0x131, "pad_x": 0x133, "pad_y": 0x134, "pad_lb": 0x136,
    "pad_rb": 0x137, "pad_lt": 0x138, "pad_rt": 0x139, "pad_select": 0x13A, "pad_start": 0x13B,
    "pad_guide": 0x13C, "pad_l3": 0x13D, "pad_r3": 0x13E,
    "pad_left": Axis(0x10, -1), "pad_right": Axis(0x10, 1),
    "pad_up": Axis(0x11, -1), "pad_down": Axis(0x11, 1),
    "pad_stick_left": Axis(0, -STICK), "pad_stick_right": Axis(0, STICK),
    "pad_stick_up": Axis(1, -STICK), "pad_stick_down": Axis(1, STICK),
    "pad_look_left": Axis(3, -STICK), "pad_look_right": Axis(3, STICK),
    "pad_look_up": Axis(4, -STICK), "pad_look_down": Axis(4, STICK),
}  # fmt: skip

# Chords that end programs and sessions, or reach past the program that has the focus.
DANGEROUS: Final = (
    frozenset({"meta"}),
    frozenset({"alt", "f4"}),
    *(frozenset({"ctrl", "alt", f"f{n}"}) for n in range(1, 13)),
    frozenset({"ctrl", "alt", "delete"}),
    frozenset({"ctrl", "alt", "backspace"}),
)
_SIDES: Final = {"rctrl": "ctrl", "rshift": "shift", "altgr": "alt"}

Chord = tuple[str, ...]  # keys in the order of their presses; the last one is the main key


def danger(keys: Collection[str], allowed: Collection[Chord]) -> str:
    """Return the dangerous chord among keys held together, "" if there is none.

    A chord in `allowed` is permitted if no other key is held with it.
    """
    down = {_SIDES.get(key, key) for key in keys}
    for chord in DANGEROUS:
        if chord <= down and not any(
            chord <= {_SIDES.get(key, key) for key in one} >= down for one in allowed
        ):
            return "+".join(sorted(chord, key=_rank))
    return ""


def typed(char: str) -> Chord | None:
    """Return the chord that types a character on a US keyboard, None without one."""
    plain = _SHIFTED.get(char, char.lower() if char.isascii() else "")
    name = _CHARACTERS.get(plain, plain)
    if name not in KEYS:
        return None
    return ("shift", name) if plain != char else (name,)


def _rank(key: str) -> tuple[int, str]:
    order = ("ctrl", "alt", "meta")
    return (order.index(key) if key in order else len(order), key)
