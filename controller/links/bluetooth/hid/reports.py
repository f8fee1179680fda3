"""HID reports of a keyboard and a gamepad as bytes, and the report map that describes them.

Items of the map are encoded as in "Device Class Definition for Human Interface Devices (HID)",
version 1.11, section 6.2.2; usages are those of the "HID Usage Tables", version 1.5.
"""

import hashlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from controller.shared.keymap import key_names
from controller.shared.keymap.keymap import Outputs
from controller.shared.protocol.messages import ContactState

KEYBOARD: Final = 1  # report ids
GAMEPAD: Final = 2
KEYS: Final = 6  # that a keyboard's report has room for, modifiers apart
LAST_KEY: Final = 0xE7  # the highest usage of a key: right Meta
BUTTONS: Final = 16
STICK: Final = 127  # a stick's end; its middle is 0
TRIGGER: Final = 255  # pressed fully
FULL_MM: Final = 12.0  # depth of a contact that presses the trigger fully
HAT_MIDDLE: Final = 8  # outside of 0..7: the null state, no direction

# Tag and type of each item: section 6.2.2.4 to 6.2.2.8. The two lowest bits hold the size.
_PREFIX: Final = {
    "input": 0x80, "output": 0x90, "collection": 0xA0, "end_collection": 0xC0,
    "usage_page": 0x04, "logical_minimum": 0x14, "logical_maximum": 0x24,
    "physical_minimum": 0x34, "physical_maximum": 0x44, "unit": 0x64,
    "report_size": 0x74, "report_id": 0x84, "report_count": 0x94,
    "usage": 0x08, "usage_minimum": 0x18, "usage_maximum": 0x28,
}  # fmt: skip
_SIGNED: Final = ("logical_minimum", "logical_maximum", "physical_minimum", "physical_maximum")

_CONSTANT, _VARIABLE, _ARRAY, _NULLABLE = 0x01, 0x02, 0x00, 0x42  # of input and output items
_APPLICATION: Final = 1  # kind of collection
_DESKTOP, _SIMULATION, _KEYS_PAGE, _LEDS, _BUTTON_PAGE = 0x01, 0x02, 0x07, 0x08, 0x09  # usage pages
_DEGREES: Final = 0x14  # unit: English rotation

_Items = tuple[tuple[str, int | None], ...]
_KEYBOARD_ITEMS: Final[_Items] = (
    # A keyboard whose report is, but for its id, the boot protocol's (HID 1.11, appendix B.1).
    ("usage_page", _DESKTOP), ("usage", 0x06), ("collection", _APPLICATION),
    ("report_id", KEYBOARD),
    ("usage_page", _KEYS_PAGE), ("usage_minimum", 0xE0), ("usage_maximum", LAST_KEY),
    ("logical_minimum", 0), ("logical_maximum", 1),
    ("report_size", 1), ("report_count", 8), ("input", _VARIABLE),  # modifiers
    ("report_size", 8), ("report_count", 1), ("input", _CONSTANT),
    ("usage_page", _LEDS), ("usage_minimum", 1), ("usage_maximum", 5),
    ("report_size", 1), ("report_count", 5), ("output", _VARIABLE),  # Num Lock ... Kana
    ("report_size", 3), ("report_count", 1), ("output", _CONSTANT),
    ("usage_page", _KEYS_PAGE), ("usage_minimum", 0), ("usage_maximum", LAST_KEY),
    ("logical_minimum", 0), ("logical_maximum", LAST_KEY),
    ("report_size", 8), ("report_count", KEYS), ("input", _ARRAY),
    ("end_collection", None),
)  # fmt: skip
_GAMEPAD_ITEMS: Final[_Items] = (
    # A gamepad: buttons, a hat, and a stick for the games that look for nothing else; then the
    # contact as right stick and right trigger, where Android expects them.
    ("usage_page", _DESKTOP), ("usage", 0x05), ("collection", _APPLICATION),
    ("report_id", GAMEPAD),
    ("usage_page", _BUTTON_PAGE), ("usage_minimum", 1), ("usage_maximum", BUTTONS),
    ("logical_minimum", 0), ("logical_maximum", 1),
    ("report_size", 1), ("report_count", BUTTONS), ("input", _VARIABLE),
    ("usage_page", _DESKTOP), ("usage", 0x39),
    ("logical_minimum", 0), ("logical_maximum", 7),
    ("physical_minimum", 0), ("physical_maximum", 315), ("unit", _DEGREES),
    ("report_size", 4), ("report_count", 1), ("input", _NULLABLE),
    ("physical_minimum", 0), ("physical_maximum", 0), ("unit", 0),
    ("report_size", 4), ("report_count", 1), ("input", _CONSTANT),
    ("usage", 0x30), ("usage", 0x31), ("usage", 0x32), ("usage", 0x35),
    ("logical_minimum", -STICK), ("logical_maximum", STICK),
    ("report_size", 8), ("report_count", 4), ("input", _VARIABLE),
    ("usage_page", _SIMULATION), ("usage", 0xC4),
    ("logical_minimum", 0), ("logical_maximum", TRIGGER),
    ("report_size", 8), ("report_count", 1), ("input", _VARIABLE),
    ("end_collection", None),
)  # fmt: skip


