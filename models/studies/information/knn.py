"""Mutual information from distances to nearest neighbours, temporal neighbours excluded.

Source: B. C. Ross, Mutual information between discrete and continuous data sets, PLoS ONE 9, 2014;
J. Theiler, Spurious dimension from correlation algorithms applied to limited time-series data,
Physical Review A 34, 1986, for excluding neighbours in time.

The estimate counts how many points lie closer than the k-th neighbour. It assumes that points are
drawn independently of one another, and that density is about even between a point and that
neighbour. Frames of one touch are not independent: an `Exclusion` removes them. scikit-learn's
`mutual_info_classif` is the same estimate for one dimension, without exclusion.
"""

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
    k, part, numbers = NEIGHBOURS, np.full(len(x), np.nan), np.arange(len(x))
    for rows in np.split(numbers, range(CHUNK, len(x), CHUNK)):
        allowed = rows[:, None] != numbers
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


def principal(x: NDArray[np.floating], count: int) -> NDArray[np.float64]:
    """Return so many principal components of points (n, d), the greatest first, (n, count)."""
    centred = np.asarray(x, dtype=np.float64) - np.mean(x, axis=0)
    _, axes = np.linalg.eigh(np.atleast_2d(np.cov(centred.T)))
    return np.asarray(centred @ axes[:, ::-1][:, :count])
