"""Decision of a gesture from its probabilities: as soon as it is sure, and one per touch.

A touch begins when the smoothed probability of all gestures together reaches `off`, and ends when
it falls below. In a touch one gesture fires, at the first of these moments:

- its smoothed probability reaches `on`: the evidence is clear;
- the touch has lasted `wait_s`, and the probability reaches `late`: the bound on waiting;
- the touch ends and it was the most probable one, at least `least` at its height and
  `brief_s` long in all (its probabilities, added over time): a tap too short for the first.

Sequential decisions of this kind go back to Wald's test: answer early where the evidence is clear,
wait where it is not. The paper names a debouncing filter (section 5) without describing it.

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
        off: Smoothed probability of all gestures together at which a touch begins and ends.
        wait_s: Time in a touch after which `late` is enough; 0: never.
        late: Smoothed probability at which a gesture fires then.
        least: Greatest smoothed probability in a touch that suffices at its end; above 1: none.
        brief_s: Least sum of the gesture's smoothed probabilities over the time of that touch.
    """

    smoothing: float = field(default=0.4, metadata={"range": (0.01, 1.0)})
    on: float = field(default=0.8, metadata={"range": (0.0, 1.0)})
    off: float = field(default=0.35, metadata={"range": (0.0, 1.0)})
    wait_s: float = field(default=0.0, metadata={"range": (0.0, 10.0)})
    late: float = field(default=1.0, metadata={"range": (0.0, 1.0)})
    least: float = field(default=2.0, metadata={"range": (0.0, 2.0)})
    brief_s: float = field(default=0.0, metadata={"range": (0.0, 10.0)})


class Debouncer:
    """Debouncer of a session: one gesture per touch."""

    def __init__(
        self, labels: Sequence[str], settings: DebounceSettings, rate_hz: float = 10.0
    ) -> None:
        """Begin without a touch.

        Args:
            labels: The classes, "null" first.
            settings: When a gesture fires.
            rate_hz: Frames per second.
        """
        self.labels = tuple(labels)
        self.settings = settings
        self._rate_hz = rate_hz
        self._mean = np.zeros(len(self.labels))
        self._mean[NULL] = 1.0
        self._held = NULL
        self._sum = np.zeros(len(self.labels))  # of the means in a touch without an answer
        self._peak = np.zeros(len(self.labels))  # greatest of them
        self._frames = 0  # of that touch

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
        if 1.0 - self._mean[NULL] < self.settings.off:
            return self._end()
        if self._held != NULL:
            return None
        self._frames += 1
        self._sum += self._mean
        np.maximum(self._peak, self._mean, out=self._peak)
        best = NULL + 1 + int(np.argmax(self._mean[NULL + 1 :]))
        if self._mean[best] < self._needed():
            return None
        self._held = best
        return self.labels[best]

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {
            "mean": self._mean.copy(),
            "held": np.array([self._held], dtype=np.float64),
            "sum": self._sum.copy(),
            "peak": self._peak.copy(),
            "frames": np.array([self._frames], dtype=np.float64),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._mean = state["mean"].copy()
        self._held = int(state["held"][0])
        self._sum, self._peak = state["sum"].copy(), state["peak"].copy()
        self._frames = int(state["frames"][0])

    def _needed(self) -> float:
        """Return the smoothed probability at which a gesture fires in this frame of a touch."""
        wait_s = self.settings.wait_s
        late = wait_s > 0.0 and self._frames / self._rate_hz > wait_s
        return min(self.settings.on, self.settings.late) if late else self.settings.on

    def _end(self) -> str | None:
        """End a touch, if there is one; return the gesture that it was after all, if any."""
        best = NULL + 1 + int(np.argmax(self._sum[NULL + 1 :]))
        enough = (
            self._held == NULL
            and self._peak[best] >= self.settings.least
            and self._sum[best] / self._rate_hz >= self.settings.brief_s
        )
        self._held, self._frames = NULL, 0
        self._sum[:], self._peak[:] = 0.0, 0.0
        return self.labels[best] if enough else None


def smooth(probabilities: Probabilities, smoothing: float) -> Means:
    """Return the debouncer's running mean after every frame, (frames, classes)."""
    if smoothing == 1.0:
        return probabilities.astype(np.float64)
    means = np.empty(probabilities.shape)
    mean = np.zeros(probabilities.shape[1])
    mean[NULL] = 1.0
    for frame, newest in enumerate(probabilities.astype(np.float64)):
        mean += smoothing * (newest - mean)
        means[frame] = mean
    return means


def fire(means: Means, settings: DebounceSettings, rate_hz: float = 10.0) -> list[tuple[int, int]]:
    """Return the frame and the class of every gesture that `Debouncer` fires.

    Args:
        means: What `smooth` returns for the settings' smoothing, (frames, classes).
        settings: When a gesture fires.
        rate_hz: Frames per second.
    """
    gestures = means[:, NULL + 1 :]
    best = gestures.argmax(axis=1)
    height = gestures[np.arange(len(means)), best]
    touched = np.concatenate([[False], 1.0 - means[:, NULL] >= settings.off, [False]])
    begins, ends = np.flatnonzero(np.diff(touched.astype(np.int8))).reshape(-1, 2).T
    if not len(begins):
        return []
    sure = height >= settings.on
    if settings.wait_s > 0.0:
        frame = np.arange(len(means))
        since = frame - begins[np.maximum(np.searchsorted(begins, frame, side="right") - 1, 0)] + 1
        sure |= (since / rate_hz > settings.wait_s) & (height >= settings.late)
    at = np.flatnonzero(sure)
    first = np.append(at, len(means))[np.searchsorted(at, begins)]
    fired = [(int(f), NULL + 1 + int(best[f])) for f in first[first < ends]]
    if settings.least <= 1.0:
        bounds = np.column_stack([begins, ends]).ravel()
        padded = np.vstack([gestures, np.zeros(gestures.shape[1])])
        sums = np.add.reduceat(padded, bounds)[::2]
        peaks = np.maximum.reduceat(padded, bounds)[::2]
        most, touch = sums.argmax(axis=1), np.arange(len(begins))
        enough = (
            (first >= ends)
            & (ends < len(means))
            & (peaks[touch, most] >= settings.least)
            & (sums[touch, most] / rate_hz >= settings.brief_s)
        )
        fired += [(int(ends[i]), NULL + 1 + int(most[i])) for i in np.flatnonzero(enough)]
    return sorted(fired)
