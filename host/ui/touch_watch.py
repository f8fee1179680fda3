"""Beginnings and ends of touches, seen in the level of telemetry; pure."""

import math
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

TOUCHED: Final = 0.04  # greatest |z - 1| of an image with a touch; less is noise
PAUSE_S: Final = 0.5  # without a touch, after which it is over: a double tap is one touch
_RISE: Final = (1.6, 0.012)  # a touch begins at so many times the level at rest, and so much more
_FALL: Final = (1.3, 0.010)  # and ends below this
_SHARE: Final = 0.4  # of the last touch's greatest level: the dome springs back below that
_RECOVER_S: Final = 2.0  # time constant with which that level is forgotten
_REST_S: Final = 1.0  # time constant of the level at rest
_MOST_REST: Final = 0.03  # first level at rest: the orb may be touched already
_LONGEST_S: Final = 8.0  # a touch that lasts longer is ended

TouchEvent = Literal["", "begun", "ended"]


class TouchWatch:
    """Beginnings and ends of touches in the level of the image, its RMS of z - 1.

    Attributes:
        felt: Whether an image of the last touch had `TOUCHED`; if not, it was noise.
    """

    def __init__(self, pause_s: float = PAUSE_S, most_rest: float = _MOST_REST) -> None:
        """Begin untouched.

        A touch is over after `pause_s` without one. The first level at rest is `most_rest` at most.
        """
        self._pause_s, self._most_rest, self.felt = pause_s, most_rest, False
        self._rest: float | None = None
        self._peak = 0.0  # greatest level of the last touch, as far as it counts
        self._last_s = 0.0
        self._begun_s: float | None = None
        self._quiet_s: float | None = None  # since when nothing touches

    def step(self, deviation: NDArray[np.floating], now_s: float) -> TouchEvent:
        """Take z - 1 of a frame, (rows, columns); return what happened in it.

        A touch ends when nothing has touched for the pause, or when it lasts too long.
        """
        level = math.sqrt(float(np.vdot(deviation, deviation)) / deviation.size)
        touches = bool(np.abs(deviation).max(initial=0.0) >= TOUCHED)
        passed_s, self._last_s = now_s - self._last_s, now_s
        if self._rest is None:
            self._rest = min(level, self._most_rest)
        touched = self._begun_s is not None and self._quiet_s is None
        times, more = _FALL if touched else _RISE
        if level > max(times * self._rest + more, _SHARE * self._peak):
            self._quiet_s, self._peak = None, max(self._peak, level)
            if self._begun_s is None:
                self._begun_s, self._peak, self.felt = now_s, level, touches
                return "begun"
            self.felt |= touches
        elif self._begun_s is None:
            self._rest += min(1.0, passed_s / _REST_S) * (level - self._rest)
            self._peak *= math.exp(-passed_s / _RECOVER_S)
        elif self._quiet_s is None:
            self._quiet_s = now_s
        return self._over(now_s)

    def _over(self, now_s: float) -> TouchEvent:
        if self._begun_s is None:
            return ""
        paused = self._quiet_s is not None and now_s - self._quiet_s >= self._pause_s
        if not paused and now_s - self._begun_s < _LONGEST_S:
            return ""
        if not paused:
            self._rest, self._peak = None, 0.0  # what lasts so long is a new level at rest
        self._begun_s = self._quiet_s = None
        return "ended"
