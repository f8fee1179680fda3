"""Intervals of an estimate: 95 % by drawing events anew.

Windows of one touch are nearly one observation, events are nearly independent. So what is drawn,
with replacement, are whole events and whole pauses. Days and people are not drawn: an interval
says what other touches of the same sessions would have given.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from models.evaluation.bootstrap import LEVEL
from models.results.figure import Figure

DRAWS: Final = 400


def mean(part: NDArray[np.float64], event: NDArray[np.int64], seed: int = 0) -> Figure:
    """Return the mean of what each window contributes, NaN left out, and its interval.

    Args:
        part: Of each window, (n,).
        event: Which event each is of, (n,).
        seed: Of the drawing.
    """
    known = np.isfinite(part)
    if not known.any():
        return Figure(np.nan, np.nan, np.nan)
    sums, counts = _by_event(part[known], event[known])
    drawn = _draws(len(sums), seed)
    return _figure(float(part[known].mean()), (drawn @ sums) / (drawn @ counts))


def gain(
    log_p: NDArray[np.float64],
    y: NDArray[np.int64],
    event: NDArray[np.int64],
    seed: int = 0,
) -> Figure:
    """Return H(y) - cross-entropy, nats, both of the same windows, and its interval.

    Args:
        log_p: Logarithm of the probability that was given to the true class, (n,).
        y: The true class, (n,).
        event: Which event each is of, (n,).
        seed: Of the drawing.
    """
    known = np.isfinite(log_p)
    log_p, y, event = log_p[known], y[known], event[known]
    if not len(y):
        return Figure(np.nan, np.nan, np.nan)
    sums, counts = _by_event(log_p, event)
    _, number = np.unique(event, return_inverse=True)
    classes = int(y.max()) + 1
    table = np.zeros((len(counts), classes))
    np.add.at(table, (number, y), 1.0)
    drawn = _draws(len(sums), seed)

    def of(weights: NDArray[np.float64]) -> NDArray[np.float64]:
        total = weights @ counts
        p = (weights @ table) / total[:, None]
        surprise = np.where(p > 0, p * np.log(np.maximum(p, 1e-300)), 0.0).sum(axis=1)
        return np.asarray((weights @ sums) / total - surprise)

    return _figure(float(of(np.ones((1, len(sums))))[0]), of(drawn))


def _by_event(
    part: NDArray[np.float64], event: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sum of each event's parts, and how many there are."""
    _, number = np.unique(event, return_inverse=True)
    return np.bincount(number, part).astype(np.float64), np.bincount(number).astype(np.float64)


def _draws(events: int, seed: int) -> NDArray[np.float64]:
    """Return how often each event is drawn, (draws, events)."""
    rng = np.random.default_rng(seed)
    return rng.multinomial(events, np.full(events, 1.0 / events), DRAWS).astype(np.float64)


def _figure(value: float, drawn: NDArray[np.float64]) -> Figure:
    edge = (1.0 - LEVEL) / 2.0
    low, high = np.quantile(drawn, [edge, 1.0 - edge])
    return Figure(value, float(low), float(high))
