"""Messages to systemd: started, stopping, status line, and heartbeats of the watchdog."""

import contextlib
import os
import socket
import time
from collections.abc import Callable, Mapping
from typing import Final

BEATS: Final = 3  # heartbeats per watchdog interval; sd_notify(3) requires two


class WatchdogHeartbeat:
    """Sender of sd_notify(3) messages; the loop calls `beat`, so a hang ends the heartbeats.

    They are datagrams of NAME=VALUE to the socket NOTIFY_SOCKET. Without that variable nothing is
    sent.
    """

    def __init__(
        self,
        environment: Mapping[str, str] = os.environ,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Read the socket's address and the watchdog's interval, as systemd sets them."""
        self._clock = clock
        self._address = environment.get("NOTIFY_SOCKET", "")
        self._every_s = _interval_s(environment) / BEATS
        self._beaten_s = clock()
        self._status = ""

    def ready(self) -> None:
        """Send that the service has started."""
        self._send("READY=1")

    def stopping(self) -> None:
        """Send that the service is stopping."""
        self._send("STOPPING=1")

    def status(self, line: str) -> None:
        """Set the status line of `systemctl status`; it is sent when it changes."""
        if line != self._status:
            self._status = line
            self._send("STATUS=" + line.replace("\n", " "))

    def beat(self) -> None:
        """Send a heartbeat if it is due; call it often."""
        if self._every_s and self._clock() - self._beaten_s >= self._every_s:
            self._beaten_s = self._clock()
            self._send("WATCHDOG=1")

    def _send(self, text: str) -> None:
        if not self._address:
            return
        address = self._address
        if address.startswith("@"):  # abstract names begin with a zero byte
            address = "\0" + address[1:]
        # A run needs no supervisor.
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as port,
        ):
            port.setblocking(False)
            port.connect(address)
            port.send(text.encode())


def _interval_s(environment: Mapping[str, str]) -> float:
    """Return the watchdog interval, seconds; 0 if there is none for this process."""
    microseconds = environment.get("WATCHDOG_USEC", "")
    process = environment.get("WATCHDOG_PID", str(os.getpid()))
    if process != str(os.getpid()) or not microseconds.isdecimal():
        return 0.0
    return int(microseconds) / 1e6
