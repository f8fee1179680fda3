"""Statistics of a cross-validation: shares of windows and stretches, by fold, person and session.

Every window is judged once, by a model that learned from others only. Models are compared on the
same windows, so the interval of a difference is over people who were judged by both.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models.data import splits
from models.data.splits import Fold
from models.evaluation import bootstrap
from models.results.figure import Figure

TOUCHED: Final = ("none", "less than half", "half or more", "all")  # of a window's images

Index = NDArray[np.int64]  # (windows,)
Probabilities = NDArray[np.floating]  # (windows, classes)


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """All windows, in the order of the recordings."""

    label: Index  # class, (windows,)
    stretch: Index  # number of the run of windows of one class, rising, (windows,)
    person: Index  # number of the person, (windows,)
    kind: Index  # number of the session's name, (windows,)
    touched: Index  # touched share of its images, a number of `TOUCHED`, (windows,)
    labels: tuple[str, ...]  # names of the classes
    people: tuple[str, ...]  # names of the people
    kinds: tuple[str, ...]  # names of the sessions


@dataclass(frozen=True, slots=True)
class Model:
    """Scores of one model."""

    name: str  # name of the model
    windows: Figure  # share of windows named rightly, with its interval over people
    # share of stretches that their mean probability names rightly, with its interval
    stretches: Figure
    confusion: tuple[tuple[int, ...], ...]  # number of windows, true class by named class
    by_fold: tuple[float, ...]  # share of windows, for each fold
    by_person: tuple[float, ...]  # share of windows, for each person
    by_kind: tuple[float, ...]  # share of windows, for each session's name
    by_touched: tuple[float, ...]  # share of windows, for each of `TOUCHED`
    cpu_s: float  # CPU time of training and answers, seconds


@dataclass(frozen=True, slots=True)
class Gain:
    """Lead of our model over another, with its interval over people."""

    name: str  # name of the other model
    windows: Figure  # difference of the shares of windows
    stretches: Figure  # difference of the shares of stretches
    ahead: int  # number of people of whom ours names more windows rightly


@dataclass(frozen=True, slots=True)
class CrossValidation:
    """All results of a cross-validation, as its JSON file has them."""

    command: str  # command line
    software: str  # version of this program
    data: str  # the data set, a sentence
    how: tuple[str, ...]  # the recipe, sentences
    labels: tuple[str, ...]  # names of the classes
    majority: float  # share of the commonest class
    windows: int  # number of windows
    stretches: int  # number of stretches
    people: tuple[str, ...]  # their names
    held: tuple[str, ...]  # people judged in each fold
    chosen: tuple[str, ...]  # settings that each fold chose, in words; empty if they are given
    kinds: tuple[str, ...]  # names of the sessions; empty if there is one
    touched: tuple[int, ...]  # windows of each of `TOUCHED`
    models: tuple[Model, ...]  # scores; ours first
    gains: tuple[Gain, ...]  # lead of ours over each of the others
    reading_cpu_s: float  # CPU time of reading and preparing the recordings, seconds
    cpu_minutes: float  # CPU time of everything, minutes


def within(fold: Fold, ends: Index, window: int, group: NDArray[np.integer]) -> Fold:
    """Return a fold of a fold's training windows, whose test part is there to choose on.

    Args:
        fold: Of `by_group`.
        ends: Last frame of each window, (windows,).
        window: Frames in a window.
        group: Session or user of each frame, (frames,).

    Raises:
        ValueError: It learns from fewer than two groups.
    """
    of = group[ends[fold.train]]
    names = np.unique(of)
    if len(names) < 2:
        raise ValueError(
            "a fold that learns from one person has nobody to choose on; record another, or ask "
            "for more folds"
        )
    held = np.isin(of, splits.spread(names, max(1, round(splits.SHARE * len(names)))))
    inner = Fold(f"within {fold.name}", fold.train[~held], fold.train[held])
    splits.check(inner, ends, window)
    return inner


def judge(
    windows: Windows,
    folds: Sequence[Fold],
    name: str,
    answers: Probabilities,
    cpu_s: float,
    seed: int = 0,
) -> Model:
    """Return a model's scores.

    Args:
        windows: Windows to judge.
        folds: Their test parts hold each window once.
        name: Name of the model.
        answers: Probability of each class, (windows, classes).
        cpu_s: CPU time of training and answers, seconds.
        seed: Seed of the resampling.
    """
    named = answers.argmax(axis=1)
    right = named == windows.label
    person, whole = _by_stretch(windows, answers)
    confusion = np.zeros((len(windows.labels),) * 2, dtype=np.int64)
    np.add.at(confusion, (windows.label, named), 1)
    return Model(
        name,
        bootstrap.share(*bootstrap.group_sums(right, windows.person), seed),
        bootstrap.share(*bootstrap.group_sums(whole, person), seed),
        tuple(tuple(row) for row in confusion.tolist()),
        tuple(float(right[fold.test].mean()) for fold in folds),
        _shares(right, windows.person, len(windows.people)),
        _shares(right, windows.kind, len(windows.kinds)),
        _shares(right, windows.touched, len(TOUCHED)),
        cpu_s,
    )


def gain(
    windows: Windows, ours: Probabilities, name: str, other: Probabilities, seed: int = 0
) -> Gain:
    """Return our lead over another model; both answer (windows, classes)."""
    mine, theirs = (answers.argmax(axis=1) == windows.label for answers in (ours, other))
    lead, count = bootstrap.group_sums(mine.astype(np.int64) - theirs, windows.person)
    person, whole = _by_stretch(windows, ours)
    more = whole.astype(np.int64) - _by_stretch(windows, other)[1]
    by_stretch = bootstrap.rate(*bootstrap.group_sums(more, person), seed)
    return Gain(name, bootstrap.rate(lead, count, seed), by_stretch, int((lead > 0).sum()))


def _by_stretch(windows: Windows, answers: Probabilities) -> tuple[Index, NDArray[np.bool_]]:
    """Return each stretch's person, and whether its mean probability names it, (stretches,)."""
    total = np.zeros((int(windows.stretch[-1]) + 1, answers.shape[1]))
    np.add.at(total, windows.stretch, answers)
    _, first = np.unique(windows.stretch, return_index=True)
    return windows.person[first], total.argmax(axis=1) == windows.label[first]


def _shares(right: NDArray[np.bool_], group: Index, groups: int) -> tuple[float, ...]:
    """Return the share of windows named rightly, (windows,), in each group."""
    hits, count = np.bincount(group, right, groups), np.bincount(group, minlength=groups)
    return tuple((hits / np.maximum(count, 1)).tolist())
