"""Scores of a trained network: accuracy with intervals, confusion, calibration.

The error of a position grows with the noise of its image, which the device estimates
(controller/recognition/touch_position.py). Two parameters, measured once, turn that into a standard
deviation in grid units: the maximum-likelihood ones of normal errors.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.touch_position import PositionSpread
from controller.shared.aliases import Index
from models.data.examples import Examples
from models.evaluation import bootstrap
from models.results.training import Calibration, HeldOutScore

BINS: Final = 10  # of confidence
_HOTTEST: Final = 3.0  # logarithm of the temperature, either way
_NARROW: Final = (math.sqrt(5.0) - 1.0) / 2.0  # golden section
_FEWEST: Final = 20  # presses for an estimate
BARE: Final = PositionSpread(0.0, 1.0)  # of a bundle that is measured: it reports the blur itself
_ON_SITE: Final = 0.25  # grid units from a taxel, the finger's aim being no better
_ROUNDS: Final = 20  # of the estimate
_LEAST: Final = 1e-6  # variance: no standard deviation is below a thousandth

Probabilities = NDArray[np.float64]  # (n, classes)
Values = NDArray[np.float64]  # (n,) of images, or (n, 2) of their errors


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


def confusion(
    named: NDArray[np.integer], label: NDArray[np.integer], classes: int
) -> tuple[tuple[int, ...], ...]:
    """Return the confusion matrix of classes named, (n,), and true ones, (n,)."""
    count = np.bincount(label * classes + named, minlength=classes * classes)
    return tuple(map(tuple, count.reshape(classes, classes).tolist()))


def events(examples: Examples, ends: Index, probabilities: Probabilities) -> tuple[Index, Index]:
    """Return the class of each event among windows that end at `ends`, and its name, (events,).

    An event is a run of windows of one gesture, named by the mean of their probabilities, (windows,
    classes), null aside.
    """
    label = examples.label[ends]
    # A frame of unknown class at an edge parts nothing; a longer silence does.
    begins = examples.begins(ends, gap=2)
    run = np.cumsum(begins) - 1
    of = label[begins]
    total = np.zeros((len(of), probabilities.shape[1]))
    np.add.at(total, run, probabilities)
    gesture = of > 0
    return of[gesture], 1 + total[gesture, 1:].argmax(axis=1)


def score_windows(
    examples: Examples,
    check: tuple[NDArray[np.int64], NDArray[np.integer]],
    random: tuple[NDArray[np.int64], NDArray[np.integer]],
) -> HeldOutScore:
    """Return the share of (last frames, classes named) that are right, held out and at random."""
    right = [named == examples.label[ends] for ends, named in (check, random)]
    figure = bootstrap.share(*bootstrap.group_sums(right[0], examples.session[check[0]]))
    shares = [float(r.mean()) if len(r) else math.nan for r in right]
    return HeldOutScore(shares[0], figure.low, figure.high, shares[1])


def score_errors(
    session: NDArray[np.integer], check: NDArray[np.floating], random: NDArray[np.floating]
) -> HeldOutScore:
    """Return the mean error of images, (n, 2) held out by session (n,), and (m, 2) at random."""
    each = np.abs(check).mean(axis=1)
    figure = bootstrap.mean([each[session == group] for group in np.unique(session)])
    other = float(np.abs(random).mean()) if len(random) else math.nan
    return HeldOutScore(figure.value, figure.low, figure.high, other)


def position_spread(blur: Values, errors: Values) -> PositionSpread | None:
    """Return the error of positions from blur (n,) and errors (n, 2), grid units; None: too few."""
    known = np.isfinite(blur) & np.isfinite(errors).all(axis=1)
    if known.sum() < _FEWEST:
        return None
    squares = np.square(errors[known]).mean(axis=1)
    causes = np.stack([np.ones(known.sum()), np.square(blur[known])], axis=1)
    share = np.array([squares.mean(), 0.0])
    for _ in range(_ROUNDS):  # scoring: precise positions weigh more
        variance = np.maximum(causes @ share, _LEAST)
        share = _least_squares(causes / variance[:, None], squares / variance)
    floor, noise = np.sqrt(np.maximum(share, 0.0)).tolist()
    return PositionSpread(round(max(floor, _LEAST**0.5), 4), round(noise, 4))


def within(sigma: Values, errors: Values) -> tuple[float, float]:
    """Return the shares of errors (n, 2) within one and two sigma (n,), grid units; NaN: none."""
    known = np.isfinite(sigma)
    if not known.any():
        return float("nan"), float("nan")
    off = np.abs(errors[known]) / sigma[known, None]
    return float((off <= 1.0).mean()), float((off <= 2.0).mean())


def between_taxels(places: Values) -> NDArray[np.bool_]:
    """Return which places (n, 2), grid units, are not within `_ON_SITE` of a taxel, (n,)."""
    return np.asarray(np.abs(places - np.rint(places)).max(axis=1, initial=0.0) > _ON_SITE)


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


def _least_squares(causes: Values, effect: Values) -> Values:
    """Return the share of each cause, (2,), none below zero; causes (n, 2), effect (n,)."""
    found, *_ = np.linalg.lstsq(causes, effect, rcond=None)
    if (found >= 0.0).all():
        return np.asarray(found)
    kept = int(found.argmax())  # of two causes one is none
    alone = np.zeros(2)
    alone[kept] = max(0.0, float(causes[:, kept] @ effect / (causes[:, kept] @ causes[:, kept])))
    return alone
