"""Tell systemd how we are: ready, alive, stopping, and a line for people (sd_notify(3)).

The protocol is a datagram of NAME=VALUE lines to the socket that systemd names in the environment.
Without that variable nobody listens, and nothing is said.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Mapping
from typing import Final

BEATS: Final = 3  # per watchdog interval; systemd asks for two at least


class WatchdogHeartbeat:
    """Beats for the watchdog for as long as the loop turns, and no longer."""

    def __init__(
        self,
        environment: Mapping[str, str] = os.environ,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Find out whether systemd listens, and how often it wants to hear us.

        Args:
            environment: NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID, as systemd sets them.
            clock: Seconds that never go back.
        """
        self._clock = clock
        self._address = environment.get("NOTIFY_SOCKET", "")
        self._every_s = _interval_s(environment) / BEATS
        self._beaten_s = clock()
        self._told = ""

    def ready(self) -> None:
        """Say that we work."""
        self._send("READY=1")

    def stopping(self) -> None:
        """Say that we end."""
        self._send("STOPPING=1")

    def tell(self, line: str) -> None:
        """Say how we are, for `systemctl status`; once, as long as it stays the same."""
        if line != self._told:
            self._told = line
            self._send("STATUS=" + line.replace("\n", " "))

    def beat(self) -> None:
        """Beat if it is time to; call it often."""
        if self._every_s and self._clock() - self._beaten_s >= self._every_s:
            self._beaten_s = self._clock()
            self._send("WATCHDOG=1")

    def _send(self, text: str) -> None:
        if not self._address:
            return
        import socket

        address = self._address
        if address.startswith("@"):  # the kernel's abstract names begin with a zero byte
            address = "\0" + address[1:]
        # A supervisor that does not listen is no reason to stop playing.
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as bell,
        ):
            bell.setblocking(False)
            bell.connect(address)
            bell.send(text.encode())


def _interval_s(environment: Mapping[str, str]) -> float:
    """Return how long systemd waits for a beat, seconds; 0 if it does not watch this process."""
    microseconds = environment.get("WATCHDOG_USEC", "")
    process = environment.get("WATCHDOG_PID", str(os.getpid()))
    if process != str(os.getpid()) or not microseconds.isdecimal():
        return 0.0
    return int(microseconds) / 1e6
