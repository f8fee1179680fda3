"""Label quality: the labels of each source, and how well they fit the response of the sensor.

A source is one of the label columns: the truth, the label button, the keyboard, the cues.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.quality.response import Response
from controller.recordings.quality.timing import pauses
from controller.recordings.recording import LABELLERS, UNKNOWN, Recording

REACH_S: Final = 1.5  # a touch may begin or end so far from its label
HALF: Final = 0.5  # of a touch's energy: where it counts as begun, and as ended
# Below this share of a usual touch's energy, a label holds no touch. Of 1,074 true gestures on
# simulated orbs of both presets, 1 in 50 is so weak.
EMPTY: Final = 0.2
ASKED: Final = "cue"  # begins before a gesture and ends after it: no edge of it is late
# A source that is later than this labels half a press (0.5 s: docs/data.md) wrongly.
LATE_S: Final = 0.3
SCATTER_S: Final = 0.5  # for the middle half of the delays
EDGES: Final = 5  # fewer are too few for a delay
EMPTY_SHARE: Final = 0.15  # of a source's gestures may be empty
IDLE_SHARE: Final = 0.7  # of the labelled time may be untouched; a noisy orb misses the rims


@dataclass(frozen=True, slots=True)
class LabelDelay:
    """Delay of the edges of labels against the touch, seconds; below zero is early.

    Attributes:
        median_s: The median.
        spread_s: Range of the middle half.
        edges: Number of edges.
    """

    median_s: float
    spread_s: float
    edges: int


@dataclass(frozen=True, slots=True)
class SourceLabels:
    """The labels of one source.

    Attributes:
        labeller: Which label column.
        events: How often each label was given, without "null".
        seconds: For how long, without excluded frames; "null" too.
        unknown: Share of frames without a label.
        begin: Delay of the edges at which a label begins; None if there are none to compare.
        end: Delay of the edges at which a label ends; None if there are none to compare.
        empty: Labels in which nothing was felt.
        idle: Share of the labelled frames in which nothing touched.
    """

    labeller: str
    events: dict[str, int]
    seconds: dict[str, float]
    unknown: float
    begin: LabelDelay | None
    end: LabelDelay | None
    empty: int
    idle: float

    def complaints(self) -> list[str]:
        """Return sentences about problems."""
        name, count = self.labeller, sum(self.events.values())
        lines = []
        if name != ASKED:
            lines += [*_delayed(name, "begins", self.begin), *_delayed(name, "ends", self.end)]
        if count >= EDGES and self.empty > EMPTY_SHARE * count:
            lines.append(f"nothing is felt in {self.empty} of {count} gestures that {name} names")
        if name != ASKED and self.idle > IDLE_SHARE:
            lines.append(
                f"nothing touches for {100 * self.idle:.0f} % of the time that {name} names a "
                "gesture"
            )
        return lines


def _delayed(name: str, edge: str, delay: LabelDelay | None) -> Iterator[str]:
    """Yield sentences about a delay that is too long or too irregular."""
    if delay is None or delay.edges < EDGES:
        return
    if abs(delay.median_s) > LATE_S:
        when = "after" if delay.median_s > 0 else "before"
        yield f"{name} usually {edge} {abs(delay.median_s):.2f} s {when} the touch"
    if delay.spread_s > SCATTER_S:
        yield f"{name} {edge} now early, now late: its lag varies by {delay.spread_s:.2f} s"


def summarise(recording: Recording, response: Response) -> tuple[SourceLabels, ...]:
    """Return the labels of each source that gave any."""
    return tuple(
        _one(name, recording, response)
        for name in LABELLERS
        if (getattr(recording, name) != UNKNOWN).any()
    )


def spans(column: NDArray[np.int16], breaks: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """Return (label, first frame, frame after the last) of every gesture that a column names.

    Args:
        column: Index into the labels, 0 is "null", -1 unknown, (n,).
        breaks: Frames that do not go on where the frame before was, (n,).
    """
    edges = np.flatnonzero((np.diff(column) != 0) | breaks[1:]) + 1
    bounds = [0, *edges.tolist(), len(column)]
    return [
        (int(column[first]), first, end) for first, end in pairwise(bounds) if column[first] > 0
    ]


def _one(name: str, recording: Recording, response: Response) -> SourceLabels:
    column: NDArray[np.int16] = getattr(recording, name)
    labels, used = recording.origin.labels, ~recording.excluded
    found = spans(np.where(used, column, 0).astype(np.int16), pauses(recording))
    events = {label: sum(f[0] == i for f in found) for i, label in enumerate(labels) if i}
    each_s = 1.0 / recording.rate_hz
    seconds = {label: each_s * int((used & (column == i)).sum()) for i, label in enumerate(labels)}
    named = used & (column > 0) & response.known
    begin, end, empty = _lags(recording.t, found, response)
    return SourceLabels(
        name,
        events,
        seconds,
        unknown=float((column == UNKNOWN).mean()),
        begin=begin,
        end=end,
        empty=empty,
        idle=float((named & ~response.touched).sum() / max(1, named.sum())),
    )


def _lags(
    t: NDArray[np.float64], found: list[tuple[int, int, int]], response: Response
) -> tuple[LabelDelay | None, LabelDelay | None, int]:
    """Return how late labels begin and end, and how many hold no touch; `t` is (n,) seconds."""
    known = [(first, end) for _, first, end in found if response.known[first]]
    if not known or not response.idle.any():
        return None, None, 0
    energy = response.energy - np.median(response.energy[response.idle])
    # The upper quartile: as many as three in four may be empty.
    usual = float(np.quantile([energy[first:end].max() for first, end in known], 0.75))
    begins, ends, empty = [], [], 0
    for first, end in known:
        low, high = np.searchsorted(t, (t[first] - REACH_S, t[end - 1] + REACH_S)).tolist()
        peak = first + int(energy[first:end].argmax())
        if energy[peak] < EMPTY * usual or usual <= 0.0:
            empty += 1
            continue
        half = HALF * energy[peak]
        before = np.flatnonzero(energy[low:peak] < half)
        after = np.flatnonzero(energy[peak:high] < half)
        if len(before):
            begins.append(t[first] - _crossing(t, energy, low + int(before[-1]), half))
        if len(after):
            frame = peak + int(after[0]) - 1
            ends.append(t[min(end, len(t) - 1)] - _crossing(t, energy, frame, half))
    return _lag(begins), _lag(ends), empty


def _crossing(
    t: NDArray[np.float64], energy: NDArray[np.float64], frame: int, level: float
) -> float:
    """Return when the energy, (n,), passed a level between a frame and the next, seconds."""
    low, high = float(energy[frame]), float(energy[frame + 1])
    share = (level - low) / (high - low) if high != low else 0.0
    return float(t[frame] + share * (t[frame + 1] - t[frame]))


def _lag(lags_s: list[float]) -> LabelDelay | None:
    if not lags_s:
        return None
    early, median, late = np.quantile(lags_s, (0.25, 0.5, 0.75)).tolist()
    return LabelDelay(median, late - early, len(lags_s))
