"""Time for a session with no host: real, or as fast as a virtual orb can be simulated."""

import time
from collections.abc import Callable
from typing import Final

from controller.links.base import Link
from controller.protocol.messages import Message

_TICK_S: Final = 1e-9  # waiting is never quite exact, and always goes on


class OfflineLink(Link):
    """A link without a host, and the clock of its `wait`."""

    connected = False
    dropped = 0

    def __init__(
        self,
        speed: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Begin.

        Args:
            speed: How many times as fast as real time; 0: only waiting moves the clock.
            clock: Real seconds.
            sleep: Waits for so many real seconds.
        """
        self._speed, self._clock, self._sleep = speed, clock, sleep
        self._now_s = 0.0
        self._start_s = clock()

    def now_s(self) -> float:
        """Return the session's time, seconds."""
        return (self._clock() - self._start_s) * self._speed if self._speed else self._now_s

    def send(self, message: Message, t_ms: int) -> None:
        """Drop the message."""

    def close(self) -> None:
        """Nothing is open."""

    def wait(self, timeout_s: float) -> None:
        """Let so much of the session's time pass."""
        if self._speed:
            self._sleep(timeout_s / self._speed)
        else:
            self._now_s += timeout_s + _TICK_S
