"""Results of an evaluation and a tuning, as plain values for cards, reports and JSON.

Figures carry 95 % intervals over whole sessions (models/evaluation/bootstrap.py). NaN is a figure
that is not known; in JSON it is null. Locations are in grid units, errors are means over the
two axes.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any

from controller.recognition.debounce import DebounceSettings
from models.results.verdict import Verdict


def numbers(settings: DebounceSettings) -> dict[str, float]:
    """Return the debounce settings that are numbers, by name."""
    return {name: one for name, one in asdict(settings).items() if isinstance(one, float)}


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure and its 95 % interval; the bounds are NaN where there is but one session."""

    value: float  # the figure over all sessions
    low: float  # lower bound
    high: float  # upper bound

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        """Return it for a table, such as "0.9977 (0.9961–0.9989)"."""
        if math.isnan(self.low):
            return f"{self.value:.4f}"
        return f"{self.value:.4f} ({self.low:.4f}–{self.high:.4f})"


@dataclass(frozen=True, slots=True)
class ClassFigures:
    """Figures of one gesture by the event metric (controller/shared/event_metric.py)."""

    label: str  # its name
    events: int  # number of its events
    recall: Figure  # share of these that were answered rightly
    precision: Figure  # share of the answers with its name that were right
    named: Figure  # share of its events that the mean probability names rightly


@dataclass(frozen=True, slots=True)
class LocationFigures:
    """Position errors: one estimate per press, its last."""

    error: Figure  # mean over the presses
    on_site: Figure  # mean over those within a quarter pitch of a taxel
    off_site: Figure  # mean over all others
    half_within: float  # median over the presses
    most_within: float  # 95th percentile
    sigma: float = math.nan  # median standard deviation that the bundle gives; NaN: it gives none
    # share of errors, over both axes, below the deviation given; 68 % if calibrated
    within_one: float = math.nan
    within_two: float = math.nan  # share below twice that; 95 % if calibrated


@dataclass(frozen=True, slots=True)
class Row:
    """The same figures for one session or one user."""

    name: str  # of the session or user
    sessions: int  # number of them
    events: int  # true gestures
    f1: float  # of the event metric
    event_accuracy: float  # share of events that the mean probability names rightly
    frame_accuracy: float  # share of frames named rightly
    false_alarms_per_min: float  # in idle time
    latency_s: float  # median from onset
    location_error: float  # mean over the presses


@dataclass(frozen=True, slots=True)
class Calibration:
    """Calibration of probabilities."""

    error: float  # expected calibration error, over frames
    # (mean confidence, share of right, frames) of ten equal ranges of confidence
    bins: tuple[tuple[float, float, int], ...]


@dataclass(frozen=True, slots=True)
class Result:
    """Figures of a bundle on one set of sessions."""

    name: str  # of the set: a preset, a folder
    labels: tuple[str, ...]  # classes, "null" first
    sessions: int  # number of them
    users: int  # number of them
    events: int  # true gestures
    minutes: float  # their length
    idle_minutes: float  # time in which no gesture lasts or may still be answered
    f1: Figure  # harmonic mean of precision and recall of the event metric
    precision: Figure  # right answers among all answers
    recall: Figure  # events that were answered rightly
    missed: Figure  # share of events without any answer
    wrong: Figure  # answers with another name, per event
    duplicates: Figure  # repeated right answers, per event
    false_alarms_per_min: Figure  # answers to nothing, per idle minute
    latency_s: Figure  # median time of a right answer after the onset
    latency_p95_s: float  # 95 % are faster
    contact_latency_s: Figure  # the same after the first contact, to a frame; NaN: not known
    contact_latency_p95_s: float  # 95 % are faster
    event_accuracy: Figure  # share of events that the mean probability names rightly, null aside
    new_user_accuracy: Figure  # the same, its interval over users instead of sessions
    frame_accuracy: Figure  # share of frames named rightly, mean over the sessions
    # events (rows; 0: nothing happened) by what was answered (columns; 0: nothing)
    answered: tuple[tuple[int, ...], ...]
    classes: tuple[ClassFigures, ...]  # every gesture
    calibration: Calibration  # of the probabilities
    # None if the bundle gives no positions, or the true ones are not known
    location: LocationFigures | None
    by_session: tuple[Row, ...] = ()  # every session
    by_user: tuple[Row, ...] = ()  # every user
    verdict: Verdict = ()  # on every gesture, the worst first


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Results of `models evaluate`."""

    bundle: str  # its file name
    hash: str  # SHA-256 of the bundle
    card: dict[str, Any]  # card inside the bundle
    command: str  # command line
    labels: tuple[str, ...]  # classes, "null" first
    debounce: dict[str, float]  # debounce settings by name
    results: tuple[Result, ...]  # one for each set of sessions
    notes: tuple[str, ...] = ()  # further remarks, in sentences


@dataclass(frozen=True, slots=True)
class Point:
    """Performance at one choice of the debouncer's settings."""

    settings: DebounceSettings  # the choice
    recall: float  # events that are answered rightly
    f1: float  # of the event metric
    false_alarms_per_min: float  # answers to nothing, per idle minute
    latency_s: float  # median, from onset


@dataclass(frozen=True, slots=True)
class Tuning:
    """Choice of the debounce settings by `models train --epochs 0`."""

    sessions: int  # number of streams
    events: int  # true gestures in them
    before: Point  # the bundle's own point
    chosen: Point  # the point that was written
    # points that no other beats in recall, false alarms and latency together, the fastest first
    front: tuple[Point, ...]
    tried: int  # number of points
