"""Figures with 95 % intervals of many sessions that were played through a bundle."""

from collections.abc import Callable, Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.console import count
from controller.recognition.debounce import NULL
from controller.recordings.recording import Recording
from models.data import faults
from models.data.examples import Choice
from models.data.ground_truth import know
from models.evaluation import bootstrap, position_error, scores
from models.evaluation.event_counts import Counts, Tally, tally
from models.evaluation.replay import Batched, answered, feel, refuse, run
from models.results.evaluation import (
    Broken,
    Calibration,
    ClassFigures,
    LocationFigures,
    Result,
    Row,
)

ON_SITE: Final = 0.25  # grid units from a taxel, the finger's aim being no better

Say = Callable[[str], None]


def evaluate(
    bundle: Bundle,
    recordings: Iterable[tuple[str, Recording]],
    say: Say,
    choice: Choice = "auto",
    *,
    located: bool = True,
) -> list[Tally]:
    """Play named recordings through a bundle, and count.

    Args:
        bundle: The bundle.
        recordings: One after the other; none is kept.
        say: Takes a line for each.
        choice: Whose labels count.
        located: Places are asked for as well.

    Raises:
        ValueError: A recording is of another sensor, or nobody said what happened in it.
    """
    networks, labels = Batched(bundle), bundle.labels
    tallies = []
    for name, recording in recordings:
        known = know(recording, labels, name, choice)
        if located:
            stream = run(bundle, networks, recording, known)
        else:
            refuse(recording, bundle)
            felt = feel(recording.frames, bundle.preprocess)
            answers = networks.probabilities(felt.windows)
            stream = answered(known, felt, answers, labels, bundle.debounce)
        tallies.append(tally(stream, labels))
        say(f"{name}: {tallies[-1].hits} of {count(tallies[-1].events, 'event')}")
    return tallies


def summarise(name: str, labels: Sequence[str], tallies: Sequence[Tally]) -> Result:
    """Return the figures of a set of sessions, resampled by session.

    Args:
        name: Of the set.
        labels: The bundle's, "null" first.
        tallies: One a session; at least one.
    """
    answered = np.sum([t.answered for t in tallies], axis=0)
    named = np.sum([t.named for t in tallies], axis=0)
    events, hits = [t.events for t in tallies], [t.hits for t in tallies]
    spoken = [int(t.answers.sum()) for t in tallies]
    recognised = [t.recognised for t in tallies]
    idle = [t.idle_minutes for t in tallies]
    missed = [int(t.answered[1:, 0].sum()) for t in tallies]
    latencies = [t.latencies_s for t in tallies]
    contacts = [t.contact_latencies_s for t in tallies]
    users = sorted({t.user for t in tallies})
    groups = [[t for t in tallies if t.user == user] for user in users]
    return Result(
        name=name,
        labels=tuple(labels),
        sessions=len(tallies),
        users=len(users),
        events=sum(events),
        minutes=sum(t.minutes for t in tallies),
        idle_minutes=sum(idle),
        f1=bootstrap.f1(hits, spoken, events),
        precision=bootstrap.share(hits, spoken),
        recall=bootstrap.share(hits, events),
        missed=bootstrap.share(missed, events),
        wrong=bootstrap.rate([t.wrong for t in tallies], events),
        duplicates=bootstrap.rate([t.duplicates for t in tallies], events),
        false_alarms_per_min=bootstrap.rate([t.false_alarms for t in tallies], idle),
        latency_s=bootstrap.median(latencies),
        latency_p95_s=_quantile(latencies),
        contact_latency_s=bootstrap.median(contacts),
        contact_latency_p95_s=_quantile(contacts),
        event_accuracy=bootstrap.share(recognised, events),
        new_user_accuracy=bootstrap.share(
            [sum(t.recognised for t in group) for group in groups],
            [sum(t.events for t in group) for group in groups],
        ),
        frame_accuracy=bootstrap.mean([np.array([_ratio(*t.frames)]) for t in tallies]),
        turn_accuracy=bootstrap.share(*np.array([t.turns for t in tallies]).T),
        answered=_table(answered),
        named=_table(named),
        classes=tuple(_class(i, label, tallies) for i, label in enumerate(labels) if i != NULL),
        calibration=_calibration(tallies),
        location=_location(tallies),
        by_session=tuple(_row(t.name, [t]) for t in tallies),
        by_user=tuple(_row(u or "unknown", g) for u, g in zip(users, groups, strict=True)),
    )


