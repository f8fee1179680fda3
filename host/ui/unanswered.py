"""Reasons why a touch gave no command: too short, too light, or undecided between two gestures.

Judged from telemetry alone, so that it needs nothing of the device: how strong the image was, how
long, and what the network took it for.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from controller.shared.event_metric import LIGHT, RIVAL, SHORT_S

_RISE: Final = (1.6, 0.012)  # a touch begins at so many times the level at rest, and so much more
_FALL: Final = (1.3, 0.010)  # and ends below this
_REST_S: Final = 1.0  # time constant of the level at rest
_ANSWER_S: Final = 0.2  # after its end, in which a touch may still be answered
_RECOVER_S: Final = 1.0  # in which the dome springs back after an answered touch, like a light one


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a touch gave no command: a key below `dome.unanswered`, and the gestures it names."""

    key: Literal["light", "undecided", "short", "unclear"]
    labels: tuple[str, ...] = ()


class UnansweredTouches:
    """Watches one orb's telemetry for touches that no command answers; times are in seconds."""

    def __init__(self, labels: Sequence[str]) -> None:
        """Begin untouched; "null" is the first label."""
        self._labels = labels
        self._rest: float | None = None  # level at rest
        self._last_s: float | None = None
        self._begun_s: float | None = None  # of the touch under way, or just over
        self._ended_s: float | None = None
        self._answered = False
        self._left_s = 0.0  # end of the last touch
        self._recovered_s = 0.0  # when the dome has sprung back from the last answered touch
        self._peaks = np.zeros(len(labels))  # greatest probabilities
        self._null = 1.0  # smallest probability of none

    def answer(self) -> None:
        """Take note of a command."""
        self._answered = True

    def step(
        self, deviation: float, probabilities: NDArray[np.float32], held: str, now_s: float
    ) -> Reason | None:
        """Take a frame's deviation, probabilities (labels,) and held gesture; return the reason.

        It is None but for the frame in which an unanswered touch is over.
        """
        passed_s = 0.0 if self._last_s is None else now_s - self._last_s
        self._last_s = now_s
        under_way = self._begun_s is not None and self._ended_s is None
        times, more = _FALL if under_way else _RISE
        if self._rest is not None and deviation > times * self._rest + more:
            if not under_way:
                self._begin(now_s)
        elif self._rest is None:
            self._rest = deviation
        elif self._begun_s is None:
            share = min(1.0, passed_s / _REST_S)
            self._rest += share * (deviation - self._rest)
        elif self._ended_s is None:
            self._ended_s = self._left_s = now_s
        if self._begun_s is None:
            return None
        self._answered |= bool(held)
        np.maximum(self._peaks, probabilities, out=self._peaks)
        self._null = min(self._null, float(probabilities[0]))
        if self._ended_s is None or now_s - self._ended_s < _ANSWER_S:
            return None
        reason = None if self._answered else self._reason(self._begun_s, self._ended_s)
        self._begun_s = self._ended_s = None
        return reason

    def _begin(self, now_s: float) -> None:
        if self._answered:
            self._recovered_s = self._left_s + _RECOVER_S
        self._begun_s, self._ended_s, self._answered = now_s, None, False
        self._peaks[:], self._null = 0.0, 1.0

    def _reason(self, begun_s: float, ended_s: float) -> Reason | None:
        first, *others = sorted(range(1, len(self._labels)), key=lambda i: -self._peaks[i])
        if 1.0 - self._null < LIGHT:
            return Reason("light") if begun_s >= self._recovered_s else None
        if others and self._peaks[others[0]] > RIVAL * self._peaks[first]:
            return Reason("undecided", (self._labels[first], self._labels[others[0]]))
        if ended_s - begun_s < SHORT_S:
            return Reason("short")
        return Reason("unclear", (self._labels[first],))
