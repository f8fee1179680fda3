"""Baseline of sweeps: extremely randomised trees on the trajectory of the touch.

Features of an image are centroid, spread and sum of the touch; features of a window are those of
its images, displacement, steps and speed, and mean, deviation, minimum and maximum of each. The
trees see the windows that the networks see; positions are in grid units from the upper left taxel.

A misread taxel moves the centroid, so the signal of a single taxel is left out: a finger always
covers several.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from models.data.examples import Examples

TREES: Final = 50
LEAF: Final = 2  # windows; 1 and 5 are no better
CHOSEN: Final = 0.4  # share of features that a node chooses from; their root is 2 points worse
FAINT: Final = 0.05  # share of a firm touch's peak: a taxel with less is untouched
LITTLE: Final = 0.15  # the same, of an image's strongest taxel
FIRM: Final = 0.9  # quantile of images' peaks, about that of a firm touch
ALONE: Final = 0.35  # least share of the signal of a touched taxel in a neighbour
NOWHERE: Final = -1.0  # position of an untouched image

Rows = NDArray[np.float32]  # (n, features)


def features(examples: Examples) -> Rows:
    """Return the features of every window, (windows, features)."""
    touches = _touches(examples.images)
    index = examples.ends[:, None] + np.arange(1 - examples.window, 1)
    x, y, spread, total = (touches[:, i][index] for i in range(touches.shape[1]))
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


def train(rows: Rows, label: NDArray[np.integer], seed: int) -> Any:
    """Return trees trained on rows (windows, features) and their classes (windows,)."""
    from sklearn.ensemble import ExtraTreesClassifier

    trees = ExtraTreesClassifier(
        TREES, min_samples_leaf=LEAF, max_features=CHOSEN, random_state=seed
    )
    return trees.fit(rows, label)


def predict(trees: Any, rows: Rows, classes: int) -> NDArray[np.float32]:
    """Return the probability of each class, (windows, classes)."""
    answers = np.zeros((len(rows), classes), dtype=np.float32)
    answers[:, trees.classes_] = trees.predict_proba(rows)
    return answers


def _touches(images: NDArray[np.float32]) -> Rows:
    """Return x, y, spread (grid units), sum, (n, 4), of touches in images (n, rows, columns)."""
    signal = _signal(images)
    firm = float(np.quantile(signal.reshape(len(signal), -1).max(axis=1), FIRM))
    ring = np.ones((1, 3, 3), dtype=np.bool_)
    ring[0, 1, 1] = False
    near = ndimage.maximum_filter(signal, footprint=ring, mode="constant")
    signal[(signal > LITTLE * firm) & (near < ALONE * signal)] = 0.0
    peak = signal.reshape(len(signal), -1).max(axis=1)
    signal[signal < FAINT * firm] = 0.0
    total = signal.sum(axis=(1, 2))
    some = np.maximum(total, 1e-9)
    row, column = np.mgrid[: images.shape[1], : images.shape[2]].astype(np.float32)
    x, y = (signal * column).sum(axis=(1, 2)) / some, (signal * row).sum(axis=(1, 2)) / some
    square = (signal * (column**2 + row**2)).sum(axis=(1, 2)) / some - x**2 - y**2
    found = np.stack([x, y, np.sqrt(np.maximum(square, 0.0)), total], axis=1)
    found[peak < LITTLE * firm] = NOWHERE, NOWHERE, 0.0, 0.0
    return np.asarray(found, dtype=np.float32)


def _signal(images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what a touch adds to images, or takes from them: the direction that is stronger."""
    rise = images.max(axis=(1, 2)) - 1.0
    fall = 1.0 - images.min(axis=(1, 2))
    sign = 1.0 if np.quantile(rise, FIRM) >= np.quantile(fall, FIRM) else -1.0
    return np.asarray(np.maximum(sign * (images - 1.0), 0.0), dtype=np.float32)
