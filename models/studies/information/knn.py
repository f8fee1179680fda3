"""Mutual information from distances to nearest neighbours, temporal neighbours excluded.

Source: B. C. Ross, Mutual information between discrete and continuous data sets, PLoS ONE 9, 2014;
A. Kraskov, H. Stögbauer, P. Grassberger, Estimating mutual information, Physical Review E 69, 2004
(first algorithm); J. Theiler, Spurious dimension from correlation algorithms applied to limited
time-series data, Physical Review A 34, 1986, for excluding neighbours in time.

Both count how many points lie closer than the k-th neighbour. Both assume that points are drawn
independently of one another, and that density is about even between a point and that neighbour. In
many dimensions it is not, and both are too low. Frames of one touch are not independent: an
`Exclusion` removes them. scikit-learn's `mutual_info_classif` is the first estimate for one
dimension, without exclusion.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist  # the [train] extra
from scipy.special import digamma

Parts = NDArray[np.float64]  # (n,), nats: contribution of each point; their mean is the estimate

NEIGHBOURS: Final = 3  # k; more scatter less and are more biased
CHUNK: Final = 128  # points whose distances to all others are in memory at once


@dataclass(frozen=True, slots=True, eq=False)
class Exclusion:
    """Pairs of points that may not be neighbours: those of one group, and those close in time."""

    group: NDArray[np.integer]  # group of each point, such as its event, (n,)
    time: NDArray[np.integer]  # time of each point, counted within its session, (n,)
    session: NDArray[np.integer]  # session of each point, (n,)
    window: int = 0  # largest difference in time that is excluded

    def mask(self, rows: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return which pairs of some points and all points are excluded, (rows, n)."""
        near = np.abs(self.time[rows, None] - self.time[None]) <= self.window
        near &= self.session[rows, None] == self.session[None]
        return np.asarray(near | (self.group[rows, None] == self.group[None]))


def ross(
    x: NDArray[np.floating], y: NDArray[np.integer], exclusion: Exclusion | None = None
) -> Parts:
    """Return each point's part of I(x; y), (n,); NaN with fewer than `NEIGHBOURS` of its class."""
    k, part = NEIGHBOURS, np.full(len(x), np.nan)
    for rows, allowed in _chunks(len(x)):
        if exclusion is not None:
            allowed &= ~exclusion.mask(rows)
        distance = cdist(x[rows], x, "sqeuclidean")
        same = allowed & (y[rows, None] == y[None])
        every, own = allowed.sum(axis=1), same.sum(axis=1)
        radius = np.partition(np.where(same, distance, np.inf), k - 1, axis=1)[:, k - 1, None]
        inside = (allowed & (distance < radius)).sum(axis=1)
        value = digamma(every + 1) - digamma(own + 1) + digamma(k) - digamma(inside + 1)
        part[rows] = np.where(own >= k, value, np.nan)
    return part


def ksg(x: NDArray[np.floating], y: NDArray[np.floating]) -> Parts:
    """Return each pair's part of I(x; y) for a continuous y, (n,)."""
    k, part = NEIGHBOURS, np.empty(len(x))
    for rows, allowed in _chunks(len(x)):
        both = [cdist(points[rows], points, "sqeuclidean") for points in (x, y)]
        joint = np.where(allowed, np.maximum(*both), np.inf)
        radius = np.partition(joint, k - 1, axis=1)[:, k - 1, None]
        of_x, of_y = (digamma((allowed & (one < radius)).sum(axis=1) + 1) for one in both)
        part[rows] = digamma(k) + digamma(len(x)) - of_x - of_y
    return part


def _chunks(count: int) -> Iterator[tuple[NDArray[np.int64], NDArray[np.bool_]]]:
    """Yield numbers of some points, and which of all are others than each, (rows, n)."""
    numbers = np.arange(count)
    for rows in np.split(numbers, range(CHUNK, count, CHUNK)):
        yield rows, rows[:, None] != numbers


def principal(x: NDArray[np.floating], count: int) -> NDArray[np.float64]:
    """Return so many principal components of points (n, d), the greatest first, (n, count)."""
    centred = np.asarray(x, dtype=np.float64) - np.mean(x, axis=0)
    _, axes = np.linalg.eigh(np.atleast_2d(np.cov(centred.T)))
    return np.asarray(centred @ axes[:, ::-1][:, :count])
