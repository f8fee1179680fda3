"""Scores of a trained network: accuracy with intervals, confusion, calibration."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models.data.examples import Examples
from models.evaluation import bootstrap
from models.results.training import Calibration, HeldOutScore

BINS: Final = 10  # of confidence
_HOTTEST: Final = 3.0  # logarithm of the temperature, either way
_NARROW: Final = (math.sqrt(5.0) - 1.0) / 2.0  # golden section

Matrix = NDArray[np.int64]  # (classes, classes)
Probabilities = NDArray[np.float64]  # (n, classes)


def softmax(logits: NDArray[np.floating], temperature: float = 1.0) -> Probabilities:
    """Return probabilities, (n, classes)."""
    hot = logits.astype(np.float64) / temperature
    hot -= hot.max(axis=1, keepdims=True)
    grown = np.exp(hot)
    return np.asarray(grown / grown.sum(axis=1, keepdims=True))


def temperature(logits: NDArray[np.floating], label: NDArray[np.integer]) -> float:
    """Return the temperature with the least cross-entropy for logits (n, classes), labels (n,)."""
    if not len(label):
        return 1.0

    def surprise(log: float) -> float:
        own = softmax(logits, math.exp(log))[np.arange(len(label)), label]
        return float(-np.log(np.maximum(own, 1e-12)).mean())

    low, high = -_HOTTEST, _HOTTEST
    while high - low > 1e-3:
        left, right = high - _NARROW * (high - low), low + _NARROW * (high - low)
        if surprise(left) < surprise(right):
            high = right
        else:
            low = left
    return math.exp((low + high) / 2.0)


def calibration(
    logits: NDArray[np.floating], label: NDArray[np.integer], hot: float
) -> Calibration:
    """Return the calibration of logits, (n, classes), before and after a temperature."""
    before, _ = _expected(softmax(logits), label)
    after, bins = _expected(softmax(logits, hot), label)
    return Calibration(hot, before, after, bins)


def confusion(named: NDArray[np.integer], label: NDArray[np.integer], classes: int) -> Matrix:
    """Return the confusion matrix of classes named, (n,), and true ones, (n,)."""
    count = np.bincount(label * classes + named, minlength=classes * classes)
    return count.reshape(classes, classes).astype(np.int64)


@dataclass(frozen=True, slots=True)
class Events:
    """Runs of windows of one gesture."""

    label: NDArray[np.int64]  # class of each, (events,)
    named: NDArray[np.int64]  # class that its mean probability names, null aside, (events,)


def events(examples: Examples, ends: NDArray[np.int64], probabilities: Probabilities) -> Events:
    """Return the events among windows that end at `ends`, named by (windows, classes)."""
    label = examples.label[ends]
    # A frame of unknown class at an edge parts nothing; a longer silence does.
    begins = examples.begins(ends, gap=2)
    run = np.cumsum(begins) - 1
    of = label[begins]
    total = np.zeros((len(of), probabilities.shape[1]))
    np.add.at(total, run, probabilities)
    gesture = of > 0
    return Events(of[gesture], 1 + total[gesture, 1:].argmax(axis=1))


def score_windows(
    examples: Examples,
    check: tuple[NDArray[np.int64], NDArray[np.integer]],
    random: tuple[NDArray[np.int64], NDArray[np.integer]],
    classes: int,
) -> HeldOutScore:
    """Return the share of (last frames, classes named) that are right, held out and at random."""
    right = [named == examples.label[ends] for ends, named in (check, random)]
    figure = bootstrap.share(*bootstrap.group_sums(right[0], examples.session[check[0]]))
    shares = [float(r.mean()) if len(r) else math.nan for r in right]
    # Per output, a window is one right answer per class: two are wrong where its name is.
    return HeldOutScore(
        shares[0],
        figure.low,
        figure.high,
        shares[1],
        unseen_binary=1.0 - 2.0 * (1.0 - shares[0]) / classes,
        random_binary=1.0 - 2.0 * (1.0 - shares[1]) / classes,
        unseen_windows=len(right[0]),
        random_windows=len(right[1]),
    )


def score_errors(
    session: NDArray[np.integer], check: NDArray[np.floating], random: NDArray[np.floating]
) -> HeldOutScore:
    """Return the mean error of images, (n, 2) held out by session (n,), and (m, 2) at random."""
    each = np.abs(check).mean(axis=1)
    figure = bootstrap.mean([each[session == group] for group in np.unique(session)])
    other = float(np.abs(random).mean()) if len(random) else math.nan
    return HeldOutScore(
        figure.value, figure.low, figure.high, other, math.nan, math.nan, len(check), len(random)
    )


def _expected(
    probabilities: Probabilities, label: NDArray[np.integer]
) -> tuple[float, tuple[tuple[float, float, int], ...]]:
    """Return the expected calibration error of labels, (n,), and its bins."""
    if not len(label):
        return math.nan, ()
    sure = probabilities.max(axis=1)
    right = probabilities.argmax(axis=1) == label
    where = np.minimum((sure * BINS).astype(np.int64), BINS - 1)
    count = np.bincount(where, minlength=BINS)
    confidence = np.bincount(where, sure, minlength=BINS)
    hits = np.bincount(where, right.astype(np.float64), minlength=BINS)
    error = float(np.abs(hits - confidence).sum() / len(label))
    bins = tuple(
        (float(confidence[i] / count[i]), float(hits[i] / count[i]), int(count[i]))
        for i in np.flatnonzero(count)
    )
    return error, bins
