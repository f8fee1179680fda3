"""The loop: frames at their times, requests in between, and never a wait for the link.

`Device` says what happens at one frame. `Loop` says when: on an absolute schedule by the clock,
or, for a virtual orb whose host asked for it, exactly as far as time is granted.
"""

import logging
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import count
from typing import Final, Protocol

from controller.pipeline import Pipeline, Step
from controller.protocol import (
    Bye,
    Command,
    Contacts,
    Grant,
    Granted,
    Hello,
    Message,
    Perform,
    State,
    Telemetry,
    quantise_image,
)
from controller.recordings.recorder import Recorder
from controller.recordings.recording import UNKNOWN
from controller.sensors import Sensor, SensorError, VirtualSensor

ORPHAN_S: Final = 10.0  # a virtual orb that belongs to a host outlives it by this much
GRANT_LIMIT_MS: Final = 60_000  # the farthest that one grant reaches: a host asks for 100 ms
_IDLE_S: Final = 0.25  # longest wait without looking at signals
_RATE_FRAMES: Final = 20  # the measured rate is the mean over so many

_log = logging.getLogger("controller")

Schedule = Iterator[tuple[int, float]]  # (number, seconds) of each frame


class Outlet(Protocol):
    """The side of a link that the loop needs; `controller.links.Link` has it."""

    def send(self, message: Message, t_ms: int) -> None:
        """Take a message for the host, without waiting."""

    def poll(self) -> list[Message]:
        """Return the host's requests, oldest first, without waiting."""

    def wait(self, timeout_s: float) -> None:
        """Return when something may be polled, or after the time."""

    @property
    def connected(self) -> bool:
        """Whether somebody is there."""


def steady(rate_hz: float) -> Iterator[tuple[int, float]]:
    """Yield the schedule of a sensor: frame k ends at k / rate."""
    for number in count(1):
        yield number, number / rate_hz


@dataclass
class Device:
    """One session of sensing: a sensor and a pipeline from their first frame on.

    Attributes:
        sensor: Where frames come from.
        pipeline: What they become.
        link: Where messages go.
        schedule: When the frames are due.
        live: Frames that are late are skipped, as their time is over; a recording's are not.
        recorder: Where the session is kept, if it is.
        script: (seconds, what the virtual orb's own hand shall do unasked).
    """

    sensor: Sensor
    pipeline: Pipeline
    link: Outlet
    schedule: Schedule
    live: bool = True
    recorder: Recorder | None = None
    script: Iterator[tuple[float, Perform]] = field(default_factory=lambda: iter(()))

    def __post_init__(self) -> None:
        """Begin before the first frame."""
        self.due = next(self.schedule, None)
        self.now_s = 0.0  # the latest time that the sensor has seen
        self._next = next(self.script, None)
        self._pressed: tuple[str, ...] = ()

    def greet(self, t_s: float) -> None:
        """A host came: to it, nothing is held until the next gesture."""
        self._pressed = ()
        self.lift(t_s)

    def lift(self, t_s: float) -> None:
        """Take the host's fingers off the orb: they never outlast their host."""
        self.request(Contacts(()), t_s)

    def request(self, message: Contacts | Perform, t_s: float) -> None:
        """Hand a wish of the host to the virtual sensor, effective at `t_s` (never in the past)."""
        self.now_s = max(self.now_s, t_s)
        if not isinstance(self.sensor, VirtualSensor):
            return
        if isinstance(message, Contacts):
            self.sensor.touch(message.contacts, self.now_s)
            return
        try:
            at = (message.x, message.y)
            self.sensor.perform(message.number, message.label, *at, self.now_s)
        except SensorError as error:
            _log.warning("performance %d ignored: %s", message.number, error)

    def advance(self, rate_hz: float) -> Step:
        """Scan the frame that is due, and send what it gave.

        Args:
            rate_hz: The rate as measured, for the telemetry.

        Raises:
            SensorError: The sensor gives no frame.
        """
        assert self.due is not None
        number, t_s = self.due
        self.due = next(self.schedule, None)
        while self._next is not None and self._next[0] <= t_s:
            self.request(self._next[1], self._next[0])
            self._next = next(self.script, None)
        self.now_s = t_s
        frame = self.sensor.read(t_s)
        step = self.pipeline.step(frame, t_s, number)
        if self.recorder is not None:
            label, touch = self._label(t_s), step.touch
            self.recorder.add(frame, t_s, number, label=label, touch=touch, command=step.command)
        self._send(step, rate_hz)
        return step

    def skip(self) -> None:
        """Let the frame that is due pass unread."""
        self.due = next(self.schedule, None)

    def close(self) -> None:
        """Seal the recording and release the sensor.

        Raises:
            RecordingError: The recording cannot be written where it should be.
        """
        self.sensor.close()
        if self.recorder is not None and (path := self.recorder.close()):
            _log.info("recorded into %s", path)

    def _label(self, t_s: float) -> int:
        """Return the index of what truly happens, as far as the sensor knows."""
        if not isinstance(self.sensor, VirtualSensor):
            return UNKNOWN
        label = self.sensor.label(t_s)
        return self.pipeline.labels.index(label) if label in self.pipeline.labels else UNKNOWN

    def _send(self, step: Step, rate_hz: float) -> None:
        """Send what a frame gave: the command first, since somebody waits for it."""
        t_ms = round(step.t_s * 1000)
        if step.command is not None:
            c = step.command
            command = Command(c.command, c.gesture, c.probability, c.touch, c.frame)
            self.link.send(command, t_ms)
            self._press((c.command,), t_ms)
        elif not step.held:
            self._press((), t_ms)
        self.link.send(telemetry(step, rate_hz), t_ms)
        if isinstance(self.sensor, VirtualSensor):
            for truth in self.sensor.truths():
                self.link.send(truth, t_ms)

    def _press(self, pressed: tuple[str, ...], t_ms: int) -> None:
        """Report what is held, when that changes."""
        if pressed != self._pressed:
            self._pressed = pressed
            self.link.send(State(pressed), t_ms)


