"""Timing of a recording: rate, intervals and missing frames."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.errors import count
from controller.recordings.recording import RATE_TOLERANCE, Recording

MISSING: Final = 0.02  # beyond this share a window of ten frames usually has a gap
USELESS: Final = 0.2  # beyond this share nearly every window has one
LATE: Final = 1.5  # times the intended interval, for the 95th percentile
PAUSE: Final = 5.0  # times the intended interval without a missing number: half a window at 10 Hz


@dataclass(frozen=True, slots=True)
class FrameTiming:
    """Rate, intervals and missing frames of a recording.

    Attributes:
        intended_hz: Nominal frames per second.
        measured_hz: Frames per second, from the median interval.
        median_ms: Median interval between consecutively numbered frames.
        p95_ms: 95th percentile of these intervals.
        worst_ms: The longest of these intervals.
        missing: Number of missing frames, without those in pauses.
        gaps: Number of places where frames are missing.
        stretches: Number of segments between pauses.
        frames: Number of recorded frames.
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
        """Share of missing frames."""
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
    """Return whether each frame follows a pause, (n,).

    After a pause numbers are missing, and more time has passed than the missing frames take.
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
