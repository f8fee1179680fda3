"""Counts of one session: events and answers, latencies, probabilities, and positions."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.recognition.debounce import NULL
from controller.recordings.recording import UNKNOWN
from controller.shared.aliases import Index
from controller.shared.event_metric import LIGHT, RIVAL, SHORT_S, TAIL_S, Answer, Event, attach
from models.data.ground_truth import GroundTruth
from models.evaluation.replay import Stream
from models.results.verdict import REASONS

Counts = NDArray[np.int64]  # (classes, classes)


@dataclass(frozen=True, slots=True, eq=False)
class Tally:
    """Counts of one session."""

    name: str  # of the session
    user: str  # identity of the user
    minutes: float  # its length
    idle_minutes: float  # time in which no gesture lasts or may still be answered
    answered: Counts  # events (rows; 0: nothing) by answer (columns; 0: nothing)
    named: Counts  # events by class of the mean probability
    unanswered: Counts  # events without an answer by reason, (classes, REASONS)
    answers: Index  # answers of each gesture, (classes,)
    wrong: int  # answers with another name than the event's
    duplicates: int  # right answers again
    latencies_s: NDArray[np.float64]  # from onset, of each right answer
    contact_latencies_s: NDArray[np.float64]  # the same from first contact, where it is known
    frames: tuple[int, int]  # (right, all) frames
    # probabilities of the frames whose class is known, and that class
    sure: tuple[NDArray[np.float32], Index]
    places: NDArray[np.float64]  # x, y, error in x, error in y of each press
    # standard deviation given with each of them, grid units, NaN where none was
    sigmas: NDArray[np.float64]

    @property
    def events(self) -> int:
        """Number of true gestures."""
        return int(self.answered[1:].sum())

    @property
    def hits(self) -> int:
        """Number of them that were answered rightly."""
        return int(np.trace(self.answered[1:, 1:]))

    @property
    def recognised(self) -> int:
        """Number of them that the mean probability names rightly."""
        return int(np.trace(self.named[1:, 1:]))

    @property
    def false_alarms(self) -> int:
        """Answers to nothing."""
        return int(self.answered[0].sum())


def tally(stream: Stream, labels: Sequence[str]) -> Tally:
    """Count one session."""
    truth, classes = stream.truth, len(labels)
    number = {label: i for i, label in enumerate(labels)}
    answers = [a for a in stream.answers if not truth.excluded[_frame(truth, a.time_s)]]
    answered, named = np.zeros((2, classes, classes), dtype=np.int64)
    got, counts = _matched(truth, answers, answered, number)
    unanswered = np.zeros((classes, len(REASONS)), dtype=np.int64)
    for event, kind in zip(truth.events, got, strict=True):
        answered[number[event.kind], kind] += 1
        if kind == NULL:
            unanswered[number[event.kind], _reason(stream, event)] += 1
        named[number[event.kind], _name(stream, event)] += 1
    use = (truth.label != UNKNOWN) & ~truth.excluded
    right = stream.probabilities.argmax(axis=1) == truth.label
    step_min = 1.0 / truth.rate_hz / 60.0 if len(truth.t) > 1 else 0.0
    idle = stream.ready & ~truth.excluded & ~_attached(truth)
    sure = use & stream.ready
    return Tally(
        truth.name,
        truth.user,
        len(truth.t) * step_min,
        int(idle.sum()) * step_min,
        answered,
        named,
        unanswered,
        np.bincount([number[a.kind] for a in answers], minlength=classes).astype(np.int64),
        *counts,
        (int(right[use].sum()), int(use.sum())),
        (stream.probabilities[sure], truth.label[sure]),
        *_places(stream),
    )


_Matches = tuple[int, int, NDArray[np.float64], NDArray[np.float64]]


def _matched(
    truth: GroundTruth, answers: Sequence[Answer], answered: Counts, number: Mapping[str, int]
) -> tuple[list[int], _Matches]:
    """Return the answer to each event, and counts: wrong, duplicates, latencies, after contact.

    False alarms are added to the first row of `answered`, (classes, classes).
    """
    got = [0] * len(truth.events)
    wrong = duplicates = 0
    latencies, contacts = [], []
    for answer, owner in zip(answers, attach(truth.events, answers), strict=True):
        kind = number[answer.kind]
        if owner < 0:
            answered[0, kind] += 1
        elif answer.kind != truth.events[owner].kind:
            wrong += 1
            got[owner] = got[owner] or kind
        elif got[owner] == kind:
            duplicates += 1
        else:
            got[owner] = kind
            latencies.append(answer.time_s - truth.events[owner].onset_s)
            contacts.append(answer.time_s - truth.contact_s[owner])
    after = np.array([late for late in contacts if np.isfinite(late)])
    return got, (wrong, duplicates, np.array(latencies), after)


def _frame(truth: GroundTruth, time_s: float) -> int:
    return min(int(np.searchsorted(truth.t, time_s)), len(truth.t) - 1)


def _between(truth: GroundTruth, event: Event) -> slice:
    """Return the frames in which a gesture lasts: at least one, the next after its onset."""
    first, end = np.searchsorted(truth.t, (event.onset_s, event.release_s))
    return slice(int(first), int(max(end, first + 1)))


def _name(stream: Stream, event: Event) -> int:
    """Return the class of the mean probability over an event, null aside; 0: no frame is ready."""
    frames = _between(stream.truth, event)
    if not stream.ready[frames].any():
        return NULL
    return NULL + 1 + int(stream.probabilities[frames, NULL + 1 :].mean(axis=0).argmax())


def _reason(stream: Stream, event: Event) -> int:
    """Return why an event has no answer: a position in `REASONS`, as the host's panel gives it."""
    probabilities = stream.probabilities[_between(stream.truth, event)]
    *_, second, first = np.sort(np.append(0.0, probabilities[:, NULL + 1 :].max(axis=0)))
    if 1.0 - probabilities[:, NULL].min() < LIGHT:
        reason = "too light"
    elif second > RIVAL * first:
        reason = "undecided"
    else:
        reason = "too short" if event.release_s - event.onset_s < SHORT_S else "unclear"
    return list(REASONS).index(reason)


