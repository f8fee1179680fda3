"""One sensing session, frame by frame; `controller.runtime.loop` has the clock."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterator
from itertools import count
from typing import TYPE_CHECKING, Final

from controller.links.base import Link, LogLimit
from controller.recognition.contact import ContactEstimate
from controller.recognition.images.frames import Frame, Image
from controller.recognition.pipeline import Pipeline, Step
from controller.recordings.recording import UNKNOWN
from controller.runtime.latency import LatencyReporter
from controller.sensors import calibration_store
from controller.sensors.base import Sensor
from controller.sensors.geometry import SensorAwayError, SensorError
from controller.shared.bluetooth.bluez import PAIRING_S
from controller.shared.protocol.codec import quantise_image
from controller.shared.protocol.messages import (
    Command,
    Contacts,
    ContactState,
    Health,
    Perform,
    PositionUncertainty,
    State,
    Telemetry,
    UserIdentified,
)
from controller.shared.touch_strength import scaled

if TYPE_CHECKING:
    from controller.capture.session_recorder import SessionRecorder
    from controller.shared.cues import Cue

HOLD_S: Final = 5.0  # of the button, longer than a press that labels: hosts may pair
RECENT_S: Final = 4.0  # of images are for corrections
KEPT_S: Final = 12.0  # of images are kept
_TOO_SHORT: Final = "nothing was recorded: there was less than a second to keep"

_log = logging.getLogger("controller")

Schedule = Iterator[tuple[int, float]]  # (number, seconds) of each frame
TimedPerform = tuple[float, Perform]  # seconds, and the gesture that begins then


class VirtualHand:
    """Gestures scheduled by time."""

    def __init__(
        self,
        script: Iterator[TimedPerform] | None = None,
        respond: Callable[[Cue, float], TimedPerform | None] | None = None,
    ) -> None:
        """Take a script in order of time, and what returns the gesture for a cue at a time."""
        self._script, self._respond = script or iter(()), respond
        self._next = next(self._script, None)
        self._cued: TimedPerform | None = None  # for a cue, and not due yet

    def take_cue(self, cue: Cue, t_s: float) -> None:
        """Take a new cue."""
        if self._respond is not None:
            self._cued = self._respond(cue, t_s)

    def due(self, t_s: float) -> Iterator[TimedPerform]:
        """Yield each gesture that begins by `t_s`, once."""
        while self._next is not None and self._next[0] <= t_s:
            yield self._next
            self._next = next(self._script, None)
        if self._cued is not None and self._cued[0] <= t_s:
            yield self._cued
            self._cued = None


class LongPress:
    """Detects once that a button has been down for HOLD_S."""

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._done = False

    def step(self, state: str | None, t_s: float) -> bool:
        """Return whether the button, of a state as `Sensor.button` has it, is down for so long."""
        if state is None or state == "null":
            self._since_s, self._done = None, False
            return False
        if self._since_s is None:
            self._since_s = t_s
        if self._done or t_s - self._since_s < HOLD_S:
            return False
        self._done = True
        return True


class Device:
    """One sensing session: a sensor and a pipeline from their first frame on.

    Attributes:
        live: Whether late frames are skipped; those of a recording are not.
        due: The next frame, (number, seconds); None: the schedule has ended.
        now_s: The latest time of the sensor.
        image_count: Number of images since the rest image was found first; the latest are kept.
        watch: Takes each frame as scanned, if there is one.
        log_limit: Limits log lines about a peer's requests; the loop's devices share one.
    """

    def __init__(
        self,
        sensor: Sensor,
        pipeline: Pipeline,
        link: Link,
        *,
        schedule: Schedule | None = None,
        recorder: SessionRecorder | None = None,
        hand: VirtualHand | None = None,
        latency: LatencyReporter | None = None,
    ) -> None:
        """Begin before the first frame; frame k is due at k / rate unless a recording says when."""
        self.sensor, self.pipeline, self.link = sensor, pipeline, link
        self.recorder, self.latency = recorder, latency
        self.live = schedule is None
        self._schedule = schedule or ((k, k / sensor.rate_hz) for k in count(1))
        self._hand = hand
        if latency is not None:
            pipeline.mark = latency.mark
        self._virtual = sensor if sensor.virtual else None
        self.due = next(self._schedule, None)
        self.now_s = 0.0
        self.log_limit = LogLimit()
        self._pairs = self.live and self._virtual is None and recorder is None
        self._button = LongPress()
        self._pressed: tuple[str, ...] = ()  # as last sent
        self._touched: int | None = None  # frame of the contact last sent; None: it has ended
        self._faults: tuple[str, ...] = ()  # of the sensor, as last sent
        self._user: UserIdentified | None = None  # as last sent
        self._learned = pipeline.learned  # scale, as kept
        self._away_s: float | None = None  # time since which the sensor gives no frames
        self.watch: Callable[[Frame], None] | None = None
        self.image_count = 0
        self._recent: deque[Image] = deque(maxlen=max(3, round(KEPT_S * sensor.rate_hz)))

    def greet(self, t_s: float) -> None:
        """Begin with another host: no command is held until the next gesture."""
        self._pressed = self._faults = ()
        self._user = self._touched = None
        self.lift(t_s)

    def lift(self, t_s: float) -> None:
        """Remove the host's fingers from the orb: they never outlast their host."""
        self.request(Contacts(()), t_s)

    def request(self, message: Contacts | Perform, t_s: float) -> None:
        """Apply a host's request to the virtual sensor at `t_s`, or now if that is past."""
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
            if self.log_limit.lets(str(error)):
                _log.warning("performance %d ignored: %s", message.number, error)

    def advance(self, rate_hz: float, late_s: float = 0.0) -> Step | None:
        """Scan the frame that is due, and send its results; None: the sensor is away.

        The rate as measured goes into the telemetry. SensorError if there will be no further frame.
        """
        assert self.due is not None
        number, t_s = self.due
        self.due = next(self._schedule, None)
        if self._hand is not None:
            for at_s, request in self._hand.due(t_s):
                self.request(request, at_s)
        self.now_s = t_s
        if self.recorder is not None:
            self.recorder.turn()
        if self.latency is not None:
            self.latency.start(late_s)
        frame = self._scan(t_s)
        if frame is None:
            return None
        if self.latency is not None:
            self.latency.mark()
        if self.watch is not None:
            self.watch(frame)
        step = self.pipeline.step(frame, t_s, number)
        if step.ready:
            self._recent.append(step.image)
            self.image_count += 1
        if self.recorder is not None:
            self._keep(self.recorder, frame, step)
        self._send(step, rate_hz)
        if self.latency is not None:
            self.latency.mark()
        faults = self.pipeline.check_health()  # after the messages, as it takes longer
        if faults != self._faults:
            self._report(faults, round(t_s * 1000))
        if self.pipeline.learned != self._learned:
            self._keep_scale()
        return step

    def images(self, first: int, end: int) -> list[Image]:
        """Return those of the images number `first` to `end` - 1 that are kept, from 0."""
        before = self.image_count - len(self._recent)
        return list(self._recent)[max(first - before, 0) : max(end - before, 0)]

    def recent(self) -> list[Image]:
        """Return the images of the latest RECENT_S as the network sees them, (rows, columns)."""
        end, strength = self.image_count, self.pipeline.strength
        latest = self.images(end - max(3, round(RECENT_S * self.sensor.rate_hz)), end)
        return [scaled(image, strength) for image in latest]

    def note(self, kind: str, text: str) -> None:
        """Mark an event in the recording, if there is one."""
        if self.recorder is not None:
            self.recorder.mark(self.now_s, kind, text)

    def untimed(self) -> None:
        """Stop measuring latency: the host grants time."""
        if self.latency is not None:
            self.latency = self.pipeline.mark = None

    def skip(self) -> None:
        """Skip the frame that is due."""
        self.due = next(self._schedule, None)

    def close(self) -> None:
        """Finish the recording, or raise RecordingError, and release the sensor."""
        self.untimed()
        try:
            self.sensor.close()
        finally:
            recorder = self.recorder
            if recorder is not None and not recorder.close() and self.log_limit.lets(_TOO_SHORT):
                _log.info("%s", _TOO_SHORT)

    def _scan(self, t_s: float) -> Frame | None:
        """Return the frame that ends at `t_s`; None while the sensor is away."""
        try:
            frame = self.sensor.read(t_s)
        except SensorAwayError as error:
            self._wait(t_s, str(error))
            return None
        except SensorError as error:
            self.note("lost", str(error))
            raise
        if self._away_s is not None:
            _log.info("the sensor is back after %.1f s", t_s - self._away_s)
            self._away_s = None
        if self._pairs and self._button.step(self.sensor.button(t_s), t_s):
            self.link.pair(PAIRING_S)
        return frame

    def _keep_scale(self) -> None:
        """Keep the scale that was learned from touches for the next start."""
        self._learned = self.pipeline.learned
        if self._learned and self.live:
            try:
                calibration_store.keep_scale(self.sensor.device_id, self._learned)
            except OSError as error:
                _log.warning("the scale of the sensor is not kept: %s", error)

    def _wait(self, t_s: float, why: str) -> None:
        """Skip a frame of a sensor that is away: no command is held meanwhile."""
        if self._away_s is None:
            self._away_s = t_s
            _log.warning("%s; waiting for it", why)
            self.note("lost", why)
            self._press((), round(t_s * 1000))
            self._touch(0, None, round(t_s * 1000))

    def _keep(self, recorder: SessionRecorder, frame: Frame, step: Step) -> None:
        """Record a frame, and pass a new cue to the simulated hand."""
        label = "" if self._virtual is None else self._virtual.label(step.t_s)
        truth = recorder.labels.index(label) if label in recorder.labels else UNKNOWN
        taken = recorder.take(frame, step, truth, self.sensor.button(step.t_s))
        if self._hand is not None and taken.asked is not None and taken.fresh:
            self._hand.take_cue(taken.asked, step.t_s)
        if recorder.done:
            self.due = None

    def _send(self, step: Step, rate_hz: float) -> None:
        """Send the results of a frame: the contact, then the command after its uncertainty."""
        t_ms = round(step.t_s * 1000)
        self._touch(step.frame, step.contact, t_ms)
        if step.sigma is not None:
            self.link.send(PositionUncertainty(step.frame, step.sigma), t_ms)
        if step.command is not None:
            c = step.command
            command = Command(c.command, c.gesture, c.probability, c.touch, c.frame)
            self.link.send(command, t_ms)
            self._pressed = ()  # the link may have released it while the loop hung
            self._press((c.command,), t_ms)
        elif self._pressed and not step.held:
            self._press((), t_ms)
        self.link.send(telemetry(step, rate_hz), t_ms)
        if step.confidence or self._user is not None:
            self._identify(UserIdentified(step.user, round(step.confidence, 2)), t_ms)
        if self._virtual is not None:
            for truth in self._virtual.truths():
                self.link.send(truth, t_ms)

    def _report(self, faults: tuple[str, ...], t_ms: int) -> None:
        """Send and log the sensor's new faults."""
        for line in faults:
            if line not in self._faults:
                _log.warning("sensor: %s", line)
        self._faults = faults
        self.link.send(Health(faults), t_ms)

    def _identify(self, user: UserIdentified, t_ms: int) -> None:
        """Send the identified user, when that changes."""
        if user == self._user:
            return
        if self._user is None or user.user != self._user.user:
            _log.info("%s", f"user: {user.user}" if user.user else "user: not identified")
        self._user = user
        self.link.send(user, t_ms)

    def _press(self, pressed: tuple[str, ...], t_ms: int) -> None:
        """Send the held commands, when they change."""
        if pressed != self._pressed:
            self._pressed = pressed
            self.link.send(State(pressed), t_ms)

    def _touch(self, frame: int, contact: ContactEstimate | None, t_ms: int) -> None:
        """Send what touches in a frame, or once that nothing does any more."""
        if (c := contact) is not None:
            shape = c.depth_mm, c.depth_sigma, c.fingers, c.fingers_sure, c.angle_deg, c.angle_sigma
            rise = c.rise_mm, c.rise_sigma
            self.link.send(ContactState(frame, c.x, c.y, c.place_sigma, *shape, *rise), t_ms)
            self._touched = frame
        elif self._touched is not None:
            self.link.send(ContactState(self._touched), t_ms)
            self._touched = None


def telemetry(step: Step, rate_hz: float) -> Telemetry:
    """Return the telemetry of a frame."""
    image = quantise_image(step.image.ravel().tolist())
    probabilities = tuple(step.probabilities.tolist())
    return Telemetry(step.frame, image, probabilities, step.touch, step.held, step.ready, rate_hz)
