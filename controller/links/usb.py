"""Link as a USB gamepad and keyboard, for hosts that Bluetooth does not reach.

usb:               on the first USB device controller
usb:fe980000.usb   on another one: a name in /sys/class/udc
usb:?keys=keyboard keys in place of the pad; or the path of a mapping: docs/hid.md
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import logging
import os
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from controller.links.base import KeyLink, LinkError
from controller.links.bluetooth.hid import held_keys, reports
from controller.links.bluetooth.hid.held_keys import HeldKeys
from controller.links.bluetooth.hid.reports import GAMEPAD, KEYBOARD, RELEASED, Report, supersedes
from controller.shared.errors import reason
from controller.shared.protocol.messages import Message, Welcome
from controller.shared.request_queue import RequestQueue

IDLE_S: Final = 0.1  # greatest delay until a host that comes or goes is noticed
RETRY_S: Final = 0.002  # between attempts to write; hosts read every 1 to 10 ms
PATIENCE_S: Final = 0.5  # for a host that reads no reports
_NO_HOST: Final = (errno.ESHUTDOWN, errno.ENODEV)

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: object) -> UsbLink:
    """Create the gadget; LinkError or KeyMapError if that is not possible."""
    form = "usb:, then a name in /sys/class/udc if there are several"
    udc, keys = held_keys.parse(url, form, welcome)
    return UsbLink(keys, Gadget(welcome.name, udc))


class UsbReports:
    """Reports of held keys that wait to be written; pure, with explicit time.

    Attributes:
        ready: Whether a host reads reports; it was sent the release of all keys first.
    """

    def __init__(self, keys: HeldKeys, write: Callable[[Report], None]) -> None:
        """Begin without a host; `write` raises BlockingIOError while one does not read."""
        self.ready = False
        self._keys = keys
        self._queue: list[Report] = []
        self._blocked_s: dict[int, float] = {}  # since when, by report id
        self._write = write

    def take(self, message: Message, now_s: float) -> None:
        """Change keys or axes by a message of the device; without a host, do nothing."""
        if self.ready:
            self._keys.take(message, now_s)

    def pause_s(self, now_s: float) -> float:
        """Return the seconds until the next `step`."""
        waits = [IDLE_S]
        if self._keys.due_s is not None:
            waits.append(self._keys.due_s - now_s)
        if any(now_s - since_s < PATIENCE_S for since_s in self._blocked_s.values()):
            waits.append(RETRY_S)
        return max(0.0, min(waits))

    def step(self, now_s: float, *, configured: bool) -> None:
        """Write reports; `configured`: whether a host has configured the device."""
        if not configured:
            self.reset()
            return
        if not self.ready and not self._queue:
            self._queue = list(RELEASED)
        self._keys.tick(now_s)
        for report in self._keys.reports():
            if self._queue and supersedes(report, self._queue[-1]):
                self._queue.pop()  # a contact never waits behind another
            self._queue.append(report)
        for note in self._keys.notes + ["USB has one host"] * len(self._keys.hosts):
            log.info("%s", note)
        self._keys.notes, self._keys.hosts = [], []
        try:
            self._flush(now_s)
        except OSError as error:
            if error.errno not in _NO_HOST:
                raise
            self.reset()

    def reset(self) -> None:
        """Forget held keys and reports: there is no host."""
        self._keys.reset()
        self._queue, self.ready = [], False
        self._blocked_s.clear()

    def _flush(self, now_s: float) -> None:
        """Write the queue. The host may read one interface only, so each has its own order."""
        left: list[Report] = []
        for report in self._queue:
            try:
                if any(report.id == other.id for other in left):
                    raise BlockingIOError
                self._write(report)
            except BlockingIOError:
                self._blocked_s.setdefault(report.id, now_s)
                left.append(report)
            else:
                self._blocked_s.pop(report.id, None)
                self.ready = True
        late = [id_ for id_, since_s in self._blocked_s.items() if now_s - since_s >= PATIENCE_S]
        self._queue = [report for report in left if report.id not in late]
        self._queue += [report for report in RELEASED if report.id in late]


class UsbLink(KeyLink):
    """Link to the one host at the USB port, connected while it reads reports."""

    def __init__(self, keys: HeldKeys, gadget: Gadget) -> None:
        """Use a gadget until `close`, in a thread."""
        super().__init__()
        self._messages: RequestQueue[Message] = RequestQueue()
        self._closed = threading.Event()
        self._gadget = gadget
        self._reports = UsbReports(keys, gadget.write)
        self._thread = threading.Thread(target=self._run, name="usb", daemon=True)
        self._thread.start()

    def send(self, message: Message, t_ms: int) -> None:
        """Press the keys of a command while States report it as held; move the axes by contacts."""
        if not self.connected:
            self.dropped += 1
        elif isinstance(message, held_keys.Taken):
            self._messages.put(message)

    def close(self) -> None:
        """Remove the device from the host, which releases all keys."""
        self._closed.set()
        self._thread.join()

    def _run(self) -> None:
        try:
            while not self._closed.is_set():
                self._messages.wait(self._reports.pause_s(time.monotonic()))
                self._step(time.monotonic())
        except OSError as error:
            self.problem = f"the USB gadget failed: {reason(error)}"
        finally:
            self._gadget.remove()

    def _step(self, now_s: float) -> None:
        ready = self._reports.ready
        for message in self._messages.take():
            self._reports.take(message, now_s)
        self._reports.step(now_s, configured=self._gadget.configured)
        if self._reports.ready != ready:
            log.info("the USB host %s", "has gone" if ready else "reads reports")
            self._change_host("" if ready else "usb")


# --- the gadget -----------------------------------------------------------------------------------

CONFIGFS: Final = "sys/kernel/config/usb_gadget"
UDCS: Final = "sys/class/udc"  # USB device controllers
FUNCTIONS: Final = {GAMEPAD: "functions/hid.pad", KEYBOARD: "functions/hid.keyboard"}
_CONFIG: Final = "configs/c.1"
_STRINGS: Final = "strings/0x409"  # US English
_FOLDERS: Final = (_STRINGS, *FUNCTIONS.values(), _CONFIG, f"{_CONFIG}/{_STRINGS}")
_HELP: Final = "(orbtouch docs hid, USB)"
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
