"""The device: one session of sensing, frame by frame, whoever owns the clock."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterator
from itertools import count
from typing import TYPE_CHECKING, Final, Protocol

from controller.log_limit import LogLimit
from controller.protocol.messages import (
    Command,
    Contacts,
    Health,
    Message,
    Perform,
    PositionUncertainty,
    State,
    Telemetry,
    UserIdentified,
    quantise_image,
)
from controller.recognition.pipeline import Pipeline, Step
from controller.recognition.preprocess import Frame, Image
from controller.recordings.recording import UNKNOWN
from controller.runtime.long_press import LongPress
from controller.sensors.base import Sensor, SensorAwayError, SensorError

if TYPE_CHECKING:
    from controller.capture.cues import Cue
    from controller.capture.session_recorder import SessionRecorder
    from controller.runtime.latency_report import LatencyReporter

RECENT_S: Final = 4.0  # of images are kept: what a correction may be about
_TOO_SHORT: Final = "nothing was recorded: there was less than a second to keep"

_log = logging.getLogger("controller")

Schedule = Iterator[tuple[int, float]]  # (number, seconds) of each frame
Wish = tuple[float, Perform]  # seconds, and what the virtual orb's own hand shall do then


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


class Device:
    """One session of sensing: a sensor and a pipeline from their first frame on.

    Attributes:
        due: The frame that comes next, (number, seconds); None: the schedule has ended.
        now_s: The latest time that the sensor has seen.
        recent: The latest images, for whoever says what they were.
        hush: Limits what is logged of a peer's requests; the loop's devices share one.
    """

    def __init__(
        self,
        sensor: Sensor,
        pipeline: Pipeline,
        link: Outlet,
        schedule: Schedule,
        *,
        live: bool = True,
        tape: SessionRecorder | None = None,
        script: Iterator[Wish] | None = None,
        obey: Callable[[Cue, float], Wish | None] | None = None,
        on_long_press: Callable[[], None] | None = None,
        timekeeper: LatencyReporter | None = None,
    ) -> None:
        """Begin before the first frame.

        Args:
            sensor: Where frames come from.
            pipeline: What they become.
            link: Where messages go.
            schedule: When the frames are due.
            live: Frames that are late are skipped, as their time is over; a recording's are not.
            tape: Where the session is kept, if it is.
            script: What the virtual orb's own hand does unasked, in order.
            obey: Says what it does for a cue that begins at a time, if it heeds cues.
            on_long_press: Called when the orb's own button was held for long.
            timekeeper: Who is told where the time goes.
        """
        self.sensor, self.pipeline, self.link, self.schedule = sensor, pipeline, link, schedule
        self.live, self.tape, self.timekeeper = live, tape, timekeeper
        self.script = iter(()) if script is None else script
        self.obey, self.on_long_press = obey, on_long_press
        if timekeeper is not None:
            pipeline.mark = timekeeper.mark
        self._virtual = sensor if sensor.virtual else None
        self.due = next(schedule, None)
        self.now_s = 0.0
        self.hush = LogLimit()
        self._next = next(self.script, None)
        self._wish: Wish | None = None  # a cue's that is not due yet
        self._pressed: tuple[str, ...] = ()
        self._button = LongPress()
        self._told: tuple[str, ...] = ()  # of the sensor's health
        self._who: UserIdentified | None = None  # whom the host knows of
        self._away_s: float | None = None  # since when the sensor gives no frames
        self.recent: deque[Image] = deque(maxlen=max(3, round(RECENT_S * sensor.rate_hz)))

    def greet(self, t_s: float) -> None:
        """A host came: to it, nothing is held until the next gesture."""
        self._pressed = self._told = ()
        self._who = None
        self.lift(t_s)

    def lift(self, t_s: float) -> None:
        """Take the host's fingers off the orb: they never outlast their host."""
        self.request(Contacts(()), t_s)

    def request(self, message: Contacts | Perform, t_s: float) -> None:
        """Hand a wish of the host to the virtual sensor, effective at `t_s` (never in the past)."""
        self.now_s = max(self.now_s, t_s)
        if self._virtual is None:
            return
        if isinstance(message, Contacts):
            self._virtual.touch(message.contacts, self.now_s)
            return
        try:
            at = (message.x, message.y)
            self._virtual.perform(message.number, message.label, *at, self.now_s)
        except SensorError as error:
            if self.hush.lets(str(error)):
                _log.warning("performance %d ignored: %s", message.number, error)

    def advance(self, rate_hz: float, late_s: float = 0.0) -> Step | None:
        """Scan the frame that is due, and send what it gave; None: the sensor is away.

        Args:
            rate_hz: The rate as measured, for the telemetry.
            late_s: How long ago it was due.

        Raises:
            SensorError: The sensor gives no frame any more.
        """
        assert self.due is not None
        number, t_s = self.due
        self.due = next(self.schedule, None)
        self._play(t_s)
        self.now_s = t_s
        if self.tape is not None:
            self.tape.start_next_if_full()
        if self.timekeeper is not None:
            self.timekeeper.start(late_s)
        try:
            frame = self.sensor.read(t_s)
        except SensorAwayError as error:
            self._wait(t_s, str(error))
            return None
        except SensorError as error:
            if self.tape is not None:
                self.tape.mark(t_s, "lost", str(error))
            raise
        if self._away_s is not None:
            _log.info("the sensor is back after %.1f s", t_s - self._away_s)
            self._away_s = None
        if self.on_long_press and self._button.step(self.sensor.button(t_s), t_s):
            self.on_long_press()
        if self.timekeeper is not None:
            self.timekeeper.mark()
        step = self.pipeline.step(frame, t_s, number)
        if step.ready:
            self.recent.append(step.image)
        if self.tape is not None:
            self._keep(self.tape, frame, step)
        self._send(step, rate_hz)
        if self.timekeeper is not None:
            self.timekeeper.mark()
            self.timekeeper.finish(number)
        self._tell(self.pipeline.look(), round(t_s * 1000))  # nobody waits for that
        return step

    def note(self, kind: str, text: str) -> None:
        """Note in the recording what happens now, where there is one."""
        if self.tape is not None:
            self.tape.mark(self.now_s, kind, text)

    def untimed(self) -> None:
        """Stop asking where the time goes: it is granted, and nobody's own."""
        if self.timekeeper is not None:
            self.timekeeper.close()
            self.timekeeper = None

    def skip(self) -> None:
        """Let the frame that is due pass unread."""
        self.due = next(self.schedule, None)

    def close(self) -> None:
        """Seal the recording and release the sensor.

        Raises:
            RecordingError: The recording cannot be written where it should be.
        """
        self.untimed()
        try:
            self.sensor.close()
        finally:
            if self.tape is not None and not self.tape.close() and self.hush.lets(_TOO_SHORT):
                _log.info("%s", _TOO_SHORT)

    def _wait(self, t_s: float, why: str) -> None:
        """Pass a frame over that the sensor does not give: nothing is held meanwhile."""
        if self._away_s is None:
            self._away_s = t_s
            _log.warning("%s; waiting for it", why)
            if self.tape is not None:
                self.tape.mark(t_s, "lost", why)
            self._press((), round(t_s * 1000))

    def _play(self, t_s: float) -> None:
        """Let the virtual orb's own hand begin what it shall do by `t_s`."""
        while self._next is not None and self._next[0] <= t_s:
            self.request(self._next[1], self._next[0])
            self._next = next(self.script, None)
        if self._wish is not None and self._wish[0] <= t_s:
            (at_s, wish), self._wish = self._wish, None
            self.request(wish, at_s)

    def _keep(self, tape: SessionRecorder, frame: Frame, step: Step) -> None:
        """Keep a frame, and do what the cues ask for."""
        label = self._label(step.t_s, tape.labels)
        said = tape.record(frame, step, label, self.sensor.button(step.t_s))
        if self.obey is not None and said.asked is not None and said.fresh:
            self._wish = self.obey(said.asked, step.t_s)
        if tape.done:
            self.due = None

    def _label(self, t_s: float, labels: tuple[str, ...]) -> int:
        """Return the index of what truly happens, as far as the sensor knows."""
        if self._virtual is None:
            return UNKNOWN
        label = self._virtual.label(t_s)
        return labels.index(label) if label in labels else UNKNOWN

    def _send(self, step: Step, rate_hz: float) -> None:
        """Send what a frame gave: the command first, since somebody waits for it.

        How sure its place is comes before, for whoever wants to know when the command comes.
        """
        t_ms = round(step.t_s * 1000)
        if step.sigma is not None:
            self.link.send(PositionUncertainty(step.frame, step.sigma), t_ms)
        if step.command is not None:
            c = step.command
            command = Command(c.command, c.gesture, c.probability, c.touch, c.frame)
            self.link.send(command, t_ms)
            self._press((c.command,), t_ms)
        elif not step.held:
            self._press((), t_ms)
        self.link.send(telemetry(step, rate_hz), t_ms)
        self._name(step, t_ms)
        if self._virtual is not None:
            for truth in self._virtual.truths():
                self.link.send(truth, t_ms)

    def _tell(self, found: tuple[str, ...], t_ms: int) -> None:
        """Report the sensor's health, when that changes."""
        if found != self._told:
            for line in found:
                if line not in self._told:
                    _log.warning("sensor: %s", line)
            self._told = found
            self.link.send(Health(found), t_ms)

    def _name(self, step: Step, t_ms: int) -> None:
        """Report who touches, when that changes; nobody knows where nobody is known."""
        who = UserIdentified(step.user, round(step.confidence, 2))
        if who != self._who and (step.confidence or self._who is not None):
            if self._who is None or who.user != self._who.user:
                _log.info("%s", f"{who.user} touches" if who.user else "nobody it knows touches")
            self._who = who
            self.link.send(who, t_ms)

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