def _attached(truth: GroundTruth) -> NDArray[np.bool_]:
    """Return the frames in which an answer would belong to a gesture, (n,)."""
    within = np.zeros(len(truth.t), dtype=np.bool_)
    for event in truth.events:
        within |= (truth.t >= event.onset_s) & (truth.t <= event.release_s + TAIL_S)
    return within


def position_errors(stream: Stream) -> NDArray[np.float64]:
    """Return sigma, error in x and in y of each frame of every press, grid units, (frames, 3)."""
    rows = [
        np.column_stack([stream.sigmas[frames], stream.touches[frames] - place])
        for place, frames in _presses(stream)
    ]
    return np.concatenate(rows) if rows else np.empty((0, 3))


def _places(stream: Stream) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the last estimate of each press: x, y and errors, (presses, 4); sigma, (presses,)."""
    rows = [
        (*place, *(stream.touches[frames[-1]] - place), stream.sigmas[frames[-1]])
        for place, frames in _presses(stream)
    ]
    found = np.array(rows, dtype=np.float64).reshape(-1, 5)
    return found[:, :4], found[:, 4]


def _presses(stream: Stream) -> Iterator[tuple[NDArray[np.float64], Index]]:
    """Yield the true position of each press, (2,), and the frames with an estimate, (frames,)."""
    for event in stream.truth.events:
        frames = _between(stream.truth, event)
        place = stream.truth.place[frames]
        located = frames.start + np.flatnonzero(np.isfinite(stream.touches[frames, 0]))
        if np.isfinite(place[:, 0]).any() and len(located):
            yield np.nanmedian(place, axis=0).astype(np.float64), located
