"""A plain model to beat: extremely randomised trees on where a touch is, window by window.

Of each image: the centroid of what is touched, its spread and its sum; from them, over the window,
displacement, steps and speed, and of each of these mean, deviation, least and greatest. It sees the
very windows that the networks see, and places are told in grid units from the upper left taxel.

A centroid is at the mercy of single taxels that are read wrongly. `mended` is the same model
without them: what one taxel alone feels, where a finger always covers several, is left out.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from models.data.examples import Examples

TREES: Final = 50
LEAF: Final = 2  # windows; 1 and 5 are no better
ASKED: Final = 0.4  # share of features that a node chooses from; their root is 2 points worse
FAINT: Final = 0.05  # share of a firm touch's peak: a taxel that feels less is untouched
LITTLE: Final = 0.15  # likewise: an image whose strongest taxel feels less is untouched
FIRM: Final = 0.9  # quantile of images' peaks, about that of a firm touch
ALONE: Final = 0.35  # a taxel of which no neighbour feels such a share is read wrongly
NOWHERE: Final = -1.0  # the place of what is not touched

Rows = NDArray[np.float32]


def features(examples: Examples, *, mended: bool = False) -> Rows:
    """Return the features of every window, (windows, features).

    Args:
        examples: Images and windows.
        mended: Taxels that are read wrongly are left out.
    """
    where = _touches(examples.images, mended=mended)
    index = examples.ends[:, None] + np.arange(1 - examples.window, 1)
    x, y, spread, total = (where[:, i][index] for i in range(where.shape[1]))
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


def touched(examples: Examples) -> NDArray[np.float64]:
    """Return the share of each window's images in which something touches, (windows,)."""
    there = np.concatenate([[0], np.cumsum(_touches(examples.images, mended=True)[:, 3] > 0.0)])
    last = examples.ends + 1
    return np.asarray((there[last] - there[last - examples.window]) / examples.window)


def learn(rows: Rows, label: NDArray[np.integer], seed: int) -> Any:
    """Return trees that learned from rows (windows, features) and their classes (windows,)."""
    from sklearn.ensemble import ExtraTreesClassifier

    trees = ExtraTreesClassifier(
        TREES, min_samples_leaf=LEAF, max_features=ASKED, random_state=seed
    )
    return trees.fit(rows, label)


def ask(trees: Any, rows: Rows, classes: int) -> NDArray[np.float32]:
    """Return the probability of each class, (windows, classes)."""
    answers = np.zeros((len(rows), classes), dtype=np.float32)
    answers[:, trees.classes_] = trees.predict_proba(rows)
    return answers


def mend(felt: NDArray[np.float32], least: float) -> NDArray[np.float32]:
    """Return what is felt (images, rows, columns) without what only one taxel feels.

    Args:
        felt: How much each taxel feels, 0 where untouched.
        least: Less than this may be felt alone.
    """
    _, rows, columns = felt.shape
    wide = np.pad(felt, ((0, 0), (1, 1), (1, 1)))
    near = np.zeros_like(felt)
    for down in range(3):
        for right in range(3):
            if (down, right) != (1, 1):
                np.maximum(near, wide[:, down : down + rows, right : right + columns], out=near)
    return np.where((felt > least) & (near < ALONE * felt), np.float32(0.0), felt)


def _touches(images: NDArray[np.float32], *, mended: bool) -> Rows:
    """Return x, y, spread (grid units) and sum of what each image feels, (images, 4)."""
    felt = np.maximum(images - 1.0, np.float32(0.0))
    peak = felt.reshape(len(felt), -1).max(axis=1)
    firm = float(np.quantile(peak, FIRM))
    if mended:
        felt = mend(felt, LITTLE * firm)
        peak = felt.reshape(len(felt), -1).max(axis=1)
    felt[felt < FAINT * firm] = 0.0
    total = felt.sum(axis=(1, 2))
    some = np.maximum(total, 1e-9)
    row, column = np.mgrid[: images.shape[1], : images.shape[2]].astype(np.float32)
    x, y = (felt * column).sum(axis=(1, 2)) / some, (felt * row).sum(axis=(1, 2)) / some
    square = (felt * (column**2 + row**2)).sum(axis=(1, 2)) / some - x**2 - y**2
    found = np.stack([x, y, np.sqrt(np.maximum(square, 0.0)), total], axis=1)
    found[peak < LITTLE * firm] = NOWHERE, NOWHERE, 0.0, 0.0
    return np.asarray(found, dtype=np.float32)
