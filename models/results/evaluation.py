"""Results of an evaluation and a tuning, as plain values for cards, reports and JSON.

Figures carry 95 % intervals over whole sessions (models/evaluation/bootstrap.py). NaN is a figure
that is not known; in JSON it is null. Locations are in grid units, errors are means over the
two axes.
"""

import math
from dataclasses import dataclass
from typing import Any

from controller.recognition.debounce import DebounceSettings
from models.results.figure import Figure


@dataclass(frozen=True, slots=True)
class ClassFigures:
    """Figures of one gesture by the event metric (controller/recognition/event_metric.py).

    Attributes:
        label: Its name.
        events: Number of its events.
        recall: Share of these that were answered rightly.
        precision: Share of the answers with its name that were right.
        named: Share of its events that the mean probability names rightly.
    """

    label: str
    events: int
    recall: Figure
    precision: Figure
    named: Figure


@dataclass(frozen=True, slots=True)
class LocationFigures:
    """Position errors: one estimate per press, its last.

    Attributes:
        error: Mean over the presses.
        on_site: Mean over those within a quarter pitch of a taxel.
        off_site: Mean over all others.
        half_within: Median over the presses.
        most_within: 95th percentile.
        touches: x, y, error in x, error in y of each press.
        sigma: Median standard deviation that the bundle gives; NaN: it gives none.
        within_one: Share of errors, over both axes, below the deviation given; 68 % if calibrated.
        within_two: Share below twice that; 95 % if calibrated.
    """

    error: Figure
    on_site: Figure
    off_site: Figure
    half_within: float
    most_within: float
    touches: tuple[tuple[float, float, float, float], ...]
    sigma: float = math.nan
    within_one: float = math.nan
    within_two: float = math.nan


@dataclass(frozen=True, slots=True)
class Row:
    """The same figures for one session or one user.

    Attributes:
        name: Of the session or user.
        sessions: Number of them.
        events: True gestures.
        f1: Of the event metric.
        event_accuracy: Share of events that the mean probability names rightly.
        frame_accuracy: Share of frames named rightly.
        false_alarms_per_min: In idle time.
        latency_s: Median from onset.
        location_error: Mean over the presses.
    """

    name: str
    sessions: int
    events: int
    f1: float
    event_accuracy: float
    frame_accuracy: float
    false_alarms_per_min: float
    latency_s: float
    location_error: float


@dataclass(frozen=True, slots=True)
class Calibration:
    """Calibration of probabilities.

    Attributes:
        error: Expected calibration error, over frames.
        bins: (mean confidence, share of right, frames) of ten equal ranges of confidence.
    """

    error: float
    bins: tuple[tuple[float, float, int], ...]


@dataclass(frozen=True, slots=True)
class Result:
    """Figures of a bundle on one set of sessions.

    Attributes:
        name: Of the set: a preset, a folder.
        labels: Classes, "null" first.
        sessions: Number of them.
        users: Number of them.
        events: True gestures.
        minutes: Their length.
        idle_minutes: Time in which no gesture lasts or may still be answered.
        f1: Harmonic mean of precision and recall of the event metric.
        precision: Right answers among all answers.
        recall: Events that were answered rightly.
        missed: Share of events without any answer.
        wrong: Answers with another name, per event.
        duplicates: Repeated right answers, per event.
        false_alarms_per_min: Answers to nothing, per idle minute.
        latency_s: Median time of a right answer after the onset.
        latency_p95_s: 95 % are faster.
        contact_latency_s: The same after the first contact, to a frame; NaN: not known.
        contact_latency_p95_s: 95 % are faster.
        event_accuracy: Share of events that the mean probability names rightly, null aside.
        new_user_accuracy: The same, its interval over users instead of sessions.
        frame_accuracy: Share of frames named rightly, mean over the sessions.
        turn_accuracy: The same inside twists, two frames from their edges; NaN: there are none.
        answered: Events (rows; 0: nothing happened) by what was answered (columns; 0: nothing).
        named: Events by what the mean probability names.
        classes: Every gesture.
        calibration: Of the probabilities.
        location: None if the bundle gives no positions, or the true ones are not known.
        by_session: Every session.
        by_user: Every user.
    """

    name: str
    labels: tuple[str, ...]
    sessions: int
    users: int
    events: int
    minutes: float
    idle_minutes: float
    f1: Figure
    precision: Figure
    recall: Figure
    missed: Figure
    wrong: Figure
    duplicates: Figure
    false_alarms_per_min: Figure
    latency_s: Figure
    latency_p95_s: float
    contact_latency_s: Figure
    contact_latency_p95_s: float
    event_accuracy: Figure
    new_user_accuracy: Figure
    frame_accuracy: Figure
    turn_accuracy: Figure
    answered: tuple[tuple[int, ...], ...]
    named: tuple[tuple[int, ...], ...]
    classes: tuple[ClassFigures, ...]
    calibration: Calibration
    location: LocationFigures | None
    by_session: tuple[Row, ...] = ()
    by_user: tuple[Row, ...] = ()


@dataclass(frozen=True, slots=True)
class Broken:
    """Figures of a bundle under a fault.

    Attributes:
        on: Name of the set of sessions.
        fault: As in controller/simulator/faults.py: "dead:2,3".
        meaning: In words.
        events: True gestures.
        event_accuracy: Share that the mean probability names rightly.
        f1: Of the event metric.
        false_alarms_per_min: In idle time.
        location_error: Mean over the presses; NaN: unknown.
    """

    on: str
    fault: str
    meaning: str
    events: int
    event_accuracy: Figure
    f1: Figure
    false_alarms_per_min: Figure
    location_error: float


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Results of `models evaluate`.

    Attributes:
        bundle: Its file name.
        hash: SHA-256 of the bundle.
        card: Card inside the bundle.
        command: Command line.
        labels: Classes, "null" first.
        debounce: Debounce settings by name.
        results: One for each set of sessions.
        broken: One for each fault that was tried.
        notes: Further remarks, in sentences.
        rows: Of the sensor; 5 in files of older versions.
        columns: Of the sensor.
    """

    bundle: str
    hash: str
    card: dict[str, Any]
    command: str
    labels: tuple[str, ...]
    debounce: dict[str, float]
    results: tuple[Result, ...]
    broken: tuple[Broken, ...] = ()
    notes: tuple[str, ...] = ()
    rows: int = 5
    columns: int = 5


@dataclass(frozen=True, slots=True)
class Point:
    """Performance at one choice of the debouncer's settings.

    Attributes:
        settings: The choice.
        recall: Events that are answered rightly.
        f1: Of the event metric.
        false_alarms_per_min: Answers to nothing, per idle minute.
        latency_s: Median, from onset.
    """

    settings: DebounceSettings
    recall: float
    f1: float
    false_alarms_per_min: float
    latency_s: float


@dataclass(frozen=True, slots=True)
class Tuning:
    """Results of `models tune`.

    Attributes:
        bundle: File name of the bundle that was tuned.
        sessions: Number of streams.
        events: True gestures in them.
        idle_minutes: Time without any.
        before: The bundle's own point.
        chosen: The point that was written.
        front: Points that no other beats in recall, false alarms and latency together,
            the fastest first.
        tried: Number of points.
        goal: The rule of the choice, a sentence.
        command: Command line.
    """

    bundle: str
    sessions: int
    events: int
    idle_minutes: float
    before: Point
    chosen: Point
    front: tuple[Point, ...]
    tried: int
    goal: str
    command: str = ""
