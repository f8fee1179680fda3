"""Timing of a recording: how evenly its frames came, and which are missing."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.console import count
from controller.recordings.recording import RATE_TOLERANCE, Recording

# Beyond this share a window of ten frames usually has a hole.
MISSING: Final = 0.02
USELESS: Final = 0.2  # and from this one on, hardly any has none
LATE: Final = 1.5  # times the intended interval: one frame in twenty may be later
PAUSE: Final = 5.0  # times the intended interval without a missing number: half a window at 10 Hz


@dataclass(frozen=True, slots=True)
class FrameTiming:
    """Rate, intervals and missing frames of a recording.

    Attributes:
        intended_hz: Frames per second, as intended.
        measured_hz: Frames per second, from the median interval.
        median_ms: Median interval between frames where no number is missing.
        p95_ms: One interval in twenty is longer.
        worst_ms: The longest interval.
        missing: Frames whose numbers are missing, without those in pauses.
        gaps: Places where they are missing.
        stretches: Pieces between pauses.
        frames: Frames that are there.
    """

    intended_hz: float
    measured_hz: float
    median_ms: float
    p95_ms: float
    worst_ms: float
    missing: int
    gaps: int
    stretches: int
    frames: int

    @property
    def missing_share(self) -> float:
        """Missing frames as a share of all that there should be."""
        return self.missing / (self.missing + self.frames)

    def complaints(self) -> list[str]:
        """Return sentences about problems."""
        lines = []
        off = self.measured_hz / self.intended_hz - 1.0
        interval_ms = 1000.0 / self.intended_hz
        if abs(off) > RATE_TOLERANCE:
            lines.append(
                f"frames came at {self.measured_hz:.2f} Hz, {abs(100 * off):.0f} % "
                f"{'faster' if off > 0 else 'slower'} than the {self.intended_hz:g} Hz intended"
            )
        if self.missing_share > MISSING:
            lines.append(
                f"{self.missing} of {self.missing + self.frames} frames are missing, "
                f"in {count(self.gaps, 'gap')}"
            )
        if self.p95_ms > LATE * interval_ms:
            lines.append(
                f"one frame in twenty came {self.p95_ms:.0f} ms or more after the one before, "
                f"{interval_ms:.0f} ms intended"
            )
        if self.worst_ms > PAUSE * interval_ms:
            lines.append(f"a frame came {self.worst_ms / 1000:.1f} s late and no number is missing")
        return lines


def pauses(recording: Recording) -> NDArray[np.bool_]:
    """Return the frames that follow a pause, (n,).

    There numbers are missing, and far more time went by than they would have taken.
    """
    steps = np.diff(recording.sequence, prepend=recording.sequence[0])
    spent_s = np.diff(recording.t, prepend=recording.t[0])
    return np.asarray((steps > 1) & (spent_s > LATE * steps / recording.origin.rate_hz))


def measure(recording: Recording) -> FrameTiming:
    """Return the timing of a recording."""
    intended_hz = float(recording.origin.rate_hz)
    steps, paused = np.diff(recording.sequence), pauses(recording)[1:]
    spent_ms = 1000.0 * np.diff(recording.t)[steps == 1]
    if not len(spent_ms):
        spent_ms = np.array([1000.0 / intended_hz])
    median_ms, p95_ms, worst_ms = np.quantile(spent_ms, (0.5, 0.95, 1.0)).tolist()
    return FrameTiming(
        intended_hz,
        1000.0 / median_ms,
        median_ms,
        p95_ms,
        worst_ms,
        missing=int((steps - 1)[~paused].sum()),
        gaps=int((steps > 1)[~paused].sum()),
        stretches=1 + int(paused.sum()),
        frames=len(recording.t),
    )