def _item(name: str, value: int | None) -> bytes:
    """Return one short item: section 6.2.2.2."""
    if value is None:
        return bytes([_PREFIX[name]])
    signed = name in _SIGNED
    for code, size in ((1, 1), (2, 2), (3, 4)):
        try:
            data = value.to_bytes(size, "little", signed=signed)
        except OverflowError:
            continue
        return bytes([_PREFIX[name] | code]) + data
    raise ValueError(f"{name} {value} does not fit in an item")


REPORT_MAP: Final = b"".join(_item(*item) for item in _KEYBOARD_ITEMS + _GAMEPAD_ITEMS)
SINGLE_MAPS: Final = {  # of devices with one report each, without its id
    number: b"".join(_item(*item) for item in items if item[0] != "report_id")
    for number, items in ((KEYBOARD, _KEYBOARD_ITEMS), (GAMEPAD, _GAMEPAD_ITEMS))
}

# PnP ID of the Device Information Service; the same numbers go into SDP.
VENDOR_SOURCE: Final = 2  # the vendor's number was given by the USB Implementers Forum
VENDOR: Final = 0x1209  # pid.codes, for open hardware
PRODUCT: Final = 0x0001  # pid.codes' number for tests; an orb that is sold needs one of its own
# Hosts remember a report map by these numbers, so another map has to have another version.
PRODUCT_VERSION: Final = int.from_bytes(hashlib.sha256(REPORT_MAP).digest()[:2], "big")
PNP_ID: Final = (
    bytes([VENDOR_SOURCE])
    + VENDOR.to_bytes(2, "little")
    + PRODUCT.to_bytes(2, "little")
    + PRODUCT_VERSION.to_bytes(2, "little")
)

KEY_USAGES: Final = {name: key.usage for name, key in key_names.KEYS.items() if key.usage}
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
    docs="orbtouch docs hid",
)

# Steps of 45 degrees clockwise from up; (0, 0) is nowhere.
_HAT_VALUES: Final = {
    (0, -1): 0, (1, -1): 1, (1, 0): 2, (1, 1): 3, (0, 1): 4, (-1, 1): 5, (-1, 0): 6, (-1, -1): 7,
    (0, 0): HAT_MIDDLE,
}  # fmt: skip
NO_CONTACT: Final = bytes(3)
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


def axes(contact: ContactState, grid: tuple[int, int]) -> bytes:
    """Return the axes of a contact on a grid of (rows, columns): across, towards the player, depth.

    The outermost taxels are the ends, `FULL_MM` the trigger's; without fingers all rest.
    """
    if not contact.fingers:
        return NO_CONTACT
    rows, columns = (max(count - 1, 1) for count in grid)
    sides = 2 * contact.x / columns - 1, 1 - 2 * contact.y / rows
    place = bytes(round(STICK * min(max(side, -1), 1)) & 0xFF for side in sides)
    return place + bytes([round(TRIGGER * min(max(contact.depth_mm / FULL_MM, 0), 1))])


def supersedes(newer: Report, older: Report) -> bool:
    """Return whether two reports are the gamepad's, and differ in the contact at most."""
    size = len(NO_CONTACT)
    return newer.id == older.id == GAMEPAD and newer.data[:-size] == older.data[:-size]


def gamepad(names: Collection[str], contact: bytes = NO_CONTACT) -> Report:
    """Return the gamepad's report of held buttons, directions of hat and stick, and a contact.

    Opposite directions cancel each other. `contact` is by `axes`.
    """
    buttons = sum(1 << number - 1 for name, number in BUTTON_NUMBERS.items() if name in names)
    hat = _HAT_VALUES[_way(_HAT, names)]
    stick = bytes(STICK * side & 0xFF for side in _way(_STICK, names))
    return Report(GAMEPAD, buttons.to_bytes(2, "little") + bytes([hat]) + stick + contact)


def _way(ways: dict[str, tuple[int, int]], names: Collection[str]) -> tuple[int, int]:
    """Return the sum of the directions that are down, x to the right and y down."""
    down = [way for name, way in ways.items() if name in names]
    return sum(x for x, _ in down), sum(y for _, y in down)


RELEASED: Final = (keyboard(()), gamepad(()))
