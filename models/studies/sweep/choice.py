"""The best of many, and how much of that is luck.

Who takes the best of many noisy scores takes luck with it: the winner is, on average, worse than
its score. How much is found by letting it happen again: people are drawn with replacement, the
best on them is chosen, and it is judged on the people who were not drawn.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models.evaluation.bootstrap import LEVEL
from models.results.figure import Figure
from models.studies.sweep.figures import Measure, Point, columns

DRAWS: Final = 2000
FEWEST: Final = 3  # units: of fewer, too often nobody is left to judge
LEARNING: Final = ("users", "sessions", "minutes")  # of these more is better, and nothing chosen


@dataclass(frozen=True, slots=True)
class Choice:
    """The best point.

    Attributes:
        best: The point.
        second: The next one.
        better: By how much the best is better, and its interval; people are the same in both.
        luck: How much better the chosen one looks than it is; 0 where nothing can be told.
        kept: Share of the draws in which the same one is the best.
        units: How many people or sessions judged.
    """

    best: Point
    second: Point
    better: Figure
    luck: float
    kept: float
    units: int


def choose(points: Sequence[Point], measure: Measure, seed: int = 0) -> Choice | None:
    """Return the best of several points; None: there is nothing to choose from.

    Nothing is chosen between amounts of what is learned from (more is better, that is all), and
    nothing across data sets, which have other people.
    """
    settings = {axis for point in points for axis in point.at} - set(LEARNING)
    if len(points) < 2 or not settings or any(axis.startswith("data.") for axis in settings):
        return None
    if any(point.counts.keys() != points[0].counts.keys() for point in points):
        return None  # some failed
    sign = measure.sign()
    tops, bottoms = (np.array(one) for one in zip(*map(_columns, points), strict=True))
    order = np.argsort(-sign * tops.sum(axis=1) / bottoms.sum(axis=1), kind="stable")
    best, second = int(order[0]), int(order[1])
    units = tops.shape[1]
    drawn = _draws(units, seed)
    scores = _scores(tops, bottoms, drawn)
    better = sign * (scores[:, best] - scores[:, second])
    whole = sign * (points[best].figure.value - points[second].figure.value)
    low, high = _middle(better) if units >= FEWEST else (np.nan, np.nan)
    winner = np.argmax(sign * scores, axis=1)
    luck = 0.0
    if units >= FEWEST:
        left = _scores(tops, bottoms, (drawn == 0).astype(np.float64))
        rows = np.arange(len(drawn))
        lost = sign * (scores[rows, winner] - left[rows, winner])
        luck = max(0.0, float(np.nanmean(lost)))
    return Choice(
        points[best],
        points[second],
        Figure(whole, low, high),
        luck,
        float((winner == best).mean()),
        units,
    )


def _columns(point: Point) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return columns(point.counts)


def _draws(units: int, seed: int) -> NDArray[np.float64]:
    """Return how often each unit is drawn, (draws, units)."""
    rng = np.random.default_rng(seed)
    return rng.multinomial(units, np.full(units, 1.0 / units), DRAWS).astype(np.float64)


def _scores(
    tops: NDArray[np.float64], bottoms: NDArray[np.float64], weight: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the score of each point in each draw, (draws, points); NaN where nobody is in it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((weight @ tops.T) / (weight @ bottoms.T))


def _middle(values: NDArray[np.float64]) -> tuple[float, float]:
    edge = (1.0 - LEVEL) / 2.0
    low, high = np.nanquantile(values, [edge, 1.0 - edge])
    return float(low), float(high)
