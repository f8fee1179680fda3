"""USB gadget of a gamepad and a keyboard, in configfs of the Linux kernel.

Source: Linux, Documentation/usb/gadget_configfs.rst and gadget_hid.rst. Each of the two is an
interface of its own, without report ids: firmware reads a boot keyboard only, and adaptive
controllers read the first interface only, which is the pad.
"""

import contextlib
import errno
import fcntl
import os
import subprocess
from pathlib import Path
from typing import Final

from controller.links.base import LinkError
from controller.links.bluetooth.hid import reports
from controller.links.bluetooth.hid.reports import GAMEPAD, KEYBOARD, Report
from controller.shared.errors import reason

CONFIGFS: Final = "sys/kernel/config/usb_gadget"
UDCS: Final = "sys/class/udc"  # USB device controllers
FUNCTIONS: Final = {GAMEPAD: "functions/hid.pad", KEYBOARD: "functions/hid.keyboard"}
_CONFIG: Final = "configs/c.1"
_STRINGS: Final = "strings/0x409"  # US English
_FOLDERS: Final = (_STRINGS, *FUNCTIONS.values(), _CONFIG, f"{_CONFIG}/{_STRINGS}")
_HELP: Final = "(docs/hid.md, USB)"
_ADVICE: Final = {errno.EBUSY: "another gadget has this port; name another, as in usb:NAME"}
# Unbinds the gadget when this process ends, also by SIGKILL: the kernel itself would keep it, and
# the host would keep the last report. The pipe from this process then ends.
_GUARD: Final = 'trap "" HUP INT TERM; read _; echo > "$0"'


class Gadget:
    """The gadget, bound to a USB device controller until `remove`; needs root."""

    def __init__(self, name: str, udc: str = "", root: Path = Path("/")) -> None:
        """Create and bind the gadget, in place of a stale one; LinkError if that is not possible.

        `name` is the product's, as hosts show it; `udc` the device controller, "": the first;
        `root` the folder of sys and dev.
        """
        configfs, udcs = root / CONFIGFS, root / UDCS
        _check(configfs, udcs, udc)
        self._folder, self._dev = configfs / "orbtouch", root / "dev"
        self._udc = udc or min(path.name for path in udcs.iterdir())
        self._state = udcs / self._udc / "state"
        self._files: dict[int, int] = {}  # open /dev/hidgN, by report id
        self._guard: subprocess.Popen[bytes] | None = None
        self._lock = os.open(configfs, os.O_RDONLY | os.O_CLOEXEC)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._lock)
            raise LinkError("another controller has the USB gadget; end it first") from None
        try:
            self._clear()
            self._create(name)
            self._bind()
        except OSError as error:
            self.remove()
            advice = _ADVICE.get(error.errno or 0, f"the kernel needs usb_f_hid {_HELP}")
            path = error.filename or self._folder
            raise LinkError(f"cannot write {path}: {reason(error)}; {advice}") from None

    @property
    def configured(self) -> bool:
        """Whether a host has configured the gadget, and is not asleep."""
        return self._state.read_text().strip() == "configured"

    def write(self, report: Report) -> None:
        """Write a report; BlockingIOError if the one before was not read, OSError without host."""
        os.write(self._files[report.id], report.data)

    def remove(self) -> None:
        """Unbind the gadget, so that the host releases all keys, and remove it."""
        while self._files:
            os.close(self._files.popitem()[1])
        if self._guard is not None:
            self._guard.communicate()  # closes the pipe and waits
        self._clear()
        os.close(self._lock)

    def _create(self, name: str) -> None:
        for folder in ("", *_FOLDERS):
            self._make(self._folder / folder)
        values = {  # a version has four decimal digits
            "idVendor": f"{reports.VENDOR:#06x}",
            "idProduct": f"{reports.PRODUCT:#06x}",
            "bcdUSB": "0x0200",
            "bcdDevice": f"0x{reports.PRODUCT_VERSION % 10_000:04d}",
            f"{_STRINGS}/manufacturer": "OrbTouch",
            f"{_STRINGS}/product": name,
            f"{_CONFIG}/MaxPower": "500",
        }
        for path, value in values.items():
            self._set(path, value.encode())
        for report in reports.RELEASED:
            function = FUNCTIONS[report.id]
            boot = b"1" if report.id == KEYBOARD else b"0"
            self._set(f"{function}/subclass", boot)
            self._set(f"{function}/protocol", boot)
            self._set(f"{function}/no_out_endpoint", b"1")  # lights come by SET_REPORT; not read
            self._set(f"{function}/report_length", b"%d" % len(report.data))
            self._set(f"{function}/report_desc", reports.SINGLE_MAPS[report.id])
            (self._folder / _CONFIG / Path(function).name).symlink_to(self._folder / function)

    def _bind(self) -> None:
        udc = self._folder / "UDC"
        command = ["sh", "-c", _GUARD, str(udc)]
        none = subprocess.DEVNULL
        self._guard = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=none, stderr=none, start_new_session=True
        )
        self._set("UDC", self._udc.encode())
        for number, function in FUNCTIONS.items():
            minor = (self._folder / function / "dev").read_text().strip().partition(":")[2]
            self._files[number] = os.open(
                self._dev / f"hidg{minor}", os.O_WRONLY | os.O_NONBLOCK | os.O_CLOEXEC
            )

    def _clear(self) -> None:
        """Unbind and remove the gadget as far as it is there."""
        if not self._folder.is_dir():
            return
        with contextlib.suppress(OSError):  # it is not bound
            self._set("UDC", b"\n")
        with contextlib.suppress(OSError):  # not all of it is there; the next start says the rest
            for function in FUNCTIONS.values():
                (self._folder / _CONFIG / Path(function).name).unlink(missing_ok=True)
        for folder in (*reversed(_FOLDERS), ""):
            with contextlib.suppress(OSError):
                self._remove(self._folder / folder)

    def _set(self, path: str, value: bytes) -> None:
        """Write an attribute in one piece, as configfs needs it."""
        (self._folder / path).write_bytes(value)

    def _make(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)

    def _remove(self, folder: Path) -> None:
        folder.rmdir()  # attributes go with their folder


def _check(configfs: Path, udcs: Path, udc: str) -> None:
    """Raise LinkError if a part of the system is missing."""
    if not configfs.is_dir():
        raise LinkError(f"there is no {configfs}; sudo modprobe libcomposite {_HELP}")
    if not os.access(configfs, os.W_OK):
        raise LinkError(f"this user may not write to {configfs}; run the controller as root")
    found = sorted(path.name for path in udcs.glob("*"))
    if not found:
        raise LinkError(
            f"no USB port of this computer can be a device; enable one, or use --link hid: {_HELP}"
        )
    if udc and udc not in found:
        raise LinkError(f"there is no USB device controller {udc}; there is {', '.join(found)}")
