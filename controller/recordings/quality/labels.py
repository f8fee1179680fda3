"""Label quality: the labels of each source, and their delay against the response of the sensor.

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

REACH_S: Final = 1.5  # greatest distance of a touch's edge from its label's
HALF: Final = 0.5  # share of a touch's energy at its beginning and end
# Below this share of a typical touch's energy, a label holds no touch. Of 1,074 true gestures on
# simulated orbs of both presets, 1 in 50 is weaker.
EMPTY: Final = 0.2
CUE: Final = "cue"  # begins before a gesture and ends after it: its delay means nothing
# With a greater delay, a source labels half of a press (0.5 s: docs/data.md) wrongly.
LATE_S: Final = 0.3
SCATTER_S: Final = 0.5  # for the middle half of the delays
EDGES: Final = 5  # least number of edges for a delay
EMPTY_SHARE: Final = 0.15  # allowed share of empty gestures
IDLE_SHARE: Final = 0.7  # allowed share of untouched time; a noisy orb misses the rims


@dataclass(frozen=True, slots=True)
class LabelDelay:
    """Delay of the edges of labels against the touch, seconds; below zero is early.

    Attributes:
        spread_s: Interquartile range.
        edges: Number of edges.
    """

    median_s: float
    spread_s: float
    edges: int


@dataclass(frozen=True, slots=True)
class SourceLabels:
    """The labels of one source.

    Attributes:
        labeller: The label column.
        events: Number of times of each label, without "null".
        seconds: Duration of each label, without excluded frames; includes "null".
        unknown: Share of frames without a label.
        begin: Delay of the beginnings; None if there are none to compare.
        end: Delay of the ends; None if there are none to compare.
        empty: Number of labels without a touch.
        idle: Share of untouched frames among the labelled ones.
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
        if name != CUE:
            lines += [*_delayed(name, "begins", self.begin), *_delayed(name, "ends", self.end)]
        if count >= EDGES and self.empty > EMPTY_SHARE * count:
            lines.append(f"nothing is felt in {self.empty} of {count} gestures that {name} names")
        if name != CUE and self.idle > IDLE_SHARE:
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
    """Return the labels of each source with any."""
    return tuple(
        _one(name, recording, response)
        for name in LABELLERS
        if (getattr(recording, name) != UNKNOWN).any()
    )


def spans(column: NDArray[np.int16], breaks: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """Return (label, first frame, frame after the last) of every gesture in a column.

    Args:
        column: Index into the labels, 0 is "null", -1 unknown, (n,).
        breaks: Whether each frame follows a pause, (n,).
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
    """Return the delays of begin and end, and the number of empty labels; `t` is (n,) seconds."""
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
    """Return the time, seconds, of the energy, (n,), at a level between a frame and the next."""
    low, high = float(energy[frame]), float(energy[frame + 1])
    share = (level - low) / (high - low) if high != low else 0.0
    return float(t[frame] + share * (t[frame + 1] - t[frame]))


def _lag(lags_s: list[float]) -> LabelDelay | None:
    if not lags_s:
        return None
    early, median, late = np.quantile(lags_s, (0.25, 0.5, 0.75)).tolist()
    return LabelDelay(median, late - early, len(lags_s))