def summarise_broken(
    on: str, fault: str, labels: Sequence[str], tallies: Sequence[Tally]
) -> Broken:
    """Return the figures of a set of sessions on which something is broken.

    Args:
        on: Name of the set.
        fault: What is broken.
        labels: The bundle's, "null" first.
        tallies: One a session; at least one.
    """
    found = summarise(on, labels, tallies)
    return Broken(
        on,
        fault,
        faults.meaning(fault),
        found.events,
        found.event_accuracy,
        found.f1,
        found.false_alarms_per_min,
        found.location.error.value if found.location else np.nan,
    )


def _class(number: int, label: str, tallies: Sequence[Tally]) -> ClassFigures:
    events = [int(t.answered[number].sum()) for t in tallies]
    hits = [int(t.answered[number, number]) for t in tallies]
    return ClassFigures(
        label,
        sum(events),
        bootstrap.share(hits, events),
        bootstrap.share(hits, [int(t.answers[number]) for t in tallies]),
        bootstrap.share([int(t.named[number, number]) for t in tallies], events),
    )


def _calibration(tallies: Sequence[Tally]) -> Calibration:
    probabilities = np.concatenate([t.sure[0] for t in tallies])
    label = np.concatenate([t.sure[1] for t in tallies])
    found = scores.calibration(np.log(np.maximum(probabilities, 1e-12)), label, 1.0)
    return Calibration(found.error_after, found.bins)


def _location(tallies: Sequence[Tally]) -> LocationFigures | None:
    each = [np.abs(t.places[:, 2:]).mean(axis=1) for t in tallies]
    all_ = np.concatenate(each)
    if not len(all_):
        return None
    off = [np.abs(t.places[:, :2] - np.rint(t.places[:, :2])) for t in tallies]
    away = [one.max(axis=1) > ON_SITE for one in off]
    half, most = np.quantile(all_, (0.5, 0.95)).tolist()
    sigmas = np.concatenate([t.sigmas for t in tallies])
    one, two = position_error.within(sigmas, np.concatenate([t.places[:, 2:] for t in tallies]))
    return LocationFigures(
        bootstrap.mean(each),
        bootstrap.mean([e[~a] for e, a in zip(each, away, strict=True)]),
        bootstrap.mean([e[a] for e, a in zip(each, away, strict=True)]),
        half,
        most,
        tuple((float(a), float(b), float(c), float(d)) for t in tallies for a, b, c, d in t.places),
        float(np.nanmedian(sigmas)) if np.isfinite(sigmas).any() else np.nan,
        one,
        two,
    )


def _row(name: str, tallies: Sequence[Tally]) -> Row:
    """Return the same figures of some of the sessions, without intervals."""
    events, hits = sum(t.events for t in tallies), sum(t.hits for t in tallies)
    spoken = sum(int(t.answers.sum()) for t in tallies)
    latencies = np.concatenate([t.latencies_s for t in tallies])
    places = np.concatenate([t.places for t in tallies])
    return Row(
        name,
        len(tallies),
        events,
        _ratio(2 * hits, spoken + events),
        _ratio(sum(t.recognised for t in tallies), events),
        float(np.mean([_ratio(*t.frames) for t in tallies])),
        _ratio(sum(t.false_alarms for t in tallies), sum(t.idle_minutes for t in tallies)),
        float(np.median(latencies)) if len(latencies) else np.nan,
        float(np.abs(places[:, 2:]).mean()) if len(places) else np.nan,
    )


def _quantile(lists: Sequence[NDArray[np.float64]]) -> float:
    together = np.concatenate(lists)
    return float(np.quantile(together, 0.95)) if len(together) else np.nan


def _table(matrix: Counts) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(int(count) for count in row) for row in matrix)


def _ratio(top: float, bottom: float) -> float:
    return float(top / bottom) if bottom else np.nan
