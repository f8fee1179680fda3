"""GATT services of the HID device: HID, battery and device information.

Tables by the specifications HIDS 1.0, BAS 1.0 and DIS 1.1. Every value requires an encrypted link,
so only paired hosts can read it. Pure: the transport reads and writes `ServiceValues`, and sends
the values that it returns.
"""

from dataclasses import dataclass
from typing import Final

from dbus_fast import DBusError

from controller.links.bluetooth.hid.reports import (
    GAMEPAD,
    KEYBOARD,
    PNP_ID,
    RELEASED,
    REPORT_MAP,
    Report,
)

HID: Final = 0x1812  # 16-bit UUIDs, "Assigned Numbers", sections 3.4 and 3.8
BATTERY: Final = 0x180F
DEVICE_INFORMATION: Final = 0x180A
APPEARANCE: Final = 0x03C4  # gamepad
BOOT, REPORTS = 0, 1  # protocol modes
INPUT, OUTPUT = 1, 2  # kinds of reports

_READ: Final = ("encrypt-read",)
_NOTIFY: Final = ("encrypt-read", "notify", "encrypt-notify")
_WRITE: Final = ("encrypt-read", "encrypt-write", "write-without-response")
_REPORT_REFERENCE: Final = 0x2908
# HID 1.11, no country; remote wake, not normally connectable.
_HID_INFORMATION: Final = bytes([0x11, 0x01, 0, 0b01])


@dataclass(frozen=True, slots=True)
class Characteristic:
    """A GATT characteristic."""

    name: str  # unique within this program
    uuid: int  # 16 bits
    flags: tuple[str, ...]  # permissions of BlueZ (doc/org.bluez.GattCharacteristic)
    descriptors: tuple[tuple[int, bytes], ...] = ()  # UUID and constant value of each


def _report(name: str, number: int, kind: int, flags: tuple[str, ...]) -> Characteristic:
    return Characteristic(name, 0x2A4D, flags, ((_REPORT_REFERENCE, bytes([number, kind])),))


SERVICES: Final[dict[int, tuple[Characteristic, ...]]] = {
    HID: (
        Characteristic("protocol_mode", 0x2A4E, ("encrypt-read", "write-without-response")),
        Characteristic("report_map", 0x2A4B, _READ),
        _report("keyboard", KEYBOARD, INPUT, _NOTIFY),
        _report("gamepad", GAMEPAD, INPUT, _NOTIFY),
        _report("lights", KEYBOARD, OUTPUT, _WRITE),
        Characteristic("boot_keyboard", 0x2A22, _NOTIFY),
        Characteristic("boot_lights", 0x2A32, _WRITE),
        Characteristic("hid_information", 0x2A4A, _READ),
        Characteristic("control_point", 0x2A4C, ("write-without-response",)),
    ),
    BATTERY: (Characteristic("battery", 0x2A19, _NOTIFY),),
    DEVICE_INFORMATION: (
        Characteristic("manufacturer", 0x2A29, _READ),
        Characteristic("pnp_id", 0x2A50, _READ),
    ),
}

_INPUTS: Final = {KEYBOARD: "keyboard", GAMEPAD: "gamepad"}
# Writable characteristics and their allowed values.
_WRITABLE: Final = {
    "protocol_mode": (BOOT, REPORTS),
    "lights": range(0x20),
    "boot_lights": range(0x20),
    "control_point": (0, 1),  # suspend, exit suspend
}


class ServiceValues:
    """The values behind `SERVICES`."""

    def __init__(self, name: str) -> None:
        """Begin with released keys and the manufacturer's name."""
        self._values = {
            "report_map": REPORT_MAP,
            "lights": b"\0",
            "boot_lights": b"\0",
            "hid_information": _HID_INFORMATION,
            "control_point": b"\1",
            "battery": bytes([100]),  # percent; the profile wants the service
            "manufacturer": name.encode(),
            "pnp_id": PNP_ID,
        }
        self.reset()

    @property
    def mode(self) -> int:
        """`BOOT` or `REPORTS`: the protocol that the host has chosen."""
        return self._values["protocol_mode"][0]

    def read(self, name: str, offset: int = 0) -> bytes:
        """Return a value from an offset on; DBusError beyond its end."""
        value = self._values[name]
        if offset > len(value):
            raise DBusError("org.bluez.Error.InvalidOffset", f"{name} has {len(value)} bytes")
        return value[offset:]

    def write(self, name: str, value: bytes, offset: int = 0) -> None:
        """Store a value that a host writes; DBusError if it is not allowed."""
        known = _WRITABLE.get(name)
        if known is None:
            raise DBusError("org.bluez.Error.NotPermitted", f"{name} cannot be written")
        if offset or len(value) != 1:
            raise DBusError("org.bluez.Error.InvalidValueLength", f"{name} has one byte")
        if value[0] not in known:
            raise DBusError("org.bluez.Error.Failed", f"{name} cannot be {value[0]}")
        self._values[name] = bytes(value)

    def report(self, report: Report) -> list[tuple[str, bytes]]:
        """Store a new report; return the names and values to send."""
        name = _INPUTS[report.id]
        self._values[name] = report.data
        if name == "keyboard":
            self._values["boot_keyboard"] = report.data
        if self.mode == BOOT:
            return [("boot_keyboard", report.data)] if name == "keyboard" else []
        return [(name, report.data)]

    def reset(self) -> None:
        """Reset the protocol and release all keys, for a change of hosts (HIDS, 2.1)."""
        self._values["protocol_mode"] = bytes([REPORTS])
        for report in RELEASED:
            self.report(report)
