"""Mutual information from distances between neighbours, of points that may follow one another.

Source: B. C. Ross, Mutual information between discrete and continuous data sets, PLoS ONE 9, 2014;
A. Kraskov, H. Stögbauer, P. Grassberger, Estimating mutual information, Physical Review E 69, 2004
(first algorithm); J. Theiler, Spurious dimension from correlation algorithms applied to limited
time-series data, Physical Review A 34, 1986, for leaving out neighbours in time.

Both count how many points lie closer than the k-th neighbour of a point's own kind. Both assume
that points are drawn independently of one another, and that density is about even between a point
and that neighbour; frames of one touch are not independent, so those that `apart` forbids are
neither neighbours nor counted. All distances are computed, in chunks: a few seconds for 10,000
points in any number of dimensions, NumPy only. Everything is in nats.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

NEIGHBOURS: Final = 3  # k; more scatter less and are more biased (tests/benchmarks/information.py)
CHUNK: Final = 128  # points whose distances to all others are in memory at once
_SERIES: Final = (1 / 12, 1 / 120, 1 / 252)  # of the digamma function, for large arguments
_LARGE: Final = 10


@dataclass(frozen=True, slots=True, eq=False)
class Apart:
    """Which points may not be neighbours: those of one group, and those close in time.

    Attributes:
        group: A number for each point, such as its event; equal ones are too close, (n,).
        time: When it was, (n,); points of one session count in the same time.
        session: Where that time counts, (n,).
        window: So far apart in time, or less, is too close.
    """

    group: NDArray[np.integer]
    time: NDArray[np.integer]
    session: NDArray[np.integer]
    window: int = 0

    def forbidden(self, rows: slice) -> NDArray[np.bool_]:
        """Return who may not be whose neighbour, (rows, n)."""
        near = np.abs(self.time[rows, None] - self.time[None]) <= self.window
        near &= self.session[rows, None] == self.session[None]
        return np.asarray(near | (self.group[rows, None] == self.group[None]))


def ross(
    x: NDArray[np.floating],
    y: NDArray[np.integer],
    k: int = NEIGHBOURS,
    apart: Apart | None = None,
) -> Points:
    """Return each point's part of I(x; y) for a discrete y; their mean is the estimate.

    Args:
        x: Points, (n, d); scale and rotate them as you like, it matters little.
        y: Class of each, (n,).
        k: Which neighbour of the same class the circle reaches to.
        apart: Who may not be neighbours; None: only a point and itself.

    Returns:
        (n,); NaN where a point has fewer than k neighbours of its class.
    """
    part = np.full(len(x), np.nan)
    for rows, distance in _distances(np.asarray(x, dtype=np.float64)):
        allowed = _allowed(rows, len(x), apart)
        same = allowed & (y[rows, None] == y[None])
        enough = same.sum(axis=1) >= k
        radius = _nearest(np.where(same, distance, np.inf), k)
        inside = (allowed & (distance < radius[:, None])).sum(axis=1)
        every, own = allowed.sum(axis=1), same.sum(axis=1)
        value = digamma(every + 1) - digamma(own + 1) + digamma(k) - digamma(inside + 1)
        part[rows] = np.where(enough, value, np.nan)
    return part


def ksg(
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    k: int = NEIGHBOURS,
    apart: Apart | None = None,
) -> Points:
    """Return each pair's part of I(x; y) for a continuous y; their mean is the estimate.

    Args:
        x: Points, (n, d).
        y: Points, (n, e).
        k: Which neighbour in both the circles reach to.
        apart: Who may not be neighbours.

    Returns:
        (n,); NaN where a pair has fewer than k neighbours.
    """
    part = np.full(len(x), np.nan)
    pairs = zip(
        _distances(np.asarray(x, dtype=np.float64)),
        _distances(np.asarray(y, dtype=np.float64)),
        strict=True,
    )
    for (rows, of_x), (_, of_y) in pairs:
        allowed = _allowed(rows, len(x), apart)
        enough = allowed.sum(axis=1) >= k
        radius = _nearest(np.where(allowed, np.maximum(of_x, of_y), np.inf), k)[:, None]
        closer = [(allowed & (one < radius)).sum(axis=1) for one in (of_x, of_y)]
        value = digamma(np.array(k)) + digamma(allowed.sum(axis=1) + 1)
        value = value - digamma(closer[0] + 1) - digamma(closer[1] + 1)
        part[rows] = np.where(enough, value, np.nan)
    return part


def ksg_corrected(
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    k: int = NEIGHBOURS,
    apart: Apart | None = None,
    *,
    seed: int = 0,
    draws: int = 0,
) -> tuple[Points, float]:
    """Return `ksg`, and what to add to its mean: what it misses of a Gaussian of the same shape.

    In five dimensions and more the nearest neighbours are too far away for density to be even, and
    `ksg` misses much of a strong dependence. Each coordinate is first made normal (its ranks), and
    x and y are whitened, which changes no information. Then as many points are drawn from the
    Gaussian with the same correlations: its information is known, and what `ksg` misses of it is
    the correction. As n grows, it goes to nothing whatever the data are. It is exact only for what
    is Gaussian up to a change of each coordinate; of heavy tails that all coordinates share, only
    a part comes back (tests/benchmarks/information.py).

    Args:
        x: Points, (n, d).
        y: Points, (n, e).
        k: As in `ksg`.
        apart: As in `ksg`; the drawn points are forbidden the same neighbours.
        seed: Of the drawing.
        draws: How often is drawn; 0: three times in few dimensions, once in many.
    """
    u, v = whitened(normal(x)), whitened(normal(y))
    both = np.hstack([u, v])
    correlation = np.cov(both.T)
    known = _gaussian(correlation, u.shape[1])
    root = np.linalg.cholesky(correlation + 1e-12 * np.eye(len(correlation)))
    rng = np.random.default_rng(seed)
    missed = []
    for _ in range(draws or (3 if both.shape[1] <= 6 else 1)):
        drawn = rng.normal(size=both.shape) @ root.T
        found = ksg(drawn[:, : u.shape[1]], drawn[:, u.shape[1] :], k, apart)
        missed.append(known - float(np.nanmean(found)))
    return ksg(u, v, k, apart), float(np.mean(missed))


def normal(x: NDArray[np.floating]) -> Points:
    """Return every column with its ranks in place of its values, normally distributed, (n, d)."""
    from scipy.special import ndtri  # the [train] extra

    rank = np.argsort(np.argsort(x, axis=0, kind="stable"), axis=0)
    return np.asarray(ndtri((rank + 0.5) / len(x)), dtype=np.float64)


def whitened(x: NDArray[np.floating], keep: float = 1e-9) -> Points:
    """Return points along their principal axes, each of variance 1, (n, up to d).

    Args:
        x: Points, (n, d).
        keep: Axes with less than this share of the greatest variance are left out.
    """
    centred = np.asarray(x, dtype=np.float64) - np.mean(x, axis=0)
    variance, axes = np.linalg.eigh(np.atleast_2d(np.cov(centred.T)))
    used = variance > keep * variance[-1]
    return np.asarray(centred @ axes[:, used] / np.sqrt(variance[used]))


def principal(x: NDArray[np.floating], count: int) -> Points:
    """Return so many principal components of points (n, d), the greatest first, (n, count)."""
    centred = np.asarray(x, dtype=np.float64) - np.mean(x, axis=0)
    _, axes = np.linalg.eigh(np.atleast_2d(np.cov(centred.T)))
    return np.asarray(centred @ axes[:, ::-1][:, :count])


def digamma(count: NDArray[np.integer] | int) -> NDArray[np.float64]:
    """Return the digamma function of whole numbers from 1."""
    n = np.asarray(count, dtype=np.int64)
    below = np.zeros(_LARGE)
    below[1:] = -np.euler_gamma + np.concatenate([[0.0], np.cumsum(1.0 / np.arange(1, _LARGE - 1))])
    large = np.maximum(n, _LARGE).astype(np.float64)
    inverse = 1.0 / large**2
    series = _SERIES[0] - inverse * (_SERIES[1] - inverse * _SERIES[2])
    far = np.log(large) - 0.5 / large - inverse * series
    return np.where(n < _LARGE, below[np.clip(n, 0, _LARGE - 1)], far)


def _gaussian(correlation: Points, first: int) -> float:
    """Return the mutual information of a Gaussian's first coordinates with the others, nats."""
    whole = np.linalg.slogdet(correlation)[1]
    parts = correlation[:first, :first], correlation[first:, first:]
    return float(0.5 * (sum(np.linalg.slogdet(part)[1] for part in parts) - whole))


def _distances(x: Points) -> Iterator[tuple[slice, Points]]:
    """Yield some rows, and their squared distances from all points, (rows, n)."""
    centred = x - x.mean(axis=0)
    square = (centred**2).sum(axis=1)
    for first in range(0, len(x), CHUNK):
        rows = slice(first, min(first + CHUNK, len(x)))
        found = square[rows, None] + square[None] - 2.0 * centred[rows] @ centred.T
        yield rows, np.maximum(found, 0.0)


def _allowed(rows: slice, count: int, apart: Apart | None) -> NDArray[np.bool_]:
    """Return who may be whose neighbour; nobody is their own, (rows, n)."""
    if apart is not None:
        allowed = ~apart.forbidden(rows)
    else:
        allowed = np.ones((rows.stop - rows.start, count), dtype=np.bool_)
    allowed[np.arange(rows.stop - rows.start), np.arange(rows.start, rows.stop)] = False
    return allowed


def _nearest(distance: Points, k: int) -> Points:
    """Return the k-th least value of each row, infinite where there is none."""
    if k > distance.shape[1]:
        return np.full(len(distance), math.inf)
    return np.asarray(np.partition(distance, k - 1, axis=1)[:, k - 1])
