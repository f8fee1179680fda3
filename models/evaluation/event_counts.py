"""Counts of one session: events and answers, latencies, probabilities, and positions."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.debounce import NULL
from controller.recognition.event_metric import TAIL_S, Answer, Event, attach
from controller.recordings.recording import UNKNOWN
from models.data.ground_truth import Known
from models.evaluation.replay import Stream

TURNS: Final = ("twist_cw", "twist_ccw")
INSIDE_S: Final = 0.2  # from an event's edges: what comes closer may be either

Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Tally:
    """Counts of one session.

    Attributes:
        name: Of the session.
        user: Whose.
        minutes: Its length.
        idle_minutes: Time in which no gesture lasts or may still be answered.
        answered: Events (rows; 0: nothing) by what was answered (columns; 0: nothing).
        named: Events by what the mean probability names.
        answers: How often each gesture was answered, (classes,).
        wrong: Answers with another name than the event's.
        duplicates: Right answers again.
        latencies_s: From onset, of each right answer.
        contact_latencies_s: From first contact, likewise, where it is known.
        frames: (right, all) frames.
        turns: The same inside twists.
        sure: Probabilities of the frames whose class is known, and that class.
        places: x, y, error in x, error in y of each press.
        sigmas: Standard deviation given with each of them, grid units, NaN where none was.
    """

    name: str
    user: str
    minutes: float
    idle_minutes: float
    answered: Counts
    named: Counts
    answers: Counts
    wrong: int
    duplicates: int
    latencies_s: NDArray[np.float64]
    contact_latencies_s: NDArray[np.float64]
    frames: tuple[int, int]
    turns: tuple[int, int]
    sure: tuple[NDArray[np.float32], Counts]
    places: NDArray[np.float64]
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
    known, classes = stream.known, len(labels)
    number = {label: i for i, label in enumerate(labels)}
    answers = [a for a in stream.answers if not known.excluded[_frame(known, a.time_s)]]
    answered, named = np.zeros((2, classes, classes), dtype=np.int64)
    got, counts = _matched(known, answers, answered, number)
    for event, kind in zip(known.events, got, strict=True):
        answered[number[event.kind], kind] += 1
        named[number[event.kind], _name(stream, event)] += 1
    use = (known.label != UNKNOWN) & ~known.excluded
    right = stream.probabilities.argmax(axis=1) == known.label
    inside = use & _inside_turns(known)
    step_min = float(np.median(np.diff(known.t))) / 60.0 if len(known.t) > 1 else 0.0
    idle = stream.ready & ~known.excluded & ~_attached(known)
    sure = use & stream.ready
    return Tally(
        known.name,
        known.user,
        len(known.t) * step_min,
        int(idle.sum()) * step_min,
        answered,
        named,
        np.bincount([number[a.kind] for a in answers], minlength=classes).astype(np.int64),
        *counts,
        (int(right[use].sum()), int(use.sum())),
        (int(right[inside].sum()), int(inside.sum())),
        (stream.probabilities[sure], known.label[sure]),
        *_places(stream),
    )


_Matches = tuple[int, int, NDArray[np.float64], NDArray[np.float64]]


def _matched(
    known: Known, answers: Sequence[Answer], answered: Counts, number: Mapping[str, int]
) -> tuple[list[int], _Matches]:
    """Return the answer to each event, and counts: wrong, duplicates, latencies, after contact.

    False alarms are added to the first row of `answered`, (classes, classes).
    """
    got = [0] * len(known.events)
    wrong = duplicates = 0
    latencies, contacts = [], []
    for answer, owner in zip(answers, attach(known.events, answers), strict=True):
        kind = number[answer.kind]
        if owner < 0:
            answered[0, kind] += 1
        elif answer.kind != known.events[owner].kind:
            wrong += 1
            got[owner] = got[owner] or kind
        elif got[owner] == kind:
            duplicates += 1
        else:
            got[owner] = kind
            latencies.append(answer.time_s - known.events[owner].onset_s)
            contacts.append(answer.time_s - known.contact_s[owner])
    after = np.array([late for late in contacts if np.isfinite(late)])
    return got, (wrong, duplicates, np.array(latencies), after)


def _frame(known: Known, time_s: float) -> int:
    return min(int(np.searchsorted(known.t, time_s)), len(known.t) - 1)


def _between(known: Known, event: Event) -> slice:
    """Return the frames in which a gesture lasts: at least one, the next after its onset."""
    first, end = np.searchsorted(known.t, (event.onset_s, event.release_s))
    return slice(int(first), int(max(end, first + 1)))


def _name(stream: Stream, event: Event) -> int:
    """Return what the mean probability over an event names, null aside; 0: nothing was ready."""
    frames = _between(stream.known, event)
    if not stream.ready[frames].any():
        return NULL
    return NULL + 1 + int(stream.probabilities[frames, NULL + 1 :].mean(axis=0).argmax())


def _attached(known: Known) -> NDArray[np.bool_]:
    """Return the frames in which an answer would belong to a gesture, (n,)."""
    within = np.zeros(len(known.t), dtype=np.bool_)
    for event in known.events:
        within |= (known.t >= event.onset_s) & (known.t <= event.release_s + TAIL_S)
    return within


def _inside_turns(known: Known) -> NDArray[np.bool_]:
    """Return the frames inside twists, away from their edges, (n,)."""
    within = np.zeros(len(known.t), dtype=np.bool_)
    for event in known.events:
        if event.kind in TURNS:
            late_enough = known.t >= event.onset_s + INSIDE_S
            within |= late_enough & (known.t < event.release_s - INSIDE_S)
    return within


def position_errors(stream: Stream) -> NDArray[np.float64]:
    """Return the errors of positions in every frame of every press, (frames, 3).

    The standard deviation given, and the errors in x and in y, grid units.
    """
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


def _presses(stream: Stream) -> Iterator[tuple[NDArray[np.float64], Counts]]:
    """Yield the true position of each press, (2,), and the frames with an estimate, (frames,)."""
    for event in stream.known.events:
        frames = _between(stream.known, event)
        truth = stream.known.place[frames]
        felt = frames.start + np.flatnonzero(np.isfinite(stream.touches[frames, 0]))
        if np.isfinite(truth[:, 0]).any() and len(felt):
            yield np.nanmedian(truth, axis=0).astype(np.float64), felt
