"""Frames for checks, in real time or simulated, and the fingers that press the sensor."""

import time
from collections.abc import Callable
from typing import Final

import numpy as np

from controller.diagnostics.touch_checks import Place
from controller.recognition.images.frames import Frame
from controller.sensors.base import Sensor
from controller.shared import errors
from controller.shared.aliases import Frames
from controller.shared.protocol.messages import Contact

DEPTH_MM: Final = 8.0  # of a firm press
RADIUS_MM: Final = 7.0
_SETTLE_S: Final = 0.5  # from the press to the first frame that counts
_REST_S: Final = 1.0  # from one press to the next, on a simulated skin


class FrameReader:
    """Reads one sensor."""

    def __init__(
        self,
        sensor: Sensor,
        *,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Begin at the sensor's time 0."""
        self.sensor = sensor
        self._clock, self._sleep = clock, sleep
        self._number = 0
        self._origin_s: float | None = None

    @property
    def now_s(self) -> float:
        """Time of the latest frame."""
        return self._number / self.sensor.rate_hz

    def frames(self, seconds: float) -> Frames:
        """Return the frames of so many seconds, (n, rows, columns), pF, or raise SensorError."""
        return np.array([self._next() for _ in range(max(1, round(seconds * self.sensor.rate_hz)))])

    def _next(self) -> Frame:
        """Return the next frame."""
        self._number += 1
        if not self.sensor.virtual:
            now_s = self._clock()
            due_s = now_s if self._origin_s is None else self._origin_s + self.now_s
            if self._origin_s is None or now_s > due_s + 1.0:  # after a question
                self._origin_s = now_s - self.now_s
            else:
                self._sleep(max(0.0, due_s - now_s))
        return self.sensor.read(self.now_s)


class Finger:
    """A user at a terminal, who is asked to press."""

    def __init__(self, ask: Callable[[str], str] = errors.ask) -> None:
        """Ask on the standard error stream, unless another way is given."""
        self._ask = ask

    def press(self, place: Place) -> bool:
        """Ask for a press on a taxel, (row, column); False: s or the end of input skips it."""
        row, column = place
        words = (
            f"Press the taxel in row {row}, column {column} (from the top left, from 0) firmly, "
            "keep it pressed, and hit Enter (s Enter: skip all presses) "
        )
        try:
            return not self._ask(words).strip().lower().startswith("s")
        except EOFError:
            return False

    def lift(self) -> None:
        """Lift the finger; the next question asks for that."""


class VirtualFinger(Finger):
    """A finger on a virtual orb."""

    def __init__(self, watch: FrameReader) -> None:
        self._watch, self._sensor = watch, watch.sensor

    def press(self, place: Place) -> bool:
        """Press at once."""
        row, column = place
        y = float(self._sensor.geometry.rows - 1 - row)
        contact = Contact(1, float(column), y, DEPTH_MM, RADIUS_MM)
        self._sensor.touch((contact,), self._watch.now_s)
        self._watch.frames(_SETTLE_S)
        return True

    def lift(self) -> None:
        """Lift, and let the skin come to rest."""
        self._sensor.touch((), self._watch.now_s)
        self._watch.frames(_REST_S)
