"""Baseline of sweeps: extremely randomised trees on the touch's trajectory and on each taxel.

Features of an image are centroid, spread and sum of the touch; features of a window are those of
its images, displacement, steps and speed, and mean, deviation, minimum and maximum of each; and of
each taxel mean, deviation, maximum, share of the sum, and the spectrum of its course. The trees are
judged on the windows that the networks see; positions are in grid units from the upper left taxel.
Places are learned from the shares of taxels in the sum of a touch's image.

A misread taxel moves the centroid, so the signal of a single taxel is left out of the trajectory: a
finger always covers several.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

TREES: Final = 250  # of each forest: one sees the trajectory, the other all features
LEAF: Final = 2  # windows; 1 and 5 are no better
# Share of features that a node chooses from. All together they are too many for as large a share,
# and one forest of their root is 2 points worse than the trajectory alone; the mean is better.
CHOSEN: Final = (0.4, "sqrt")
LEARNED: Final = 20_000  # windows, evenly spread: neighbours are nearly the same
WAVES: Final = 3  # lowest frequencies of a taxel's course
AT_ONCE: Final = 2_000  # windows whose features are in memory together
FAINT: Final = 0.05  # share of a firm touch's peak: a taxel with less is untouched
LITTLE: Final = 0.15  # the same, of an image's strongest taxel
FIRM: Final = 0.9  # quantile of images' peaks, about that of a firm touch
ALONE: Final = 0.35  # least share of the signal of a touched taxel in a neighbour
NOWHERE: Final = -1.0  # position of an untouched image

Rows = NDArray[np.float32]  # (n, features)
Images = NDArray[np.float32]  # (n, rows, columns)
Windows = NDArray[np.float32]  # images of windows, (n, window, rows, columns), oldest first


@dataclass(frozen=True, slots=True)
class Signal:
    """Signal of a sensor, as its training windows show it."""

    sign: float  # 1 or -1: touches raise images, or lower them
    firm: float  # peak of a firm touch

    @classmethod
    def of(cls, images: NDArray[np.float32]) -> "Signal":
        """Return that of images or windows, (..., rows, columns)."""
        above = float(np.quantile(images.max(axis=(-2, -1)) - 1.0, FIRM))
        below = float(np.quantile(1.0 - images.min(axis=(-2, -1)), FIRM))
        return cls(1.0 if above >= below else -1.0, max(above, below, 1e-9))

    def seen(self, images: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return what touches add to images (..., rows, columns), or take from them."""
        return np.asarray(np.maximum(self.sign * (images - 1.0), 0.0), dtype=np.float32)

    def trajectory(self, windows: Windows) -> Rows:
        """Return the features of windows' touches, (n, features)."""
        seen = self.seen(windows)
        touches = _touches(seen.reshape(-1, *seen.shape[2:]), self.firm)
        x, y, spread, total = np.moveaxis(touches.reshape(*seen.shape[:2], -1), -1, 0)
        steps = np.diff(x, axis=1), np.diff(y, axis=1)
        speed = np.hypot(*steps)
        way = np.stack([x[:, -1] - x[:, 0], y[:, -1] - y[:, 0]], axis=1)
        whole = [
            of(one, axis=1)[:, None]
            for one in (x, y, spread, total, speed)
            for of in (np.mean, np.std, np.min, np.max)
        ]
        parts = [x, y, spread, total, *steps, speed, way, np.hypot(*way.T)[:, None], *whole]
        return np.concatenate(parts, axis=1).astype(np.float32)

    def features(self, windows: Windows) -> Rows:
        """Return all features of windows, the trajectory's first, (n, features)."""
        parts = range(0, len(windows), AT_ONCE)
        return np.concatenate([self._features(windows[i : i + AT_ONCE]) for i in parts])

    def _features(self, windows: Windows) -> Rows:
        course = self.seen(windows).reshape(*windows.shape[:2], -1)
        mean = course.mean(axis=1)
        share = mean / np.maximum(mean.sum(axis=1, keepdims=True), 1e-9)
        waves = np.abs(np.fft.rfft(course, axis=1)[:, 1 : WAVES + 1]).reshape(len(course), -1)
        own = [mean, course.std(axis=1), course.max(axis=1), share, waves]
        return np.concatenate([self.trajectory(windows), *own], axis=1).astype(np.float32)


def shares(images: Images) -> Rows:
    """Return shares of the sum, centroid and sum of images (n, rows, columns), (n, features)."""
    signal = Signal.of(images).seen(images)
    row, column = np.mgrid[: signal.shape[1], : signal.shape[2]].astype(np.float32)
    total = signal.sum(axis=(1, 2))
    share = signal / np.maximum(total, 1e-9)[:, None, None]
    centroid = [(share * axis).sum(axis=(1, 2)) for axis in (column, row)]
    return np.column_stack([share.reshape(len(share), -1), *centroid, total])


def train_places(images: Images, place: Rows, seed: int) -> Any:
    """Return trees trained on images (n, rows, columns) and their places (n, 2), grid units."""
    from sklearn.ensemble import ExtraTreesRegressor

    trees = ExtraTreesRegressor(2 * TREES, min_samples_leaf=LEAF, random_state=seed)
    every = -(-len(images) // LEARNED)
    return trees.fit(shares(images[::every]), place[::every])


def _touches(signal: Images, firm: float) -> Rows:
    """Return x, y, spread, sum, (n, 4), of touches in a signal (n, rows, columns), changed here."""
    ring = np.ones((1, 3, 3), dtype=np.bool_)
    ring[0, 1, 1] = False
    near = ndimage.maximum_filter(signal, footprint=ring, mode="constant")
    signal[(signal > LITTLE * firm) & (near < ALONE * signal)] = 0.0
    peak = signal.reshape(len(signal), -1).max(axis=1)
    signal[signal < FAINT * firm] = 0.0
    total = signal.sum(axis=(1, 2))
    some = np.maximum(total, 1e-9)
    row, column = np.mgrid[: signal.shape[1], : signal.shape[2]].astype(np.float32)
    x, y = (signal * column).sum(axis=(1, 2)) / some, (signal * row).sum(axis=(1, 2)) / some
    square = (signal * (column**2 + row**2)).sum(axis=(1, 2)) / some - x**2 - y**2
    found = np.stack([x, y, np.sqrt(np.maximum(square, 0.0)), total], axis=1)
    found[peak < LITTLE * firm] = NOWHERE, NOWHERE, 0.0, 0.0
    return np.asarray(found, dtype=np.float32)
