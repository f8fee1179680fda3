"""Advice after a training: enough or more of each gesture, which are confused, which is safest.

Whether more examples would help is read off a learning curve: CNN-3D is trained for a short while
on a quarter, a half and all of the examples. If the errors of a gesture still fall as examples
are added, more would help; how many more follows from how fast they fall.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import torch

from models.data.augment import Symmetry
from models.data.load import Data
from models.data.splits import Index, Parts, Split
from models.evaluation import scores
from models.results import verdict
from models.results.training import ENOUGH, ClassRow, GestureResult, Training
from models.training.gesture_task import GestureTask
from models.training.loop import TrainingJob, fit

SHARES: Final = (0.25, 0.5, 1.0)  # of the examples
STEPS: Final = 300  # batches for each: the curve's shape is there long before its end
PASSES: Final = (1, 60)
JUDGED: Final = 12_000  # windows held out that a curve is measured on, at most
FEW: Final = 20  # examples: of fewer, more help without any measurement
GOOD: Final = 0.01  # share of events not recognised that needs no advice
GAIN: Final = 0.005  # by which twice the examples must lower it, to be worth recording
CONFUSED: Final = 0.02  # share of two gestures' events that are taken for the other
SAFER: Final = 0.01  # by which another gesture must be more reliable
RISKY: Final = ("drop",)  # commands that cannot be taken back


def counts(data: Data, split: Split) -> tuple[ClassRow, ...]:
    """Return how much there is of every class, in what is learned from."""
    labels = data.vocabulary.labels
    kept = [row for row, held in zip(data.rows, split.held, strict=True) if not held]
    label = data.examples.label[data.examples.ends[split.windows.train]]
    seconds = np.bincount(label, minlength=len(labels)) / data.settings.rate_hz
    return tuple(
        ClassRow(
            name, sum(row.examples.get(name, 0) for row in kept), float(length), math.nan, math.nan
        )
        for name, length in zip(labels, seconds, strict=True)
    )


def advise(result: Training, job: TrainingJob, *, measured: bool) -> Training:
    """Return a result with what is known of every class, and what to do next.

    If it shall be measured how much more examples would help, short trainings are run.
    """
    assert result.gesture is not None
    null, *rows = (_scored(row, i, result.gesture) for i, row in enumerate(result.classes))
    held = [sum(row) for row in result.gesture.event_confusion]
    if measured and any(held):
        rows = _with_curves(rows, job)
    rows = [null, *(_judged(row, own) for row, own in zip(rows, held[1:], strict=True))]
    gesture = _with_verdict(result.labels, result.gesture, rows)
    table = gesture.answered or gesture.event_confusion
    failing = {one.label: one.advice for one in gesture.verdict if one.advice}
    rows = [replace(row, advice=failing.get(row.label, row.advice)) for row in rows]
    lines = [
        *(row.advice for row in rows if row.more and row.label not in failing),
        *confused(result.labels, gesture.event_confusion),
        *safest(result.labels, table, job.data.vocabulary.table),
    ]
    if not (lines or failing):
        lines = [ENOUGH]
    return replace(result, classes=tuple(rows), gesture=gesture, advice=tuple(lines))


def needed(examples: float, error: float, slope: float) -> int:
    """Return how many more examples are worth recording, by the share of events missed; 0: none.

    Errors fall as examples to the power of `slope`, below 0.
    """
    if examples < FEW:
        return math.ceil(FEW - examples)
    if error <= GOOD or error * (1.0 - 2.0**slope) < GAIN:
        return 0
    target = max(GOOD, error / 2.0)
    more: float = examples * ((target / error) ** (1.0 / slope) - 1.0)
    return math.ceil(min(more, examples))


def slope_of(curve: Sequence[tuple[float, float]], held: int) -> float:
    """Return the slope of the logarithm of errors over that of the examples.

    Errors were measured on the events `held` out; half a one is the least there can be.
    """
    if len(curve) < 2 or not held:
        return 0.0
    examples, errors = np.array(curve).T
    x, y = np.log(np.maximum(examples, 1.0)), np.log(np.maximum(errors, 0.5 / held))
    return min(0.0, float(np.polyfit(x, y, 1)[0])) if np.ptp(x) else 0.0


def confused(labels: Sequence[str], table: Sequence[Sequence[int]]) -> list[str]:
    """Return a sentence for each two gestures that are taken for each other.

    `table` counts events: true class by named class, null first.
    """
    matrix = np.array(table)
    lines = []
    for i, j in itertools.combinations(range(1, len(labels)), 2):
        both = matrix[i].sum() + matrix[j].sum()
        swapped = matrix[i, j] + matrix[j, i]
        if swapped >= 2 and swapped > CONFUSED * both:
            lines.append(
                f"{labels[i]} and {labels[j]} are taken for each other in {swapped} of {both} "
                "events: make them more different, or merge them into one gesture"
            )
    return lines


def safest(
    labels: Sequence[str], table: Sequence[Sequence[int]], commands: Mapping[str, object]
) -> list[str]:
    """Return the advice to map irrevocable commands to the most reliable gesture.

    A gesture is as reliable as the worse of its recall and its precision in a table of events: true
    class by answered class.
    """
    matrix = np.array(table)
    sure = {
        labels[i]: float(matrix[i, i] / max(matrix[i].sum(), matrix[:, i].sum()))
        for i in range(1, len(labels))
        if matrix[i].sum()
    }
    if not sure:
        return []
    best = max(sure, key=lambda label: sure[label])
    return [
        f"{command} cannot be taken back: give it to {best} ({sure[best]:.1%} sure) rather than "
        f"to {label} ({sure[label]:.1%})"
        for label, command in commands.items()
        if command in RISKY and label in sure and sure[best] - sure[label] > SAFER
    ]


def _scored(row: ClassRow, number: int, result: GestureResult) -> ClassRow:
    """Return a class with its recall and precision."""
    windows = np.array(result.confusion)
    events = np.array(result.event_confusion)
    return replace(
        row,
        recall=_share(windows[number, number], windows[number].sum()),
        precision=_share(windows[number, number], windows[:, number].sum()),
        event_recall=_share(events[number, number], events[number].sum()) if number else math.nan,
    )


def _with_verdict(
    labels: Sequence[str], gesture: GestureResult, rows: Sequence[ClassRow]
) -> GestureResult:
    """Return the scores with the verdict: what is named rightly may not be answered all the same.

    More examples are advised as the learning curves tell, if these have been measured.
    """
    more = {}
    for row in rows[1:]:
        if row.more or (row.curve and row.event_recall < 1.0 - GOOD):
            more[row.label] = row.more
    found = verdict.judge(labels, gesture.answered, gesture.unanswered, more)
    return replace(gesture, verdict=found)


def _judged(row: ClassRow, held: int) -> ClassRow:
    """Return a gesture, of which so many are held out, with the advice: enough of it, or more."""
    error = 1.0 - row.event_recall if held else 0.0
    more = needed(row.examples, error, slope_of(row.curve, held))
    words = f"enough of {row.label}"
    if more:
        words = f"{more} more of {row.label} would help"
    elif error > GOOD and row.curve:
        words = f"more of {row.label} would help little: make it more distinct, or firmer"
    elif error > GOOD:
        words = f"make {row.label} firmer or more distinct, or record more of it"
    return replace(row, more=more, advice=words)


def _with_curves(rows: Sequence[ClassRow], job: TrainingJob) -> list[ClassRow]:
    """Return the gestures with their learning curves."""
    missed = np.array([_missed(job, share) for share in SHARES])[:, 1:]
    return [
        replace(
            row,
            curve=tuple(
                (share * row.examples, float(wrong))
                for share, wrong in zip(SHARES, own, strict=True)
                if math.isfinite(wrong)
            ),
        )
        for row, own in zip(rows, missed.T, strict=True)
    ]


def _missed(job: TrainingJob, share: float) -> list[float]:
    """Return the share of each class's events missed after a short training on some examples."""
    data, examples = job.data, job.data.examples
    recipe = replace(
        job.recipe.gesture, epochs=0, steps=STEPS, limits=PASSES, patience=0.0, falling=True
    )
    none = np.empty(0, dtype=np.int64)
    parts, classes = Parts(_some(job, share), none, none), len(data.vocabulary.labels)
    symmetry = Symmetry.of(data.vocabulary, *examples.images.shape[1:])
    torch.manual_seed(job.seed)
    task = GestureTask(examples, parts, classes, symmetry, recipe, job.device)
    fit(task, job.seed)
    ends = examples.ends[job.split.windows.check][:JUDGED]
    logits, _ = task.answers(ends)
    events = scores.events(examples, ends, scores.softmax(logits.cpu().numpy()))
    wrong = [(events.named != i)[events.label == i] for i in range(classes)]
    return [_share(of.sum(), len(of)) for of in wrong]


def _some(job: TrainingJob, share: float) -> Index:
    """Return the windows of a share of the gestures, whole ones, (windows,)."""
    examples, train = job.data.examples, job.split.windows.train
    run = np.cumsum(examples.begins(examples.ends[train])) - 1
    rank = np.random.default_rng((job.seed, 6)).permutation(int(run[-1]) + 1)
    return np.asarray(train[rank[run] < share * len(rank)])


def _share(part: int, whole: int) -> float:
    return float(part / whole) if whole else math.nan
