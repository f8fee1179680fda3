"""Mutual information from distances to nearest neighbours, temporal neighbours excluded.

Source: B. C. Ross, Mutual information between discrete and continuous data sets, PLoS ONE 9, 2014;
A. Kraskov, H. Stögbauer, P. Grassberger, Estimating mutual information, Physical Review E 69, 2004
(first algorithm); J. Theiler, Spurious dimension from correlation algorithms applied to limited
time-series data, Physical Review A 34, 1986, for excluding neighbours in time.

Both count how many points lie closer than the k-th neighbour. Both assume that points are drawn
independently of one another, and that density is about even between a point and that neighbour.
Frames of one touch are not independent: an `Exclusion` removes them, both as neighbours and from
the counts. All distances are computed, in chunks: a few seconds for 10,000 points. scikit-learn's
`mutual_info_classif` is the same estimate for one dimension, without exclusion.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist  # the [train] extra
from scipy.special import digamma, ndtri

Points = NDArray[np.float64]  # (n, dimensions)
Parts = NDArray[np.float64]  # (n,), nats: contribution of each point; their mean is the estimate

NEIGHBOURS: Final = 3  # k; more scatter less and are more biased
CHUNK: Final = 128  # points whose distances to all others are in memory at once
VARIANCE: Final = 1e-9  # of the greatest: axes with less are not whitened


@dataclass(frozen=True, slots=True, eq=False)
class Exclusion:
    """Pairs of points that may not be neighbours: those of one group, and those close in time.

    Attributes:
        group: Group of each point, such as its event, (n,).
        time: Time of each point, counted within its session, (n,).
        session: Session of each point, (n,).
        window: Largest difference in time that is excluded.
    """

    group: NDArray[np.integer]
    time: NDArray[np.integer]
    session: NDArray[np.integer]
    window: int = 0

    def mask(self, rows: slice) -> NDArray[np.bool_]:
        """Return which pairs of some points and all points are excluded, (rows, n)."""
        near = np.abs(self.time[rows, None] - self.time[None]) <= self.window
        near &= self.session[rows, None] == self.session[None]
        return np.asarray(near | (self.group[rows, None] == self.group[None]))


def ross(
    x: NDArray[np.floating],
    y: NDArray[np.integer],
    k: int = NEIGHBOURS,
    exclusion: Exclusion | None = None,
) -> Parts:
    """Return each point's part of I(x; y) for a discrete y; their mean is the estimate.

    Args:
        x: Points, (n, d); scale and rotation matter little.
        y: Class of each, (n,).
        k: Rank of the neighbour of the same class that sets the radius.
        exclusion: Pairs that may not be neighbours.

    Returns:
        (n,); NaN where a point has fewer than k neighbours of its class.
    """
    part = np.full(len(x), np.nan)
    for rows, allowed in _chunks(len(x), exclusion):
        distance = cdist(x[rows], x, "sqeuclidean")
        same = allowed & (y[rows, None] == y[None])
        every, own = allowed.sum(axis=1), same.sum(axis=1)
        radius = np.partition(np.where(same, distance, np.inf), k - 1, axis=1)[:, k - 1, None]
        inside = (allowed & (distance < radius)).sum(axis=1)
        value = digamma(every + 1) - digamma(own + 1) + digamma(k) - digamma(inside + 1)
        part[rows] = np.where(own >= k, value, np.nan)
    return part


def ksg(x: NDArray[np.floating], y: NDArray[np.floating], k: int = NEIGHBOURS) -> Parts:
    """Return each pair's part of I(x; y) for a continuous y, (n,); their mean is the estimate.

    Args:
        x: Points, (n, d).
        y: Points, (n, e).
        k: Rank of the neighbour in both that sets the radius; less than n.
    """
    part = np.empty(len(x))
    for rows, allowed in _chunks(len(x)):
        both = [cdist(points[rows], points, "sqeuclidean") for points in (x, y)]
        joint = np.where(allowed, np.maximum(*both), np.inf)
        radius = np.partition(joint, k - 1, axis=1)[:, k - 1, None]
        of_x, of_y = (digamma((allowed & (one < radius)).sum(axis=1) + 1) for one in both)
        part[rows] = digamma(k) + digamma(len(x)) - of_x - of_y
    return part


def ksg_corrected(
    x: NDArray[np.floating], y: NDArray[np.floating], k: int = NEIGHBOURS, seed: int = 0
) -> tuple[Parts, float]:
    """Return `ksg`, and its bias on a Gaussian of the same shape, to be added to the mean.

    In five dimensions and more the nearest neighbours are too far away for density to be even, and
    `ksg` misses much of a strong dependence. Each coordinate is first made normal (by its ranks),
    and x and y are whitened, which changes no information. Then as many points are drawn from the
    Gaussian with the same correlations: its information is known, and what `ksg` misses of it is
    the correction. As n grows, it vanishes whatever the data are. It is exact only for what is
    Gaussian up to a change of each coordinate; of heavy tails that all coordinates share, only a
    part is recovered.

    Args:
        x: Points, (n, d).
        y: Points, (n, e).
        k: As in `ksg`.
        seed: Of the drawn points: three draws in few dimensions, one in many.
    """
    u, v = whitened(normal(x)), whitened(normal(y))
    both = np.hstack([u, v])
    correlation = np.cov(both.T)
    known = _gaussian_information(correlation, u.shape[1])
    root = np.linalg.cholesky(correlation + 1e-12 * np.eye(len(correlation)))
    rng = np.random.default_rng(seed)
    missed = []
    for _ in range(3 if both.shape[1] <= 6 else 1):
        drawn = rng.normal(size=both.shape) @ root.T
        found = ksg(drawn[:, : u.shape[1]], drawn[:, u.shape[1] :], k)
        missed.append(known - float(found.mean()))
    return ksg(u, v, k), float(np.mean(missed))


def normal(x: NDArray[np.floating]) -> Points:
    """Return every column with its ranks mapped to a normal distribution, (n, d)."""
    rank = np.argsort(np.argsort(x, axis=0, kind="stable"), axis=0)
    return np.asarray(ndtri((rank + 0.5) / len(x)), dtype=np.float64)


def whitened(x: NDArray[np.floating]) -> Points:
    """Return points (n, d) along their principal axes, each of variance 1, (n, up to d)."""
    centred, variance, axes = _principal_axes(x)
    used = variance > VARIANCE * variance[-1]
    return np.asarray(centred @ axes[:, used] / np.sqrt(variance[used]))


def principal(x: NDArray[np.floating], count: int) -> Points:
    """Return so many principal components of points (n, d), the greatest first, (n, count)."""
    centred, _, axes = _principal_axes(x)
    return np.asarray(centred @ axes[:, ::-1][:, :count])


def _principal_axes(x: NDArray[np.floating]) -> tuple[Points, Points, Points]:
    """Return centred points (n, d), the variances (d,) in rising order, and their axes (d, d)."""
    centred = np.asarray(x, dtype=np.float64) - np.mean(x, axis=0)
    return centred, *np.linalg.eigh(np.atleast_2d(np.cov(centred.T)))


def _gaussian_information(correlation: Points, first: int) -> float:
    """Return the information between a Gaussian's first coordinates and the others, nats."""
    blocks = correlation[:first, :first], correlation[first:, first:], correlation
    of_first, of_others, of_all = (np.linalg.slogdet(block)[1] for block in blocks)
    return float(0.5 * (of_first + of_others - of_all))


def _chunks(
    count: int, exclusion: Exclusion | None = None
) -> Iterator[tuple[slice, NDArray[np.bool_]]]:
    """Yield some rows, and which points may be neighbours of each, (rows, n); never itself."""
    for first in range(0, count, CHUNK):
        rows = slice(first, min(first + CHUNK, count))
        own = np.arange(rows.start, rows.stop)
        allowed = np.ones((len(own), count), dtype=np.bool_)
        if exclusion is not None:
            allowed = ~exclusion.mask(rows)
        allowed[own - first, own] = False
        yield rows, allowed
