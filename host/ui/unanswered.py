"""Reasons why a touch gave no command: too short, too light, or undecided between two gestures.

Judged from telemetry alone, so that it needs nothing of the device: how strong the image was, how
long, and what the network took it for.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from controller.shared.event_metric import LIGHT, RIVAL, SHORT_S
from host.ui.touch_watch import TouchWatch

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
        self._watch = TouchWatch(_ANSWER_S, math.inf)
        self._begun_s: float | None = None  # of the touch under way
        self._answered = False
        self._left_s = 0.0  # end of the last touch
        self._recovered_s = 0.0  # when the dome has sprung back from the last answered touch
        self._peaks = np.zeros(len(labels))  # greatest probabilities
        self._null = 1.0  # smallest probability of none

    def answer(self) -> None:
        """Take note of a command."""
        self._answered = True

    def step(
        self,
        deviation: NDArray[np.floating],
        probabilities: NDArray[np.float32],
        held: str,
        now_s: float,
    ) -> Reason | None:
        """Take a frame's z - 1, (rows, columns), probabilities, (labels,), and held gesture.

        Return the reason.

        It is None but for the frame in which an unanswered touch is over.
        """
        event = self._watch.step(deviation, now_s)
        if event == "begun":
            if self._answered:
                self._recovered_s = self._left_s + _RECOVER_S
            self._begun_s, self._answered = now_s, False
            self._peaks[:], self._null = 0.0, 1.0
        if self._begun_s is None:
            return None
        self._answered |= bool(held)
        np.maximum(self._peaks, probabilities, out=self._peaks)
        self._null = min(self._null, float(probabilities[0]))
        if event != "ended":
            return None
        begun_s, self._begun_s, self._left_s = self._begun_s, None, now_s - _ANSWER_S
        untouched = self._answered or not self._watch.felt
        return None if untouched else self._reason(begun_s, self._left_s)

    def _reason(self, begun_s: float, ended_s: float) -> Reason | None:
        first, *others = sorted(range(1, len(self._labels)), key=lambda i: -self._peaks[i])
        if 1.0 - self._null < LIGHT:
            return Reason("light") if begun_s >= self._recovered_s else None
        if others and self._peaks[others[0]] > RIVAL * self._peaks[first]:
            return Reason("undecided", (self._labels[first], self._labels[others[0]]))
        if ended_s - begun_s < SHORT_S:
            return Reason("short")
        return Reason("unclear", (self._labels[first],))
