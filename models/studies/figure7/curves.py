"""Curves of figure 7: scores over the epochs, and over how much was taught."""

import itertools
import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.simulator.session import LABELS
from models.data.examples import Examples
from models.evaluation import scores
from models.results.training import Epoch
from models.training.gesture_task import GestureTask
from models.training.location_task import LocationTask
from models.training.loop import Task, fit

SHARES: Final = (1 / 16, 1 / 8, 1 / 4, 1 / 2)  # of the examples
POINTS: Final = 30  # of a curve over the epochs, at most
Index = NDArray[np.int64]
Row = dict[str, float]
Say = Callable[[str], None]


def study(run: Callable[[float], list[Row]], what: str, say: Say) -> dict[str, Any]:
    """Return a whole training's curve, and the ends of those on a part of the examples."""
    *whole, last = run(1.0)
    say(f"{what}: {_words(last)}")
    ended = []
    for share in SHARES:
        ended.append(run(share)[-1])
        say(f"{what}, {ended[-1]['examples']:.0f} examples: {_words(ended[-1])}")
    return {
        "kept": int(last["epoch"]),
        "epochs": _columns(whole),
        "sizes": _columns([*ended, last]),
    }


def _columns(rows: list[Row]) -> dict[str, list[float]]:
    return {key: [round(row[key], 5) for row in rows] for key in rows[0]}


def curve(
    task: Task,
    judge: Callable[[bool], Row],
    examples: int,
    seed: int,
) -> list[Row]:
    """Train, and return a row for some of the epochs, and last the network's that is kept."""
    rows: list[Row] = []
    passes = task.recipe.passes(task.steps() * task.recipe.batch)
    shown = set(np.unique(np.geomspace(1, passes, POINTS).round().astype(int)).tolist())

    def row(epoch: Epoch, last: bool) -> Row:
        scored = {"train": epoch.train, "random": epoch.random, **judge(last)}
        return {"epoch": float(epoch.number), "examples": float(examples), **scored}

    def watch(epochs: list[Epoch], done: float) -> None:
        if not done and epochs[-1].number in shown:
            rows.append(row(epochs[-1], last=False))

    fitted = fit(task, seed, None, watch)
    return [*rows, row(fitted.epochs[fitted.best - 1], last=True)]


def first(examples: Examples, own: Index, share: float) -> Index:
    """Return the first windows of each class's block, pauses and all: a shorter task."""
    label = examples.label[examples.ends[own]]
    begins = [int(np.flatnonzero(label == number)[0]) for number in range(1, len(LABELS))]
    edges = [0, *sorted(begins), len(own)]
    blocks = [own[begin:end] for begin, end in itertools.pairwise(edges)]
    return np.concatenate([block[: math.ceil(share * len(block))] for block in blocks])


def events(task: GestureTask, at: Index) -> float:
    """Return the share of gestures that the mean probability over them names rightly."""
    ends = task.examples.ends[at]
    logits, _ = task.answers(ends)
    found = scores.events(task.examples, ends, scores.softmax(logits.numpy()))
    return float((found.named == found.label).mean())


def share(task: GestureTask, at: Index) -> float:
    """Return the share of windows that are named rightly."""
    logits, label = task.answers(task.examples.ends[at])
    return float((logits.argmax(dim=1) == label).float().mean())


def error(task: LocationTask, at: Index) -> float:
    """Return the mean error of images, grid units."""
    return float(np.abs(task.errors(at)).mean())


def _words(row: Row) -> str:
    return ", ".join(f"{key} {value:.4g}" for key, value in row.items() if key != "examples")