def telemetry(step: Step, rate_hz: float) -> Telemetry:
    """Return what the panel is told of a frame."""
    image = quantise_image(step.image.ravel().tolist())
    probabilities = tuple(step.probabilities.tolist())
    return Telemetry(step.frame, image, probabilities, step.touch, step.held, step.ready, rate_hz)


class Loop:
    """Runs devices, one after the other, for whoever is on the link."""

    def __init__(
        self,
        link: Outlet,
        open_device: Callable[[], Device],
        clock: Callable[[], float],
        *,
        await_host: bool = False,
        orphan_s: float | None = None,
    ) -> None:
        """Prepare to run.

        Args:
            link: Where requests come from, and what is waited on.
            open_device: Makes a device at its first frame; its time starts at 0.
            clock: Seconds that never go back, such as `time.monotonic`.
            await_host: Begin when a host says Hello, instead of now.
            orphan_s: End when no host was there for so long; None: never.
        """
        self.missed = 0  # frames whose time was over before they could be read
        self.device: Device | None = None
        self._link = link
        self._open = open_device
        self._clock = clock
        self._await_host = await_host
        self._orphan_s = orphan_s
        self._granted = False
        self._origin_s = 0.0  # the clock when the device's time was 0
        self._ends: deque[float] = deque(maxlen=_RATE_FRAMES)  # the clock after the latest frames

    def run(self, stopped: Callable[[], bool]) -> None:
        """Run until `stopped`, the schedule's end, or orphaned; the last device is closed.

        Raises:
            SensorError: The sensor fails.
            RecordingError: A recording cannot be written where it should be.
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
                    _log.info("the host has been gone for %g s, so this orb ends", self._orphan_s)
                    break
                if self.device is None or self._granted:
                    self._link.wait(_IDLE_S)
                elif not self._turn(self.device):
                    break
        finally:
            self._end()

    def _begin(self, *, granted: bool) -> None:
        """Start anew: a fresh device whose time is 0."""
        self._end()
        self.device = device = self._open()
        self._granted = granted
        first = device.due[1] if device.due else 0.0
        self._origin_s = self._clock() - (0.0 if device.live else first)
        self._ends.clear()

    def _end(self) -> None:
        device, self.device = self.device, None
        if device is not None:
            device.close()

    def _take(self, message: Message, stopped: Callable[[], bool]) -> None:
        """Do what the host asks."""
        if isinstance(message, Hello):
            if message.granted or self._granted or self.device is None:
                self._begin(granted=message.granted)
            else:
                self.device.greet(self._elapsed_s())
        elif self.device is None:
            return
        elif isinstance(message, Bye):
            if not self._granted:  # granted time has stopped, and the next host's begins anew
                self.device.lift(self._elapsed_s())
        elif isinstance(message, Grant):
            if self._granted:
                self._step_to(self.device, message.until_ms, stopped)
        elif isinstance(message, Contacts | Perform):
            device = self.device
            device.request(message, device.now_s if self._granted else self._elapsed_s())

    def _step_to(self, device: Device, until_ms: int, stopped: Callable[[], bool]) -> None:
        """Step exactly to the granted time, and say so after everything that it gave."""
        until_ms = min(until_ms, round(device.now_s * 1000) + GRANT_LIMIT_MS)
        while device.due and round(device.due[1] * 1000) <= until_ms and not stopped():
            device.advance(device.sensor.rate_hz)
        device.now_s = max(device.now_s, until_ms / 1000)
        now_ms = round(device.now_s * 1000)
        self._link.send(Granted(now_ms), now_ms)

    def _turn(self, device: Device) -> bool:
        """Wait for the frame that is due, or scan it; return False when the schedule has ended.

        Times are multiples of the period from one origin, so a late frame makes no other late.
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
        device.advance(self._rate_hz(device))
        return True

    def _elapsed_s(self) -> float:
        return self._clock() - self._origin_s

    def _rate_hz(self, device: Device) -> float:
        """Return the mean rate of the latest frames, this one included."""
        self._ends.append(self._clock())
        span_s = self._ends[-1] - self._ends[0]
        return (len(self._ends) - 1) / span_s if span_s > 0.0 else device.sensor.rate_hz
