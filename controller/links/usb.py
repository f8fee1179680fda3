"""Link as a USB gamepad and keyboard, for hosts that Bluetooth does not reach.

usb:               on the first USB device controller
usb:fe980000.usb   on another one: a name in /sys/class/udc
usb:?keys=keyboard keys in place of the pad; or the path of a mapping: docs/hid.md
"""

from __future__ import annotations

import errno
import logging
import threading
import time
from collections.abc import Callable
from typing import Final

from controller.links.base import KeyLink
from controller.links.bluetooth.hid import held_keys
from controller.links.bluetooth.hid.held_keys import HeldKeys
from controller.links.bluetooth.hid.reports import RELEASED, Report
from controller.links.usb_gadget import Gadget
from controller.shared.errors import reason
from controller.shared.keymap.keymap import KeyMap
from controller.shared.protocol.messages import Command, Message, State, Telemetry, Welcome
from controller.shared.request_queue import RequestQueue

IDLE_S: Final = 0.1  # greatest delay until a host that comes or goes is noticed
RETRY_S: Final = 0.002  # between attempts to write; hosts read every 1 to 10 ms
PATIENCE_S: Final = 0.5  # for a host that reads no reports
_NO_HOST: Final = (errno.ESHUTDOWN, errno.ENODEV)

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: object) -> UsbLink:
    """Create the gadget; LinkError or KeyMapError if that is not possible."""
    udc, keys = held_keys.parse(url, "usb:, then a name in /sys/class/udc if there are several")
    return UsbLink(keys, Gadget(welcome.name, udc), welcome.rate_hz)


class UsbReports:
    """Held keys and the reports that wait to be written; pure, with explicit time.

    Attributes:
        ready: Whether a host reads reports; it was sent the release of all keys first.
    """

    def __init__(
        self, key_map: KeyMap, write: Callable[[Report], None], rate_hz: float = 40.0
    ) -> None:
        """Begin without a host; `write` raises BlockingIOError while one does not read.

        The device has `rate_hz` frames a second.
        """
        self.ready = False
        self._keys = HeldKeys(key_map, rate_hz)
        self._queue: list[Report] = []
        self._blocked_s: dict[int, float] = {}  # since when, by report id
        self._write = write

    def take(self, message: Message, now_s: float) -> None:
        """Press or release keys by a message of the device; without a host, do nothing."""
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
        self._queue += self._keys.reports()
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

    def __init__(self, keys: KeyMap, gadget: Gadget, rate_hz: float = 40.0) -> None:
        """Use a gadget until `close`, in a thread."""
        super().__init__()
        self._messages: RequestQueue[Message] = RequestQueue()
        self._closed = threading.Event()
        self._gadget = gadget
        self._reports = UsbReports(keys, gadget.write, rate_hz)
        self._thread = threading.Thread(target=self._run, name="usb", daemon=True)
        self._thread.start()

    def send(self, message: Message, t_ms: int) -> None:
        """Press the keys of a command, for as long as the State messages report it as held."""
        if not self.connected:
            self.dropped += 1
        elif isinstance(message, Command | State | Telemetry):
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
