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

from controller.shared.aliases import Index
from models.data.examples import Examples

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


@dataclass(frozen=True, slots=True)
class Frames:
    """What the features of windows are made of."""

    touches: Rows  # x, y, spread (grid units) and sum of each frame's touch, (frames, 4)
    signal: Rows  # what touches add to each taxel, (frames, taxels)
    window: int  # frames

    @classmethod
    def of(cls, examples: Examples) -> "Frames":
        """Return those of a data set."""
        signal = _signal(examples.images)
        touches = _touches(signal.copy())
        return cls(touches, signal.reshape(len(signal), -1), examples.window)

    def index(self, ends: Index) -> Index:
        """Return the frames of windows by their last ones, (windows, frames)."""
        return ends[:, None] + np.arange(1 - self.window, 1)

    def trajectory(self, ends: Index) -> Rows:
        """Return the features of windows' touches by their last frames, (windows, features)."""
        index = self.index(ends)
        x, y, spread, total = (self.touches[:, i][index] for i in range(self.touches.shape[1]))
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

    def features(self, ends: Index) -> Rows:
        """Return all features of windows, the trajectory's first, (windows, features)."""
        course = self.signal[self.index(ends)]
        mean = course.mean(axis=1)
        share = mean / np.maximum(mean.sum(axis=1, keepdims=True), 1e-9)
        waves = np.abs(np.fft.rfft(course, axis=1)[:, 1 : WAVES + 1]).reshape(len(ends), -1)
        parts = [self.trajectory(ends), mean, course.std(axis=1), course.max(axis=1), share, waves]
        return np.concatenate(parts, axis=1).astype(np.float32)


def train(examples: Examples, seed: int) -> list[Any]:
    """Return two forests trained on at most `LEARNED` windows: trajectory, and all features."""
    from sklearn.ensemble import ExtraTreesClassifier

    ends = examples.ends[:: -(-len(examples.ends) // LEARNED)]
    frames, label = Frames.of(examples), examples.label[ends]
    return [
        ExtraTreesClassifier(
            TREES, min_samples_leaf=LEAF, max_features=chosen, random_state=seed
        ).fit(rows, label)
        for rows, chosen in zip(
            (frames.trajectory(ends), frames.features(ends)), CHOSEN, strict=True
        )
    ]


def predict(forests: list[Any], examples: Examples, classes: int) -> NDArray[np.float32]:
    """Return the probability of each class, mean of the forests, (windows, classes)."""
    answers = np.zeros((len(examples.ends), classes), dtype=np.float32)
    frames = Frames.of(examples)
    for first in range(0, len(answers), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        rows = frames.features(examples.ends[some])
        for forest in forests:
            own = forest.predict_proba(rows[:, : forest.n_features_in_])
            answers[some, forest.classes_] += own / len(forests)
    return answers


def shares(images: Images) -> Rows:
    """Return shares of the sum, centroid and sum of images (n, rows, columns), (n, features)."""
    signal = _signal(images)
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


def _touches(signal: Images) -> Rows:
    """Return x, y, spread, sum, (n, 4), of touches in a signal (n, rows, columns), changed here."""
    firm = float(np.quantile(signal.reshape(len(signal), -1).max(axis=1), FIRM))
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


def _signal(images: Images) -> Images:
    """Return what a touch adds to images, or takes from them: the direction that is stronger."""
    rise = images.max(axis=(1, 2)) - 1.0
    fall = 1.0 - images.min(axis=(1, 2))
    sign = 1.0 if np.quantile(rise, FIRM) >= np.quantile(fall, FIRM) else -1.0
    return np.asarray(np.maximum(sign * (images - 1.0), 0.0), dtype=np.float32)
