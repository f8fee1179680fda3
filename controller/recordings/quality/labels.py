"""Timing and labels of a recording: rate and missing frames, and what each source labelled.

A source is one of the label columns: the truth, the label button, the keyboard, the cues.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.frames import same_rate
from controller.recordings.quality.taxels import Response
from controller.recordings.recording import LABELLERS, PICOFARAD, UNKNOWN, Recording

MISSING: Final = 0.02  # beyond this share a window of ten frames usually has a gap
USELESS: Final = 0.2  # beyond this share nearly every window has one
LATE: Final = 1.5  # times the intended interval after missing numbers is a pause
PAUSE: Final = 5.0  # times the intended interval without a missing number: half a window at 10 Hz
# Below this share of a typical touch's energy, a label holds no touch. Of 1,074 true gestures on
# simulated orbs of both presets, 1 in 50 is weaker.
EMPTY: Final = 0.2
CUE: Final = "cue"  # begins before a gesture and ends after it
ENOUGH: Final = 5  # least number of gestures to judge their touches
EMPTY_SHARE: Final = 0.15  # allowed share of empty gestures
IDLE_SHARE: Final = 0.7  # allowed share of untouched time; a noisy orb misses the rims


@dataclass(frozen=True, slots=True)
class FrameTiming:
    """Rate and missing frames of a recording."""

    intended_hz: float
    measured_hz: float  # frames over time, without pauses
    worst_ms: float  # the longest interval between consecutive numbers
    missing: int  # without those in pauses
    stretches: int  # segments between pauses
    frames: int

    @property
    def missing_share(self) -> float:
        """Share of missing frames."""
        return self.missing / (self.missing + self.frames)

    def complaints(self) -> list[str]:
        """Return sentences about problems."""
        lines = []
        if not same_rate(self.measured_hz, self.intended_hz):
            off = self.measured_hz / self.intended_hz - 1.0
            lines.append(
                f"frames came at {self.measured_hz:.2f} Hz, {abs(100 * off):.0f} % "
                f"{'faster' if off > 0 else 'slower'} than the {self.intended_hz:g} Hz intended"
            )
        if self.missing_share > MISSING:
            lines.append(f"{self.missing} of {self.missing + self.frames} frames are missing")
        if self.worst_ms > PAUSE * 1000.0 / self.intended_hz:
            lines.append(f"a frame came {self.worst_ms / 1000:.1f} s late and no number is missing")
        return lines


def pauses(recording: Recording) -> NDArray[np.bool_]:
    """Return whether each frame follows a pause, (n,): more time than the missing frames take."""
    after = np.flatnonzero(np.diff(recording.sequence) > 1) + 1  # missing numbers
    steps = recording.sequence[after] - recording.sequence[after - 1]
    spent_s = recording.t[after] - recording.t[after - 1]
    paused = np.zeros(len(recording.t), dtype=np.bool_)
    paused[after[spent_s > LATE * steps / recording.origin.rate_hz]] = True
    return paused


def measure(recording: Recording) -> FrameTiming:
    """Return the timing of a recording."""
    intended_hz, measured_hz = float(recording.origin.rate_hz), recording.rate_hz
    steps, going = np.diff(recording.sequence), ~pauses(recording)[1:]
    spent_s = np.diff(recording.t)
    return FrameTiming(
        intended_hz,
        measured_hz,
        1000.0 * float(np.max(spent_s, where=steps == 1, initial=0.0)),
        missing=int(np.sum(steps, where=going)) - int(going.sum()),
        stretches=1 + int((~going).sum()),
        frames=len(recording.t),
    )


@dataclass(frozen=True, slots=True)
class SourceLabels:
    """The labels of one source."""

    labeller: str  # the label column
    events: dict[str, int]  # number of times of each label, without "null"
    seconds: dict[str, float]  # of each label with "null", without excluded frames
    unknown: float  # share of frames without a label
    empty: int  # labels without a touch
    idle: float  # share of untouched frames among the labelled ones

    def complaints(self) -> list[str]:
        """Return sentences about problems."""
        name, total = self.labeller, sum(self.events.values())
        lines = []
        if total >= ENOUGH and self.empty > EMPTY_SHARE * total:
            lines.append(f"nothing is felt in {self.empty} of {total} gestures that {name} names")
        if name != CUE and self.idle > IDLE_SHARE:
            lines.append(
                f"nothing touches for {100 * self.idle:.0f} % of the time that {name} names a "
                "gesture"
            )
        return lines


def summarise(recording: Recording, response: Response) -> tuple[SourceLabels, ...]:
    """Return the labels of each source with any."""
    return tuple(
        _one(name, recording, response)
        for name in LABELLERS
        if (getattr(recording, name) != UNKNOWN).any()
    )


def spans(column: NDArray[np.int16], breaks: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """Return (label, first, end) of every gesture in a column, (n,), parted by `breaks`, (n,)."""
    edges = np.flatnonzero((np.diff(column) != 0) | breaks[1:]) + 1
    bounds = [0, *edges.tolist(), len(column)]
    return [
        (int(column[first]), first, end) for first, end in pairwise(bounds) if column[first] > 0
    ]


def _one(name: str, recording: Recording, response: Response) -> SourceLabels:
    column: NDArray[np.int16] = getattr(recording, name)
    labels, used = recording.origin.labels, ~recording.excluded
    found = spans(np.where(used, column, 0).astype(np.int16), pauses(recording))
    each_s = 1.0 / recording.rate_hz
    named = used & (column > 0) & response.known
    return SourceLabels(
        name,
        {label: sum(f[0] == i for f in found) for i, label in enumerate(labels) if i},
        {label: each_s * int((used & (column == i)).sum()) for i, label in enumerate(labels)},
        unknown=float((column == UNKNOWN).mean()),
        empty=_empty(found, response, local=recording.origin.unit != PICOFARAD),
        idle=float((named & ~response.touched).sum() / max(1, named.sum())),
    )


def _empty(found: list[tuple[int, int, int]], response: Response, *, local: bool) -> int:
    """Return how many labels hold no touch; a `local` one may be far weaker than a flat hand."""
    known = [slice(first, end) for _, first, end in found if response.known[first]]
    if not known or not response.idle.any():
        return 0
    if local:
        return sum(not response.touched[span].any() for span in known)
    idle = np.median(response.energy[response.idle])
    peaks = np.array([response.energy[span].max() for span in known]) - idle
    # The upper quartile: as many as three in four may be empty.
    usual = float(np.quantile(peaks, 0.75))
    return int((peaks < EMPTY * usual).sum()) if usual > 0.0 else len(peaks)
