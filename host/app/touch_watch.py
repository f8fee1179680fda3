"""Beginnings and ends of touches, seen in the level of telemetry; pure."""

from typing import Final, Literal

_RISE: Final = (1.6, 0.012)  # a touch begins at so many times the level at rest, and so much more
_FALL: Final = (1.3, 0.010)  # and ends below this
_REST_S: Final = 1.0  # time constant of the level at rest
PAUSE_S: Final = 0.5  # without a touch, after which it is over: a double tap is one touch
_LONGEST_S: Final = 8.0  # a touch that lasts longer is ended

TouchEvent = Literal["", "begun", "ended"]


class TouchWatch:
    """Beginnings and ends of touches in the level of the image, its RMS of z - 1."""

    def __init__(self) -> None:
        """Begin untouched."""
        self._rest: float | None = None
        self._last_s = 0.0
        self._begun_s: float | None = None
        self._quiet_s: float | None = None  # since when nothing touches

    def step(self, level: float, now_s: float) -> TouchEvent:
        """Take the level of a frame; return what happened in it.

        A touch ends when nothing has touched for `PAUSE_S`, or when it lasts too long.
        """
        rest = level if self._rest is None else self._rest
        self._rest = rest
        passed_s, self._last_s = now_s - self._last_s, now_s
        touched = self._begun_s is not None and self._quiet_s is None
        times, more = _FALL if touched else _RISE
        if level > times * rest + more:
            self._quiet_s = None
            if self._begun_s is None:
                self._begun_s = now_s
                return "begun"
        elif self._begun_s is None:
            share = min(1.0, passed_s / _REST_S)
            self._rest = min(level, rest + share * (level - rest))
        elif self._quiet_s is None:
            self._quiet_s = now_s
        return self._over(now_s)

    def _over(self, now_s: float) -> TouchEvent:
        if self._begun_s is None:
            return ""
        paused = self._quiet_s is not None and now_s - self._quiet_s >= PAUSE_S
        if not paused and now_s - self._begun_s < _LONGEST_S:
            return ""
        if not paused:
            self._rest = None  # what lasts so long is a new level at rest
        self._begun_s = self._quiet_s = None
        return "ended"
