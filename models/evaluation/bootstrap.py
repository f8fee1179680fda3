"""Bootstrap intervals: 95 % by resampling whole sessions.

Events of one session share a hand, an orb and a mood, so they are not independent; sessions are.
Where nothing was seen to fail, resampling would promise that nothing ever does; then the bound
is the one below which so long a silence has a probability of 5 % (3 / n, the rule of three).
"""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.results.figure import Figure

LEVEL: Final = 0.95
DRAWS: Final = 2000
_Of = Callable[[NDArray[np.int64]], NDArray[np.float64]]
_SILENT: Final = 3.0  # -ln 0.05, about: events of which a silence of one has p = 0.05


def rate(count: ArrayLike, amount: ArrayLike, seed: int = 0) -> Figure:
    """Return what happens per amount, such as false alarms per idle minute.

    Args:
        count: How often in each session, (sessions,).
        amount: Of each session, (sessions,).
        seed: Of the resampling.
    """
    hits, of = np.asarray(count, dtype=np.float64), np.asarray(amount, dtype=np.float64)
    value = _ratio(hits.sum(), of.sum())
    if not hits.any():
        return Figure(value, 0.0, _ratio(_SILENT, of.sum()))
    return Figure(value, *_bounds(lambda pick: _ratios(hits[pick], of[pick]), len(hits), seed))


def share(right: ArrayLike, total: ArrayLike, seed: int = 0) -> Figure:
    """Return a share, such as the events that were recognised.

    Args:
        right: How many in each session, (sessions,).
        total: Of how many, (sessions,).
        seed: Of the resampling.
    """
    hits, of = np.asarray(right, dtype=np.float64), np.asarray(total, dtype=np.float64)
    value = _ratio(hits.sum(), of.sum())
    if (hits == of).all():
        return Figure(value, max(0.0, 1.0 - _ratio(_SILENT, of.sum())), value)
    if not hits.any():
        return Figure(value, value, min(1.0, _ratio(_SILENT, of.sum())))
    return Figure(value, *_bounds(lambda pick: _ratios(hits[pick], of[pick]), len(hits), seed))


def f1(hits: ArrayLike, answers: ArrayLike, events: ArrayLike, seed: int = 0) -> Figure:
    """Return the harmonic mean of precision and recall: 2 hits / (answers + events)."""
    twice = 2.0 * np.asarray(hits, dtype=np.float64)
    both = np.asarray(answers, dtype=np.float64) + np.asarray(events, dtype=np.float64)
    return share(twice, both, seed)


def median(values: Sequence[NDArray[np.floating]], seed: int = 0) -> Figure:
    """Return the median of what the sessions measured, such as latencies: a list for each."""
    return _pooled(values, np.median, seed)


def mean(values: Sequence[NDArray[np.floating]], seed: int = 0) -> Figure:
    """Return the mean of what the sessions measured, such as errors: a list for each."""
    return _pooled(values, np.mean, seed)


def _pooled(
    values: Sequence[NDArray[np.floating]],
    how: Callable[[NDArray[np.float64]], np.floating],
    seed: int,
) -> Figure:
    lists = [np.asarray(v, dtype=np.float64) for v in values if len(v)]
    if not lists:
        return Figure(np.nan, np.nan, np.nan)

    def of(picks: NDArray[np.int64]) -> NDArray[np.float64]:
        return np.array([how(np.concatenate([lists[i] for i in pick])) for pick in picks])

    return Figure(float(how(np.concatenate(lists))), *_bounds(of, len(lists), seed, DRAWS // 4))


def _bounds(of: _Of, sessions: int, seed: int, draws: int = DRAWS) -> tuple[float, float]:
    """Return the middle 95 % of a figure over resampled sessions."""
    if sessions < 2:
        return np.nan, np.nan
    picks = np.random.default_rng(seed).integers(0, sessions, (draws, sessions))
    figures = of(picks)
    edge = (1.0 - LEVEL) / 2.0
    low, high = np.quantile(figures[np.isfinite(figures)], [edge, 1.0 - edge])
    return float(low), float(high)


def _ratios(top: NDArray[np.float64], bottom: NDArray[np.float64]) -> NDArray[np.float64]:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(top.sum(axis=1) / bottom.sum(axis=1))


def _ratio(top: float, bottom: float) -> float:
    return float(top / bottom) if bottom else float("nan")
