"""Advice after a training: enough or more of each gesture, and which are confused.

`models sweep` measures learning curves, and so whether more examples of a gesture would help.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from models.data.load import Data
from models.data.splits import Split
from models.results import verdict
from models.results.training import ENOUGH, ClassRow, GestureResult, Training

FEW: Final = 20  # examples: of fewer, more help
GOOD: Final = 0.01  # share of events not recognised that needs no advice
CONFUSED: Final = 0.02  # share of two gestures' events that are taken for the other


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


def advise(result: Training) -> Training:
    """Return a result with the figures of every class, and advice."""
    assert result.gesture is not None
    null, *rows = (_scored(row, i, result.gesture) for i, row in enumerate(result.classes))
    found = verdict.judge(result.labels, result.gesture.answered, result.gesture.unanswered)
    failing = {one.label: one.advice for one in found if one.advice}
    held = [sum(row) for row in result.gesture.event_confusion[1:]]
    advised = [
        replace(row, advice=failing.get(row.label) or _advice(row, own))
        for row, own in zip(rows, held, strict=True)
    ]
    lines = [
        *(row.advice for row in advised if row.examples < FEW and row.label not in failing),
        *confused(result.labels, result.gesture.event_confusion),
    ]
    if not (lines or failing):
        lines = [ENOUGH]
    gesture = replace(result.gesture, verdict=found)
    return replace(result, classes=(null, *advised), gesture=gesture, advice=tuple(lines))


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


def _advice(row: ClassRow, held: int) -> str:
    """Return the advice for a gesture; `held` counts its events held out."""
    if row.examples < FEW:
        return f"{FEW - row.examples} more of {row.label} would help"
    if held and 1.0 - row.event_recall > GOOD:
        return f"make {row.label} firmer or more distinct, or record more of it"
    return f"enough of {row.label}"


def _share(part: int, whole: int) -> float:
    return float(part / whole) if whole else math.nan
