"""Debouncing of gesture probabilities: smoothing, hysteresis, and a latch; one gesture per touch.

A gesture fires when its smoothed probability rises above `on`; no other fires until the smoothed
probability of all gestures together has fallen below `off`, which happens only at rest.
The paper names a debouncing filter (section 5) without describing it.

`Debouncer` takes one frame at a time, as the device does. `smooth` and `fire` are the same for a
whole recording, so that many settings can be compared; a test compares both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controller.recognition.frames import State

Probabilities = NDArray[np.floating]  # (frames, classes), "null" first
Means = NDArray[np.float64]  # (frames, classes): smoothed probabilities

NULL = 0  # the class "null" comes first in every bundle


@dataclass(frozen=True, slots=True)
class DebounceSettings:
    """Settings of the debouncer; tuned on development streams, stored in the bundle.

    Attributes:
        smoothing: Weight of the newest probabilities in the running mean, above 0, at most 1.
        on: Smoothed probability at which a gesture fires.
        off: Smoothed probability of all gestures together at which the latch re-arms.
    """

    smoothing: float = field(default=0.4, metadata={"range": (0.01, 1.0)})
    on: float = field(default=0.8, metadata={"range": (0.0, 1.0)})
    off: float = field(default=0.35, metadata={"range": (0.0, 1.0)})


class Debouncer:
    """Debouncer of a session: one gesture per touch."""

    def __init__(self, labels: Sequence[str], settings: DebounceSettings) -> None:
        self.labels = tuple(labels)
        self.settings = settings
        self._mean = np.zeros(len(self.labels))
        self._mean[NULL] = 1.0
        self._held = NULL

    @property
    def held(self) -> str:
        """The gesture whose touch still lasts, "" if none."""
        return self.labels[self._held] if self._held != NULL else ""

    def step(self, probabilities: NDArray[np.floating]) -> str | None:
        """Take the newest probabilities, (classes,); return the gesture that fires, if any.

        Raises:
            ValueError: There are more or fewer probabilities than labels.
        """
        if probabilities.shape != self._mean.shape:
            raise ValueError(
                f"{probabilities.shape} probabilities for {len(self.labels)} labels; "
                "the network and its labels belong to different bundles"
            )
        self._mean += self.settings.smoothing * (probabilities - self._mean)
        if self._held != NULL:
            if 1.0 - self._mean[NULL] < self.settings.off:
                self._held = NULL
            return None
        best = NULL + 1 + int(np.argmax(self._mean[NULL + 1 :]))
        if self._mean[best] < self.settings.on:
            return None
        self._held = best
        return self.labels[best]

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {"mean": self._mean.copy(), "held": np.array([self._held], dtype=np.float64)}

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._mean = state["mean"].copy()
        self._held = int(state["held"][0])


def smooth(probabilities: Probabilities, smoothing: float) -> Means:
    """Return the debouncer's running mean after every frame, (frames, classes)."""
    means = np.empty(probabilities.shape)
    mean = np.zeros(probabilities.shape[1])
    mean[NULL] = 1.0
    for frame, newest in enumerate(probabilities.astype(np.float64)):
        mean += smoothing * (newest - mean)
        means[frame] = mean
    return means


def fire(means: Means, settings: DebounceSettings) -> list[tuple[int, int]]:
    """Return the frame and the class of every gesture that `Debouncer` fires.

    Args:
        means: What `smooth` returns for the settings' smoothing, (frames, classes).
        settings: Thresholds.
    """
    best = NULL + 1 + means[:, NULL + 1 :].argmax(axis=1)
    rises = np.flatnonzero(means[np.arange(len(means)), best] >= settings.on)
    falls = np.flatnonzero(1.0 - means[:, NULL] < settings.off)
    fired = []
    at = 0
    while at < len(rises):
        frame = int(rises[at])
        fired.append((frame, int(best[frame])))
        released = int(np.searchsorted(falls, frame, side="right"))
        if released == len(falls):
            break
        at = int(np.searchsorted(rises, falls[released], side="right"))
    return fired
