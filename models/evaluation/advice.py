"""Advice after a training: more of a gesture, or what would help where it is missed.

`models sweep` measures learning curves, and so whether more examples of a gesture would help.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from models.data.load import Data
from models.data.splits import Split
from models.evaluation import bootstrap
from models.results import verdict
from models.results.training import ENOUGH, ClassRow, GestureResult, Training

FEW: Final = 20  # examples: of fewer, more help


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
    failing = {one.label for one in found if one.advice}
    lines = [
        f"{FEW - row.examples} more of {row.label} would help"
        for row in rows
        if row.examples < FEW and row.label not in failing
    ]
    if not (lines or failing):
        lines = [ENOUGH]
    gesture = replace(result.gesture, verdict=found)
    return replace(result, classes=(null, *rows), gesture=gesture, advice=tuple(lines))


def _scored(row: ClassRow, number: int, result: GestureResult) -> ClassRow:
    """Return a class with its recall and precision."""
    windows = np.array(result.confusion)
    events = np.array(result.event_confusion)
    return replace(
        row,
        recall=bootstrap.ratio(windows[number, number], windows[number].sum()),
        precision=bootstrap.ratio(windows[number, number], windows[:, number].sum()),
        event_recall=bootstrap.ratio(events[number, number], events[number].sum()),
    )
