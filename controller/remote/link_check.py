"""Calibration and the doctor's checks while the device runs, for the host on the link.

The loop goes on and passes each frame on; the checks run on a worker's thread. What needs the board
for itself, the measurements of the wiring, is left to `controller doctor`.
"""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from controller.diagnostics import calibration, system_checks, touch_checks
from controller.diagnostics.frame_source import Finger, FrameReader
from controller.diagnostics.report import Row, Verdict
from controller.diagnostics.skin_checks import IDLE_S, skin_rows
from controller.recognition.images.frames import Frame
from controller.remote.worker import Worker
from controller.runtime.assemble import Parts, bundle_path
from controller.runtime.device import Device
from controller.runtime.loop import Handler
from controller.sensors.geometry import SensorError
from controller.shared import files
from controller.shared.aliases import Frames
from controller.shared.errors import reason
from controller.shared.notices import notice
from controller.shared.protocol.messages import Message
from controller.shared.protocol.teaching import Check, CheckRow, CheckStep

_AWAY_S: Final = 5.0  # without a frame
_LOOK_S: Final = 0.25  # of frames, whose mean tells whether a finger is down
_SETTLE_S: Final = 0.5  # from the press to the first frame that counts
_PATIENCE_S: Final = 30.0  # for a press, or for its end
_REST_SHARE: Final = 0.4  # of the progress; the presses have the rest

Tell = Callable[[Message], None]


class LiveFrames(FrameReader):
    """The frames of a device that runs, on another thread."""

    def __init__(self, device: Device) -> None:
        """Begin with the next frame."""
        super().__init__(device.sensor)
        self._frames: queue.SimpleQueue[Frame | None] = queue.SimpleQueue()
        self.stopped = False
        device.watch = self._put

    def _put(self, frame: Frame) -> None:
        if not self.stopped:
            self._frames.put(frame.copy())

    def stop(self) -> None:
        """Let the next frame raise SensorError."""
        self.stopped = True
        self._frames.put(None)

    def catch_up(self) -> None:
        """Drop the frames that came while nothing was read."""
        for _ in range(self._frames.qsize()):
            self._next()

    def _next(self) -> Frame:
        try:
            frame = self._frames.get(timeout=_AWAY_S)
        except queue.Empty:
            frame = None
        if frame is None:
            raise SensorError(notice("away"))
        return frame


class AskedFinger(Finger):
    """A user at the host, who is asked to press, and whose press is seen in the frames."""

    def __init__(self, tell: Tell, watch: LiveFrames) -> None:
        """Begin untouched; `tell` sends a message."""
        self._tell, self._watch = tell, watch
        watch.catch_up()
        self._level = np.maximum(watch.frames(2 * _LOOK_S).mean(axis=0), 0.01)
        grid = watch.sensor.geometry
        self._places = touch_checks.places(grid.rows, grid.columns)
        self._last = self._places[0]

    def press(self, place: touch_checks.Place) -> bool:
        """Ask for a press, and wait until it is felt; False: in vain."""
        self._last = place
        self._step("press")
        if not self._wait(down=True):
            return False
        self._watch.frames(_SETTLE_S)
        return True

    def lift(self) -> None:
        """Ask for the end of the press, and wait for that."""
        self._step("lift")
        self._wait(down=False)

    def _step(self, step: str) -> None:
        done = self._places.index(self._last) / len(self._places)
        share = _REST_SHARE + (1.0 - _REST_SHARE) * done
        self._watch.catch_up()
        self._tell(CheckStep(step, *self._last, share))

    def _wait(self, *, down: bool) -> bool:
        for _ in range(round(_PATIENCE_S / _LOOK_S)):
            change = self._watch.frames(_LOOK_S).mean(axis=0) / self._level - 1.0
            if touch_checks.unfelt(change) != down:
                return True
        return False


class LinkCheck(Handler):
    """The check under way, if there is one."""

    def __init__(self, current: Callable[[], Parts]) -> None:
        self._current = current
        self._worker = Worker()
        self._watch: LiveFrames | None = None

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        """Start or stop a check; its messages come from `poll`."""
        if not isinstance(message, Check):
            return None
        if self._watch is not None:
            self._watch.stop()
        self._watch = None
        if message.on:
            self._watch = LiveFrames(device)
            bundle = bundle_path(self._current().options)
            self._worker.begin(partial(_messages, self._watch, bundle, self._worker.tell))
        return []

    def poll(self, device: Device) -> Sequence[Message]:
        """Return new messages, oldest first."""
        return self._worker.poll()


def _messages(watch: LiveFrames, bundle: Path, tell: Tell) -> Iterator[Message]:
    """Yield the rows of a check; its steps are told meanwhile."""
    try:
        for row in _rows(watch, bundle, tell):
            yield CheckRow(row.name, row.verdict, row.found, row.advice, row.code)
    finally:
        watch.stopped = True
    yield CheckStep("over", 0, 0, 1.0)


def _rows(watch: LiveFrames, bundle: Path, tell: Tell) -> Iterator[Row]:
    tell(CheckStep("rest", 0, 0, 0.0))
    try:
        calibrated = list(_calibration(watch, _rest(watch, tell)))
        yield from calibrated
        if any(row.code == "touched" and row.verdict is Verdict.FAULT for row in calibrated):
            return
        yield system_checks.disk(files.state_folder())
        yield system_checks.runtime(bundle)
        bad = np.zeros((watch.sensor.geometry.rows, watch.sensor.geometry.columns), np.bool_)
        watch.catch_up()
        yield from skin_rows(watch, bad, lambda _: AskedFinger(tell, watch))
    except SensorError as error:
        if not watch.stopped:
            yield Row("sensor", Verdict.FAULT, str(error), notice("hardware"), "sensor")
        return
    if watch.sensor.driver is not None:
        yield Row("wiring", Verdict.UNKNOWN, notice("unmeasured"))


def _rest(watch: LiveFrames, tell: Tell) -> Frames:
    """Return the frames of a calibration, second by second."""
    parts = []
    for second in range(round(calibration.CALIBRATION_S)):
        tell(CheckStep("rest", 0, 0, _REST_SHARE * second / (calibration.CALIBRATION_S + IDLE_S)))
        parts.append(watch.frames(1.0))
    return np.concatenate(parts)


def _calibration(watch: LiveFrames, frames: Frames) -> Iterator[Row]:
    """Yield what a calibration found but what is good, and whether it is kept."""
    name = "calibration"
    try:
        rows, kept = calibration.keep(watch.sensor, frames)
    except OSError as error:
        yield Row(name, Verdict.FAULT, notice("unkept", reason(error)), "", name)
        return
    yield from (row for row in rows if row.verdict is not Verdict.GOOD)
    if kept:
        yield Row(name, Verdict.GOOD, notice("kept"))
