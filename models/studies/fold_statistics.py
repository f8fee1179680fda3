"""Statistics of a cross-validation, and their card: windows and stretches, by fold and person.

Every window is judged once, by a model that learned from others only. Models are compared on the
same windows, so the interval of a difference is over people who were judged by both.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Index
from models.data import splits
from models.data.splits import Fold
from models.evaluation import bootstrap, scores
from models.reports import markdown
from models.reports.tables import Table
from models.results.evaluation import Figure

Probabilities = NDArray[np.floating]  # (windows, classes)


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """All windows, in the order of the recordings."""

    label: Index  # class, (windows,)
    stretch: Index  # number of the run of windows of one class, rising, (windows,)
    person: Index  # number of the person, (windows,)
    labels: tuple[str, ...]  # names of the classes
    people: tuple[str, ...]  # names of the people


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
    cpu_s: float  # CPU time of training and answers, seconds


@dataclass(frozen=True, slots=True)
class Gain:
    """Lead of our model over the baseline, with its interval over people."""

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
    models: tuple[Model, ...]  # scores of ours and of the baseline
    gain: Gain  # lead of ours
    reading_cpu_s: float  # CPU time of reading and preparing the recordings, seconds
    cpu_minutes: float  # CPU time of everything, minutes


def within(fold: Fold, ends: Index, window: int, group: NDArray[np.integer]) -> Fold:
    """Return a fold of a fold's training windows, whose test part is there to choose on.

    The group is of each frame, (frames,); ValueError if the fold learns from fewer than two.
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
    """Return the scores of a model's answers, (windows, classes), to all folds' test windows."""
    named = answers.argmax(axis=1)
    right = named == windows.label
    person, whole = _by_stretch(windows, answers)
    confusion = scores.confusion(named, windows.label, len(windows.labels))
    return Model(
        name,
        bootstrap.share(*bootstrap.group_sums(right, windows.person), seed),
        bootstrap.share(*bootstrap.group_sums(whole, person), seed),
        tuple(tuple(row) for row in confusion.tolist()),
        tuple(float(right[fold.test].mean()) for fold in folds),
        _shares(right, windows.person, len(windows.people)),
        cpu_s,
    )


def gain(windows: Windows, ours: Probabilities, other: Probabilities, seed: int = 0) -> Gain:
    """Return our lead over another model; both answer (windows, classes)."""
    mine, theirs = (answers.argmax(axis=1) == windows.label for answers in (ours, other))
    lead, count = bootstrap.group_sums(mine.astype(np.int64) - theirs, windows.person)
    person, whole = _by_stretch(windows, ours)
    more = whole.astype(np.int64) - _by_stretch(windows, other)[1]
    by_stretch = bootstrap.rate(*bootstrap.group_sums(more, person), seed)
    return Gain(bootstrap.rate(lead, count, seed), by_stretch, int((lead > 0).sum()))


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


def text(found: CrossValidation) -> str:
    """Return the card as Markdown."""
    tables = [
        _shares_table("fold", found.held, found.models, "by_fold", found.chosen),
        _shares_table("person", found.people, found.models, "by_person"),
        *(_confusion(found.labels, model) for model in found.models),
    ]
    parts = [
        f"{found.data}; folds: {len(found.held)}. Always naming the commonest class gets "
        f"{found.majority:.3f} of the windows right. Intervals are 95 %, by resampling people.",
        markdown.table(_scores(found)),
        f"CPU time of all, {found.reading_cpu_s:.0f} s of reading included: "
        f"{found.cpu_minutes:.1f} minutes.",
    ]
    return "\n\n".join([*parts, *map(markdown.table, tables)])


def _scores(found: CrossValidation) -> Table:
    rows = [
        [model.name, str(model.windows), str(model.stretches), f"{model.cpu_s / 60.0:.1f}"]
        for model in found.models
    ]
    gain, (*_, other) = found.gain, found.models
    ahead = f"better for {gain.ahead} of {len(found.people)} people"
    name = f"ours more than {other.name}"
    rows.append([name, _points(gain.windows), _points(gain.stretches), ahead])
    return Table(["", "windows", "stretches", "CPU minutes"], rows)


def _shares_table(
    what: str, names: Sequence[str], models: Sequence[Model], key: str, chosen: Sequence[str] = ()
) -> Table:
    """Return a table of the share of windows named rightly, a row for each name."""
    head = [what, *(model.name for model in models), *(["chosen"] if chosen else [])]
    rows = [
        [name, *(f"{getattr(model, key)[i]:.3f}" for model in models), *chosen[i : i + 1]]
        for i, name in enumerate(names)
    ]
    return Table(head, rows)


def _confusion(labels: Sequence[str], model: Model) -> Table:
    """Return the confusion matrix in per cent, without classes that do not occur."""
    used = [number for number, row in enumerate(model.confusion) if sum(row)]
    rows = []
    for number in used:
        row = model.confusion[number]
        shares = [f"{100.0 * row[i] / sum(row):.1f} %" for i in used]
        rows.append([f"**{labels[number]}**", *shares])
    return Table([f"{model.name}: done \\ named", *(labels[i] for i in used)], rows)


def _points(figure: Figure) -> str:
    """Return a difference of shares in points."""
    value, low, high = (100.0 * one for one in (figure.value, figure.low, figure.high))
    return f"{value:+.1f} points ({low:+.1f} … {high:+.1f})"
