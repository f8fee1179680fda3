"""Classic HID: the service record, and the messages of the two channels; pure.

Source: "Human Interface Device Profile", version 1.1.
"""

from importlib.resources import files
from typing import Final

from controller.links.bluetooth.hid.reports import KEYBOARD, RELEASED, REPORT_MAP, Report

UUID: Final = "00001124-0000-1000-8000-00805f9b34fb"
CONTROL, INTERRUPT = 0x11, 0x13  # L2CAP's port numbers
BOOT, REPORTS = 0, 1  # protocols
_INPUT, _OUTPUT = 1, 2  # kinds of reports
_GAMEPAD_CLASS: Final = 0x08  # minor device class: a peripheral that is a gamepad

# Kinds of messages, the upper half of their first byte: section 3.1.
_HANDSHAKE, _CONTROL, _GET_REPORT, _SET_REPORT = 0x0, 0x1, 0x4, 0x5
_GET_PROTOCOL, _SET_PROTOCOL, _DATA = 0x6, 0x7, 0xA
# Results of a handshake, its lower half.
_OK, _NO_SUCH_REPORT, _UNSUPPORTED, _BAD_PARAMETER = 0x0, 0x2, 0x3, 0x4
_UNPLUG: Final = 0x5  # an operation of control
_HAS_SIZE: Final = 0x08  # of GET_REPORT: how many bytes the host has room for

_SERVICE_RECORD: Final = (files(__package__) / "service_record.xml").read_text("utf-8")


class HidChannels:
    """Protocol state of the channels to one host.

    Attributes:
        protocol: `BOOT` or `REPORTS`.
        unplugged: Whether the host has sent VIRTUAL_CABLE_UNPLUG.
    """

    def __init__(self) -> None:
        """Begin with released keys: section 7.4.9."""
        self.protocol = REPORTS
        self.unplugged = False
        self._latest = {report.id: report for report in RELEASED}

    def report(self, report: Report) -> bytes | None:
        """Return the message for the interrupt channel; None: not part of the boot protocol."""
        self._latest[report.id] = report
        if self.protocol == BOOT and report.id != KEYBOARD:
            return None
        return bytes([_DATA << 4 | _INPUT, report.id]) + report.data

    def control(self, message: bytes) -> bytes | None:
        """Return the answer to a message on the control channel; None: there is none."""
        if not message:
            return None
        kind, parameter, rest = message[0] >> 4, message[0] & 0x0F, message[1:]
        if kind == _CONTROL:  # suspend needs no action: a key press wakes the host
            self.unplugged = self.unplugged or parameter == _UNPLUG
        elif kind == _GET_REPORT:
            return self._get_report(parameter, rest)
        elif kind == _SET_REPORT:
            return _handshake(self._set_report(parameter, rest))
        elif kind == _GET_PROTOCOL:
            return bytes([_DATA << 4, self.protocol])
        elif kind == _SET_PROTOCOL:
            if parameter not in (BOOT, REPORTS):
                return _handshake(_BAD_PARAMETER)
            self.protocol = parameter
            return _handshake(_OK)
        elif kind not in (_HANDSHAKE, _DATA):  # an answer, or the rest of a refused message
            return _handshake(_UNSUPPORTED)
        return None

    def _get_report(self, parameter: int, rest: bytes) -> bytes:
        """Return the newest report, or an error."""
        if parameter & 0x03 != _INPUT:
            return _handshake(_UNSUPPORTED)
        report = self._latest.get(rest[0]) if rest else None
        if report is None:
            return _handshake(_NO_SUCH_REPORT)
        size = len(report.data) + 1
        if parameter & _HAS_SIZE:
            if len(rest) != 3:
                return _handshake(_BAD_PARAMETER)
            size = int.from_bytes(rest[1:], "little")
        return bytes([_DATA << 4 | _INPUT]) + (bytes([report.id]) + report.data)[:size]

    def _set_report(self, parameter: int, rest: bytes) -> int:
        """Check an output report, which is ignored: the keyboard's lights do not exist."""
        if parameter & 0x03 != _OUTPUT:
            return _UNSUPPORTED
        if not rest or rest[0] != KEYBOARD:
            return _NO_SUCH_REPORT
        return _OK if len(rest) == 2 else _BAD_PARAMETER


def _handshake(result: int) -> bytes:
    return bytes([_HANDSHAKE << 4 | result])


def record(name: str) -> str:
    """Return the service record of a device name in BlueZ's XML: section 5.3 of the profile."""
    return _SERVICE_RECORD.format(
        name=name,
        control=CONTROL,
        interrupt=INTERRUPT,
        kind=_GAMEPAD_CLASS,
        map=REPORT_MAP.hex(),
    )
