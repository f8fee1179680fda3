"""The paced loop: frames at their times, requests in between, without blocking on the link.

A `Device` does the work of one frame. `Loop` has the clock: an absolute schedule, or, for a virtual
orb in granted time, exactly the granted time.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

from controller.links.base import Link, LogLimit
from controller.runtime.device import Device
from controller.shared.protocol.messages import (
    Bye,
    Contacts,
    Grant,
    Granted,
    Hello,
    Message,
    Perform,
)

ORPHAN_S: Final = 10.0  # time for which a virtual orb outlives the host that started it
GRANT_LIMIT_MS: Final = 60_000  # limit of one grant; hosts grant 100 ms at a time
_IDLE_S: Final = 0.25  # longest wait between two checks of signals
_RATE_FRAMES: Final = 20  # the measured rate is the mean over these

_log = logging.getLogger("controller")


class Handler(ABC):
    """Handler of some of a host's requests, on the loop's thread; no method waits."""

    @abstractmethod
    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        """Return what answers a request at once, or None if it is for another handler."""

    def poll(self, device: Device) -> Sequence[Message]:
        """Return new messages, oldest first."""
        return ()


class Loop:
    """Runs devices, one after the other, for the host on the link."""

    def __init__(
        self,
        link: Link,
        open_device: Callable[[], Device],
        clock: Callable[[], float],
        *,
        await_host: bool = False,
        orphan_s: float | None = None,
        handlers: Sequence[Handler] = (),
    ) -> None:
        """Prepare to run.

        Args:
            link: Source of requests; idle time is spent in its `wait`.
            open_device: Returns a device before its first frame; its time starts at 0.
            clock: Seconds that never go back, such as `time.monotonic`.
            await_host: Begin when a host connects, instead of now.
            orphan_s: End after this time without a host; None: never.
            handlers: Handlers of requests; each request is offered to one after the other.
        """
        self.missed = 0  # frames skipped because they were late
        self.device: Device | None = None
        self._link = link
        self._open = open_device
        self._clock = clock
        self._await_host = await_host
        self._orphan_s = orphan_s
        self._handlers = tuple(handlers)
        self._log_limit = LogLimit()
        self._granted = False
        self._origin_s = 0.0  # the clock when the device's time was 0
        self._ends: deque[float] = deque(maxlen=_RATE_FRAMES)  # the clock after the latest frames

    def run(self, stopped: Callable[[], bool]) -> None:
        """Run until `stopped`, the schedule's end, or orphaned; the last device is closed.

        SensorError if the sensor fails, RecordingError if a recording cannot be written.
        """
        seen_s = self._clock()
        try:
            if not self._await_host:
                self._begin(granted=False)
            while not stopped():
                for message in self._link.poll():
                    self._take(message, stopped)
                if self._link.connected:
                    seen_s = self._clock()
                elif self._orphan_s is not None and self._clock() - seen_s > self._orphan_s:
                    _log.info("no host for %g s, so this orb ends", self._orphan_s)
                    break
                if self.device is not None:
                    for handler in self._handlers:
                        self._send_all(handler.poll(self.device))
                if self.device is None or (self._granted and self.device.due is not None):
                    self._link.wait(_IDLE_S)
                elif not self._turn(self.device):
                    break
        finally:
            self._end()

    def _send_all(self, messages: Sequence[Message]) -> None:
        now_s = 0.0 if self.device is None else self.device.now_s
        for message in messages:
            self._link.send(message, round(now_s * 1000))

    def _begin(self, *, granted: bool) -> None:
        """Begin with a fresh device whose time is 0."""
        self._end()
        self.device = device = self._open()
        device.log_limit = self._log_limit
        self._granted = granted
        if granted:
            device.untimed()
        first = device.due[1] if device.due else 0.0
        self._origin_s = self._clock() - (0.0 if device.live else first)
        self._ends.clear()

    def _end(self) -> None:
        device, self.device = self.device, None
        if device is not None:
            device.close()

    def _take(self, message: Message, stopped: Callable[[], bool]) -> None:
        """Take a request of the host."""
        if isinstance(message, Hello):
            if message.granted or self._granted or self.device is None:
                self._begin(granted=message.granted)
            else:
                self.device.greet(self._elapsed_s())
        elif self.device is None:
            return
        elif isinstance(message, Bye):
            if not self._granted:  # granted time has stopped; that of the next host begins at 0
                self.device.lift(self._elapsed_s())
        elif isinstance(message, Grant):
            if self._granted:
                self._advance_to(self.device, message.until_ms, stopped)
        elif isinstance(message, Contacts | Perform):
            device = self.device
            device.request(message, device.now_s if self._granted else self._elapsed_s())
        else:
            answers = (handler.take(message, self.device) for handler in self._handlers)
            self._send_all(next((each for each in answers if each is not None), ()))

    def _advance_to(self, device: Device, until_ms: int, stopped: Callable[[], bool]) -> None:
        """Advance exactly to the granted time, and acknowledge it after all its messages."""
        until_ms = min(until_ms, round(device.now_s * 1000) + GRANT_LIMIT_MS)
        while device.due and round(device.due[1] * 1000) <= until_ms and not stopped():
            if not self._link.connected:
                return  # a host that is gone may have left thousands of grants
            device.advance(device.sensor.rate_hz)
        device.now_s = max(device.now_s, until_ms / 1000)
        now_ms = round(device.now_s * 1000)
        self._link.send(Granted(now_ms), now_ms)

    def _turn(self, device: Device) -> bool:
        """Wait for the frame that is due, or scan it; return False when the schedule has ended.

        Times are multiples of the period from one origin, so a late frame delays no other.
        """
        if device.due is None:
            return False
        late_s = self._elapsed_s() - device.due[1]
        if late_s < 0.0:
            self._link.wait(min(-late_s, _IDLE_S))
            return True
        while device.live and late_s >= 1.0 / device.sensor.rate_hz:
            device.skip()
            self.missed += 1
            late_s = self._elapsed_s() - device.due[1]
        device.advance(self._rate_hz(device), max(late_s, 0.0))
        if device.latency is not None and device.due is not None:
            now_s = self._elapsed_s()
            device.latency.idle(now_s, device.due[1] - now_s, self.missed)
        return True

    def _elapsed_s(self) -> float:
        return self._clock() - self._origin_s

    def _rate_hz(self, device: Device) -> float:
        """Return the mean rate of the latest frames, this one included."""
        self._ends.append(self._clock())
        span_s = self._ends[-1] - self._ends[0]
        return (len(self._ends) - 1) / span_s if span_s > 0.0 else device.sensor.rate_hz


def hurry(device: Device, stopped: Callable[[], bool]) -> None:
    """Run a device through its schedule as fast as possible, until `stopped`, and close it.

    Errors are those of `Loop.run`.
    """
    try:
        while device.due is not None and not stopped():
            device.advance(device.sensor.rate_hz)
    finally:
        device.close()
