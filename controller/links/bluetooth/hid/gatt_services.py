"""GATT services of the HID device: HID, battery and device information.

By the specifications HIDS 1.0, BAS 1.0 and DIS 1.1, in tables. Every value needs an encrypted link,
so a host that is not paired reads nothing. Pure: the transport reads and writes `ServiceValues`,
and sends the values that it returns.
"""

from dataclasses import dataclass
from typing import Final

from controller.links.bluetooth.hid.report_map import GAMEPAD, KEYBOARD, PNP_ID, REPORT_MAP
from controller.links.bluetooth.hid.reports import RELEASED, Report

HID: Final = 0x1812  # 16-bit UUIDs, "Assigned Numbers", sections 3.4 and 3.8
BATTERY: Final = 0x180F
DEVICE_INFORMATION: Final = 0x180A
APPEARANCE: Final = 0x03C4  # gamepad
BOOT, REPORTS = 0, 1  # protocol modes
INPUT, OUTPUT = 1, 2  # kinds of reports

_READ: Final = ("encrypt-read",)
_HEAR: Final = ("encrypt-read", "notify", "encrypt-notify")
_TELL: Final = ("encrypt-read", "encrypt-write", "write-without-response")
_REPORT_REFERENCE: Final = 0x2908
# HID 1.11, no country; can wake its host, and connects when it is not bonded to another.
_HID_INFORMATION: Final = bytes([0x11, 0x01, 0, 0b01])


@dataclass(frozen=True, slots=True)
class Characteristic:
    """A value that hosts can reach.

    Attributes:
        name: Ours; unique.
        uuid: 16 bits.
        flags: What may be done with it, in BlueZ's words (doc/org.bluez.GattCharacteristic).
        descriptors: UUID and value of each, which never change.
    """

    name: str
    uuid: int
    flags: tuple[str, ...]
    descriptors: tuple[tuple[int, bytes], ...] = ()


def _report(name: str, number: int, kind: int, flags: tuple[str, ...]) -> Characteristic:
    return Characteristic(name, 0x2A4D, flags, ((_REPORT_REFERENCE, bytes([number, kind])),))


SERVICES: Final[dict[int, tuple[Characteristic, ...]]] = {
    HID: (
        Characteristic("protocol_mode", 0x2A4E, ("encrypt-read", "write-without-response")),
        Characteristic("report_map", 0x2A4B, _READ),
        _report("keyboard", KEYBOARD, INPUT, _HEAR),
        _report("gamepad", GAMEPAD, INPUT, _HEAR),
        _report("lights", KEYBOARD, OUTPUT, _TELL),
        Characteristic("boot_keyboard", 0x2A22, _HEAR),
        Characteristic("boot_lights", 0x2A32, _TELL),
        Characteristic("hid_information", 0x2A4A, _READ),
        Characteristic("control_point", 0x2A4C, ("write-without-response",)),
    ),
    BATTERY: (Characteristic("battery", 0x2A19, _HEAR),),
    DEVICE_INFORMATION: (
        Characteristic("manufacturer", 0x2A29, _READ),
        Characteristic("pnp_id", 0x2A50, _READ),
    ),
}

_INPUTS: Final = {KEYBOARD: "keyboard", GAMEPAD: "gamepad"}
# What may be written, and the values that it may have.
_WRITABLE: Final = {
    "protocol_mode": (BOOT, REPORTS),
    "lights": range(0x20),
    "boot_lights": range(0x20),
    "control_point": (0, 1),  # suspend, and go on
}


class OfferError(ValueError):
    """A request of a host that is refused; `name` is BlueZ's name of the error."""

    def __init__(self, name: str, message: str) -> None:
        super().__init__(message)
        self.name = name


class ServiceValues:
    """The values behind `SERVICES`."""

    def __init__(self, name: str, battery: int) -> None:
        """Begin with everything up.

        Args:
            name: Of the manufacturer.
            battery: Percent.
        """
        self._values = {
            "report_map": REPORT_MAP,
            "lights": b"\0",
            "boot_lights": b"\0",
            "hid_information": _HID_INFORMATION,
            "control_point": b"\1",
            "battery": bytes([battery]),
            "manufacturer": name.encode(),
            "pnp_id": PNP_ID,
        }
        self.forget()

    @property
    def mode(self) -> int:
        """`BOOT` or `REPORTS`: the protocol that the host has chosen."""
        return self._values["protocol_mode"][0]

    def read(self, name: str, offset: int = 0) -> bytes:
        """Return a value, from an offset on.

        Raises:
            OfferError: There is nothing at the offset.
        """
        value = self._values[name]
        if offset > len(value):
            raise OfferError("org.bluez.Error.InvalidOffset", f"{name} has {len(value)} bytes")
        return value[offset:]

    def write(self, name: str, value: bytes, offset: int = 0) -> None:
        """Take what a host writes.

        Raises:
            OfferError: The value has another length, or no meaning.
        """
        known = _WRITABLE.get(name)
        if known is None:
            raise OfferError("org.bluez.Error.NotPermitted", f"{name} cannot be written")
        if offset or len(value) != 1:
            raise OfferError("org.bluez.Error.InvalidValueLength", f"{name} has one byte")
        if value[0] not in known:
            raise OfferError("org.bluez.Error.Failed", f"{name} cannot be {value[0]}")
        self._values[name] = bytes(value)

    def report(self, report: Report) -> list[tuple[str, bytes]]:
        """Take a new report; return what has to be sent: names and values."""
        name = _INPUTS[report.id]
        self._values[name] = report.data
        if name == "keyboard":
            self._values["boot_keyboard"] = report.data
        if self.mode == BOOT:
            return [("boot_keyboard", report.data)] if name == "keyboard" else []
        return [(name, report.data)]

    def charge(self, percent: int) -> list[tuple[str, bytes]]:
        """Take the battery's level; return what has to be sent."""
        value = bytes([min(max(percent, 0), 100)])
        if value == self._values["battery"]:
            return []
        self._values["battery"] = value
        return [("battery", value)]

    def forget(self) -> None:
        """Reset the protocol and release everything: a host has come or gone (HIDS, 2.1)."""
        self._values["protocol_mode"] = bytes([REPORTS])
        for report in RELEASED:
            self.report(report)
