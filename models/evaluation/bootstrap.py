"""Bootstrap intervals: 95 % by resampling whole sessions, or whole events.

Events of one session share a hand, an orb and a day, so they are not independent; sessions are.
Without any failure resampling would give an interval of length zero; then the bound is the rate at
which so long a run without one has a probability of 5 % (3 / n, the rule of three).

Windows of one event are nearly one observation. The interval of `event_gain` resamples events: it
covers other touches of the same sessions, not other days or people.
"""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from controller.shared.aliases import Index
from models.results.evaluation import Figure

LEVEL: Final = 0.95
DRAWS: Final = 2000
EVENT_DRAWS: Final = 400
_SILENT: Final = 3.0  # -ln 0.05, about: expected events of which none has p = 0.05

Values = NDArray[np.float64]  # (n,), or (draws,) of resamplings


def rate(count: ArrayLike, amount: ArrayLike, seed: int = 0) -> Figure:
    """Return events per amount, (sessions,) each, such as false alarms per idle minute."""
    hits, of = np.asarray(count, dtype=np.float64), np.asarray(amount, dtype=np.float64)
    if not hits.any():
        return Figure(ratio(0.0, of.sum()), 0.0, ratio(_SILENT, of.sum()))
    return _ratio_figure(hits, of, seed)


def share(right: ArrayLike, total: ArrayLike, seed: int = 0) -> Figure:
    """Return hits of how many, (sessions,) each, such as the events that were recognised."""
    hits, of = np.asarray(right, dtype=np.float64), np.asarray(total, dtype=np.float64)
    value, silent = ratio(hits.sum(), of.sum()), ratio(_SILENT, of.sum())
    if not of.any():
        return Figure(value, value, value)
    if (hits == of).all():
        return Figure(value, max(0.0, 1.0 - silent), value)
    if not hits.any():
        return Figure(value, value, min(1.0, silent))
    return _ratio_figure(hits, of, seed)


def f1(hits: ArrayLike, answers: ArrayLike, events: ArrayLike, seed: int = 0) -> Figure:
    """Return 2 hits / (answers + events), the mean of precision and recall; each (sessions,)."""
    twice = 2.0 * np.asarray(hits, dtype=np.float64)
    both = np.asarray(answers, dtype=np.float64) + np.asarray(events, dtype=np.float64)
    return share(twice, both, seed)


def median(values: Sequence[NDArray[np.floating]], seed: int = 0) -> Figure:
    """Return the median of measurements such as latencies, (measurements,) for each session."""
    return _pooled(values, np.median, seed)


def mean(values: Sequence[NDArray[np.floating]], seed: int = 0) -> Figure:
    """Return the mean of measurements such as errors, (measurements,) for each session."""
    return _pooled(values, np.mean, seed)


def event_gain(log_p: Values, y: Index, event: Index) -> Figure:
    """Return H(y) - cross-entropy, nats, both of the same windows, resampled by event.

    Of each window, (windows,): the logarithm of the probability given to the true class, NaN left
    out; that class; and the number of its event.
    """
    known = np.isfinite(log_p)
    log_p, y, event = log_p[known], y[known], event[known]
    if not len(y):
        return Figure(np.nan, np.nan, np.nan)
    sums, counts = group_sums(log_p, event)
    classes = np.stack(
        [group_sums(own, event)[0] for own in np.eye(int(y.max()) + 1)[:, y]], axis=1
    )

    def gain(drawn: Values) -> Values:
        total = drawn @ counts
        p = (drawn @ classes) / total[:, None]
        entropy = -np.where(p > 0, p * np.log(np.maximum(p, 1e-300)), 0.0).sum(axis=1)
        return np.asarray((drawn @ sums) / total + entropy)

    whole = gain(np.ones((1, len(sums))))
    return Figure(float(whole[0]), *middle(gain(weights(len(sums), draws=EVENT_DRAWS))))


def ratio(top: float, bottom: float) -> float:
    """Return a ratio; NaN of nothing."""
    return float(top / bottom) if bottom else float("nan")


def group_sums(values: ArrayLike, group: NDArray[np.integer]) -> tuple[Values, Values]:
    """Return the sum and the number of the values (n,) of each group that occurs, (groups,)."""
    _, number = np.unique(group, return_inverse=True)
    return np.bincount(number, values).astype(np.float64), np.bincount(number).astype(np.float64)


def middle(values: Values) -> tuple[float, float]:
    """Return the bounds of the middle 95 % of the finite values, (draws,)."""
    edge = (1.0 - LEVEL) / 2.0
    low, high = np.quantile(values[np.isfinite(values)], [edge, 1.0 - edge])
    return float(low), float(high)


def weights(units: int, seed: int = 0, draws: int = DRAWS) -> Values:
    """Return how often each unit is in each resampling, (draws, units)."""
    rng = np.random.default_rng(seed)
    return rng.multinomial(units, np.full(units, 1.0 / units), draws).astype(np.float64)


def _pooled(
    values: Sequence[NDArray[np.floating]], how: Callable[[Values], np.floating], seed: int
) -> Figure:
    """Return a statistic of the measurements of all sessions, (measurements,) each."""
    lists = [np.asarray(v, dtype=np.float64) for v in values if len(v)]
    if not lists:
        return Figure(np.nan, np.nan, np.nan)
    picks = np.random.default_rng(seed).integers(0, len(lists), (DRAWS // 4, len(lists)))
    drawn = [how(np.concatenate([lists[i] for i in pick])) for pick in picks]
    return _figure(how(np.concatenate(lists)), np.array(drawn), len(lists))


def _ratio_figure(top: Values, bottom: Values, seed: int = 0, draws: int = DRAWS) -> Figure:
    """Return the ratio of two sums over sessions, (sessions,) each, and its interval."""
    if not len(top):
        return Figure(np.nan, np.nan, np.nan)
    drawn = weights(len(top), seed, draws)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = (drawn @ top) / (drawn @ bottom)
    return _figure(ratio(top.sum(), bottom.sum()), ratios, len(top))


def _figure(value: float | np.floating, drawn: Values, sessions: int) -> Figure:
    """Return a figure with the interval of its resamplings, (draws,); NaN of a single session."""
    return Figure(float(value), *(middle(drawn) if sessions > 1 else (np.nan, np.nan)))
