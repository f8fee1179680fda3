"""Figures with 95 % intervals of many sessions that were played through a bundle."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.debounce import NULL
from controller.recordings import reader
from controller.recordings.recording import Recording
from controller.shared.aliases import Say
from controller.shared.errors import count
from models.data.examples import SAID, Choice
from models.data.ground_truth import GroundTruth
from models.data.load import Data
from models.data.splits import Split
from models.evaluation import bootstrap, scores
from models.evaluation.event_counts import Counts, Tally, tally
from models.evaluation.replay import run
from models.results import verdict
from models.results.evaluation import Calibration, ClassFigures, LocationFigures, Result, Row
from models.results.verdict import REASONS


def evaluate(
    bundle: Bundle,
    recordings: Iterable[tuple[str, Recording]],
    say: Say,
    choice: Choice = "auto",
    left_out: list[str] | None = None,
) -> list[Tally]:
    """Replay named recordings through a bundle, one after the other, and count.

    Args:
        bundle: The bundle.
        recordings: Of its sensor, with labels; else a ValueError is raised, or the recording is
            added to `left_out`, with the reason.
        say: Takes a line for each.
        choice: Source of the labels that count.
        left_out: Takes a sentence for each recording that cannot be judged; None: none may be.
    """
    networks, labels = Recognizer(bundle), bundle.labels
    tallies = []
    for name, recording in recordings:
        try:
            truth = GroundTruth.of(recording, labels, name, choice)
            stream = run(bundle, networks, recording, truth)
        except ValueError as error:
            if left_out is None:
                raise
            left_out.append(f"{name} is left out: {error}")
            say(left_out[-1])
            continue
        tallies.append(tally(stream, labels))
        say(f"{name}: {tallies[-1].hits} of {count(tallies[-1].events, 'event')}")
    if left_out and not tallies:
        raise ValueError("; ".join(["there is nothing to judge", *left_out[:SAID]]))
    return tallies


def summarise(name: str, labels: Sequence[str], tallies: Sequence[Tally]) -> Result:
    """Return the figures of a named set of sessions, one tally each, resampled by session."""
    events, hits = [t.events for t in tallies], [t.hits for t in tallies]
    answers = [int(t.answers.sum()) for t in tallies]
    idle = [t.idle_minutes for t in tallies]
    latencies = [t.latencies_s for t in tallies]
    contacts = [t.contact_latencies_s for t in tallies]
    users = sorted({t.user for t in tallies})
    answered = _total([t.answered for t in tallies])
    groups = [[t for t in tallies if t.user == user] for user in users]
    return Result(
        name=name,
        labels=tuple(labels),
        sessions=len(tallies),
        users=len(users),
        events=sum(events),
        minutes=sum(t.minutes for t in tallies),
        idle_minutes=sum(idle),
        f1=bootstrap.f1(hits, answers, events),
        precision=bootstrap.share(hits, answers),
        recall=bootstrap.share(hits, events),
        missed=bootstrap.share([int(t.answered[1:, 0].sum()) for t in tallies], events),
        wrong=bootstrap.rate([t.wrong for t in tallies], events),
        duplicates=bootstrap.rate([t.duplicates for t in tallies], events),
        false_alarms_per_min=bootstrap.rate([t.false_alarms for t in tallies], idle),
        latency_s=bootstrap.median(latencies),
        latency_p95_s=_p95(latencies),
        contact_latency_s=bootstrap.median(contacts),
        contact_latency_p95_s=_p95(contacts),
        event_accuracy=bootstrap.share([t.recognised for t in tallies], events),
        new_user_accuracy=bootstrap.share(
            [sum(t.recognised for t in group) for group in groups],
            [sum(t.events for t in group) for group in groups],
        ),
        frame_accuracy=bootstrap.mean([np.array([bootstrap.ratio(*t.frames)]) for t in tallies]),
        answered=answered,
        classes=tuple(_class(i, label, tallies) for i, label in enumerate(labels) if i != NULL),
        calibration=_calibration(tallies),
        location=_location(tallies),
        by_session=tuple(_row(t.name, [t]) for t in tallies),
        by_user=tuple(_row(u or "unknown", g) for u, g in zip(users, groups, strict=True)),
        verdict=verdict.judge(labels, answered, _total([t.unanswered for t in tallies])),
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
    places = [t.places for t in tallies]
    if not sum(map(len, places)):
        return None
    errors = [np.abs(one[:, 2:]).mean(axis=1) for one in places]
    away = [scores.between_taxels(one[:, :2]) for one in places]
    half, most = np.quantile(np.concatenate(errors), (0.5, 0.95)).tolist()
    sigmas = np.concatenate([t.sigmas for t in tallies])
    one, two = scores.within(sigmas, np.concatenate(places)[:, 2:])
    return LocationFigures(
        bootstrap.mean(errors),
        bootstrap.mean([e[~a] for e, a in zip(errors, away, strict=True)]),
        bootstrap.mean([e[a] for e, a in zip(errors, away, strict=True)]),
        half,
        most,
        float(np.nanmedian(sigmas)) if np.isfinite(sigmas).any() else np.nan,
        one,
        two,
    )


def _row(name: str, tallies: Sequence[Tally]) -> Row:
    """Return the same figures of some of the sessions, without intervals."""
    events, hits = sum(t.events for t in tallies), sum(t.hits for t in tallies)
    answers = sum(int(t.answers.sum()) for t in tallies)
    latencies = np.concatenate([t.latencies_s for t in tallies])
    places = np.concatenate([t.places for t in tallies])
    return Row(
        name,
        len(tallies),
        events,
        bootstrap.ratio(2 * hits, answers + events),
        bootstrap.ratio(sum(t.recognised for t in tallies), events),
        float(np.mean([bootstrap.ratio(*t.frames) for t in tallies])),
        bootstrap.ratio(sum(t.false_alarms for t in tallies), sum(t.idle_minutes for t in tallies)),
        float(np.median(latencies)) if len(latencies) else np.nan,
        float(np.abs(places[:, 2:]).mean()) if len(places) else np.nan,
    )


def _p95(lists: Sequence[NDArray[np.float64]]) -> float:
    """Return the 95th percentile of the values of all sessions, (values,) each."""
    together = np.concatenate(lists)
    return float(np.quantile(together, 0.95)) if len(together) else np.nan


def _total(matrices: Sequence[Counts]) -> tuple[tuple[int, ...], ...]:
    """Return the sum of tables of counts, all of one shape."""
    return tuple(map(tuple, np.sum(matrices, axis=0).tolist()))


def replay_held_out(
    loaded: Bundle, data: Data, split: Split
) -> tuple[tuple[tuple[int, ...], ...], tuple[tuple[int, ...], ...]]:
    """Return the gestures held out of a training by what its bundle answers, and why not.

    The first table is (classes, classes), the second, of those without an answer by reason,
    (classes, `REASONS`). A network may name every gesture rightly while the device misses some: it
    answers only where the probability rises high enough, and soon enough. Row and column 0 are
    nothing. Recordings with gestures that the bundle does not answer are left out.
    """
    networks, labels = Recognizer(loaded), loaded.labels
    answered = np.zeros((len(labels), len(labels)), dtype=np.int64)
    unanswered = np.zeros((len(labels), len(REASONS)), dtype=np.int64)
    for number, recording in _held(data, split):
        row = data.rows[number]
        if any(count for label, count in row.examples.items() if label not in labels):
            continue
        truth = GroundTruth.of(recording, labels, row.path, cast(Choice, row.labeller))
        found = tally(run(loaded, networks, recording, truth), labels)
        answered += found.answered
        unanswered += found.unanswered
    return _total([answered]), _total([unanswered])


def _held(data: Data, split: Split) -> Iterator[tuple[int, Recording]]:
    """Yield number and recording of what is held out; of an end, all before it is excluded."""
    examples = data.examples
    ends = examples.ends[split.windows.check]
    for number in np.unique(examples.session[ends]).tolist():
        recording = reader.load(Path(data.rows[number].path))
        if not split.held[number]:
            own = np.flatnonzero(examples.session == number)
            first = ends[examples.session[ends] == number].min() - examples.window + 1
            # Examples lack some of the frames, so as many of the last ones are none too early.
            excluded = recording.excluded.copy()
            excluded[: -int((own >= first).sum())] = True
            recording = replace(recording, excluded=excluded)
        yield number, recording
