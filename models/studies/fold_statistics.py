"""Cross-validation by whole people or sessions: who is judged when, and what came of it.

Everybody is judged once, by a model that learned from others only. What a training may choose (how
far to shift, how hot its probabilities are) it chooses within its own fold: `splits.within` holds
some of the people whom it learns from out again. Models are compared on the same windows, so the
interval of a difference is over people who were judged by both.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models import json_values
from models.data.splits import Fold
from models.evaluation import bootstrap
from models.results.figure import Figure

BY: Final = ("user", "session")
# How much of a window something touches: what it is judged by beside people and sessions.
TOUCHED: Final = ("none", "less than half", "half or more", "all")

Index = NDArray[np.int64]
Rows = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Rowed:
    """What is judged: every window, in the order of the recordings.

    Attributes:
        label: Its class, (windows,).
        stretch: Which run of windows of one class it is in, rising, (windows,).
        person: Who, a number, (windows,).
        kind: In which kind of session (its name in the recordings), a number, (windows,).
        people: Their names, by number.
        kinds: The sessions' names, by number.
        touched: How many of its images are touched, a number of `TOUCHED`, (windows,).
        labels: The classes' names.
    """

    label: Index
    stretch: Index
    person: Index
    kind: Index
    people: tuple[str, ...]
    kinds: tuple[str, ...]
    touched: Index
    labels: tuple[str, ...]


def stretches(ends: Index, label: Index, session: Index) -> Index:
    """Return which run of windows each is in; one frame missed, or another class, parts two.

    Args:
        ends: Last frame of each window, in order, (windows,).
        label: Class of each.
        session: Recording of each.
    """
    begins = np.ones(len(ends), dtype=np.bool_)
    begins[1:] = (np.diff(ends) > 1) | (np.diff(label) != 0) | (np.diff(session) != 0)
    return np.asarray(np.cumsum(begins) - 1, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Model:
    """What one model got right.

    Attributes:
        name: Which.
        windows: Share of windows named rightly, with its interval over people.
        stretches: Share of stretches that the mean probability over them names rightly, likewise.
        confusion: Windows: true class by named class.
        by_fold: Share of windows, for each fold.
        by_person: Likewise, for each person.
        by_kind: Likewise, for each kind of session.
        by_touched: Likewise, by how much of the window something touches: `TOUCHED`.
        cpu_s: What it cost to learn and to answer.
    """

    name: str
    windows: Figure
    stretches: Figure
    confusion: tuple[tuple[int, ...], ...]
    by_fold: tuple[float, ...]
    by_person: tuple[float, ...]
    by_kind: tuple[float, ...]
    by_touched: tuple[float, ...]
    cpu_s: float


@dataclass(frozen=True, slots=True)
class Gain:
    """How much more one model gets right than another, with the interval over people.

    Attributes:
        name: The other one.
        windows: Of windows.
        stretches: Of stretches.
        ahead: People of whom it names more windows rightly.
    """

    name: str
    windows: Figure
    stretches: Figure
    ahead: int


@dataclass(frozen=True, slots=True)
class Crossed:
    """All that a cross-validation found out; plain values, as JSON has them.

    Attributes:
        command: What made it.
        software: Version of this program.
        data: What was judged, in a sentence.
        how: How it was learned, in sentences.
        labels: The classes.
        majority: Share of the commonest class: what who knows nothing gets right.
        windows: How many were judged.
        stretches: Likewise.
        people: Their names.
        held: Who was judged in each fold.
        chosen: What each fold chose, in words; empty where there was nothing to choose.
        kinds: Kinds of sessions; empty where there is but one.
        touched: Windows by how much of them something touches: `TOUCHED`.
        models: Ours first.
        gains: Of ours over each of the others.
        reading_cpu_s: What it cost to read and to prepare the recordings.
        cpu_minutes: Of everything.
    """

    command: str
    software: str
    data: str
    how: tuple[str, ...]
    labels: tuple[str, ...]
    majority: float
    windows: int
    stretches: int
    people: tuple[str, ...]
    held: tuple[str, ...]
    chosen: tuple[str, ...]
    kinds: tuple[str, ...]
    touched: tuple[int, ...]
    models: tuple[Model, ...]
    gains: tuple[Gain, ...]
    reading_cpu_s: float
    cpu_minutes: float

    def text(self) -> str:
        """Return it as JSON; what is no number is null."""
        return json_values.text(asdict(self))


def judge(
    rows: Rowed, folds: Sequence[Fold], name: str, answers: Rows, cpu_s: float, seed: int = 0
) -> Model:
    """Return what a model got right.

    Args:
        rows: What was judged.
        folds: Who was judged when; their test parts are `rows` each once.
        name: Of the model.
        answers: Probability of each class, (windows, classes).
        cpu_s: What it cost.
        seed: Of the resampling.
    """
    named = answers.argmax(axis=1)
    right = named == rows.label
    of, whole = _stretches(rows, answers)
    classes = len(rows.labels)
    count = np.bincount(rows.label * classes + named, minlength=classes * classes)
    return Model(
        name,
        _share(right, rows.person, seed),
        _share(whole, of, seed),
        tuple(tuple(row) for row in count.reshape(classes, classes).tolist()),
        tuple(float(right[fold.test].mean()) for fold in folds),
        _each(right, rows.person, len(rows.people)),
        _each(right, rows.kind, len(rows.kinds)),
        _each(right, rows.touched, len(TOUCHED)),
        cpu_s,
    )


def gain(rows: Rowed, ours: Rows, name: str, other: Rows, seed: int = 0) -> Gain:
    """Return how much more ours gets right than another, both (windows, classes)."""
    right = [(answers.argmax(axis=1) == rows.label).astype(np.float64) for answers in (ours, other)]
    of, mine = _stretches(rows, ours)
    _, theirs = _stretches(rows, other)
    more = right[0] - right[1]
    own = np.bincount(rows.person, more)
    return Gain(
        name,
        _difference(more, rows.person, seed),
        _difference(mine.astype(np.float64) - theirs, of, seed),
        int((own > 0).sum()),
    )


def _stretches(rows: Rowed, answers: Rows) -> tuple[Index, NDArray[np.bool_]]:
    """Return whose each stretch is, and whether its mean probability names it, (stretches,)."""
    total = np.zeros((int(rows.stretch[-1]) + 1, answers.shape[1]))
    np.add.at(total, rows.stretch, answers)
    _, first = np.unique(rows.stretch, return_index=True)
    return rows.person[first], total.argmax(axis=1) == rows.label[first]


def _share(right: NDArray[np.bool_], person: Index, seed: int) -> Figure:
    return bootstrap.share(np.bincount(person, right), np.bincount(person), seed)


def _difference(more: NDArray[np.float64], person: Index, seed: int) -> Figure:
    return bootstrap.rate(np.bincount(person, more), np.bincount(person), seed)


def _each(right: NDArray[np.bool_], group: Index, count: int) -> tuple[float, ...]:
    of = np.bincount(group, minlength=count)
    hits = np.bincount(group, right, minlength=count)
    return tuple((hits / np.maximum(of, 1)).tolist())
