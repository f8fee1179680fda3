"""Advice after a training: enough or more of each gesture, which are confused, which is safest.

`models sweep` measures learning curves, and so whether more examples of a gesture would help.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
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


def advise(result: Training, commands: Mapping[str, object]) -> Training:
    """Return a result with the figures of every class, and advice.

    `commands` is the vocabulary's table, gesture to command.
    """
    assert result.gesture is not None
    null, *rows = (_scored(row, i, result.gesture) for i, row in enumerate(result.classes))
    held = [sum(row) for row in result.gesture.event_confusion]
    rows = [null, *(_judged(row, own) for row, own in zip(rows, held[1:], strict=True))]
    found = verdict.judge(result.labels, result.gesture.answered, result.gesture.unanswered)
    gesture = replace(result.gesture, verdict=found)
    table = gesture.answered or gesture.event_confusion
    failing = {one.label: one.advice for one in gesture.verdict if one.advice}
    rows = [replace(row, advice=failing.get(row.label, row.advice)) for row in rows]
    lines = [
        *(row.advice for row in rows[1:] if row.examples < FEW and row.label not in failing),
        *confused(result.labels, gesture.event_confusion),
        *safest(result.labels, table, commands),
    ]
    if not (lines or failing):
        lines = [ENOUGH]
    return replace(result, classes=tuple(rows), gesture=gesture, advice=tuple(lines))


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


def _judged(row: ClassRow, held: int) -> ClassRow:
    """Return a gesture with its advice; `held` counts its events held out."""
    error = 1.0 - row.event_recall if held else 0.0
    more = max(0, FEW - row.examples)
    words = f"enough of {row.label}"
    if more:
        words = f"{more} more of {row.label} would help"
    elif error > GOOD:
        words = f"make {row.label} firmer or more distinct, or record more of it"
    return replace(row, advice=words)


def _share(part: int, whole: int) -> float:
    return float(part / whole) if whole else math.nan
