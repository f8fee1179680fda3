"""The HID report map: one for a keyboard and a gamepad.

Items are encoded as in "Device Class Definition for Human Interface Devices (HID)", version 1.11,
section 6.2.2; usages are those of the "HID Usage Tables", version 1.5.
"""

import hashlib
from typing import Final

KEYBOARD: Final = 1  # report ids
GAMEPAD: Final = 2
KEYS: Final = 6  # that a keyboard's report has room for, modifiers apart
LAST_KEY: Final = 0xE7  # the highest usage of a key: right Meta
BUTTONS: Final = 16
STICK: Final = 127  # a stick's end; its middle is 0
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
_DESKTOP, _KEYS_PAGE, _LEDS, _BUTTON_PAGE = 0x01, 0x07, 0x08, 0x09  # usage pages
_DEGREES: Final = 0x14  # unit: English rotation

_ITEMS: Final[tuple[tuple[str, int | None], ...]] = (
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
    # A gamepad: buttons, a hat, and a stick for the games that look for nothing else.
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
    ("usage", 0x30), ("usage", 0x31),
    ("logical_minimum", -STICK), ("logical_maximum", STICK),
    ("report_size", 8), ("report_count", 2), ("input", _VARIABLE),
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


REPORT_MAP: Final = b"".join(_item(name, value) for name, value in _ITEMS)

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
