"""Estimators on cases whose information is known (gaussians.py): what may be believed of them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models.studies.information import gaussians, knn
from models.studies.information.windows import Taken

POINTS: Final = 10_000
PARTS: Final = 4  # "sessions" that the points are dealt into, for what is held out
CLOSE: Final = 0.05  # of the truth, up to FEW dimensions; FAR beyond
FAR: Final = 0.15
FEW: Final = 5
LEAST: Final = 0.02  # nats, whatever the truth is
KSG_DIMENSIONS: Final = (1, 2, 3, 5, 10)


@dataclass(frozen=True, slots=True)
class Row:
    """One estimate of one case.

    Attributes:
        case: What was estimated, in words.
        estimator: By what.
        dimensions: Of the points; where both are continuous, of each of the two.
        truth: Nats.
        found: Nats.
        bound: It promises only never to say too much.
        ideal: The case is one that the estimator was made for.
    """

    case: str
    estimator: str
    dimensions: int
    truth: float
    found: float
    bound: bool = False
    ideal: bool = True

    @property
    def allowed(self) -> float:
        """How far off it may be, nats."""
        share = CLOSE if self.dimensions <= FEW else FAR
        return max(LEAST, share * self.truth)

    @property
    def close(self) -> bool:
        """Whether it is as close as that."""
        return abs(self.found - self.truth) <= self.allowed


Job = Callable[[], list[Row]]


def jobs(points: int = POINTS) -> Iterator[tuple[str, Job]]:
    """Yield what to do, and its name; each can be done in a process of its own."""
    for classes in gaussians.CLASSES:
        for dimensions in gaussians.DIMENSIONS:
            name = gaussians.name(classes, dimensions)
            yield name, partial(mixture, classes, dimensions, points)
    for dimensions in KSG_DIMENSIONS:
        for correlation in gaussians.CORRELATIONS:
            name = f"{dimensions}+{dimensions} dimensions, correlated by {correlation:g}"
            yield name, partial(pairs, dimensions, correlation, points)


def mixture(classes: int, dimensions: int, points: int, seed: int = 0) -> list[Row]:
    """Return what the estimators say of a mixture."""
    from models.studies.information import classifier_bound  # PyTorch

    case, truth = gaussians.name(classes, dimensions), gaussians.truths()
    rng = np.random.default_rng((seed, classes, dimensions))
    x, y = gaussians.Mixture.of(classes, dimensions).draw(points, rng)
    dealt = _dealt(x, y, classes)
    told = classifier_bound.told(dealt)
    found = {
        "Ross": float(np.mean(knn.ross(x, y))),
        "held-out classifier": classifier_bound.windows(dealt, told.scaled).value,
    }
    return [
        Row(case, name, dimensions, truth[case], value, bound=name != "Ross")
        for name, value in found.items()
    ]


def pairs(dimensions: int, correlation: float, points: int, seed: int = 0) -> list[Row]:
    """Return what the estimators say of correlated pairs, Gaussian and with heavy tails."""
    from models.studies.information import (
        classifier_bound,
        infonce,  # PyTorch
    )

    rows = []
    rng = np.random.default_rng((seed, dimensions, round(100 * correlation)))
    for words, draw in (("Gaussian", gaussians.correlated), ("heavy tails", gaussians.heavy)):
        x, y, truth = draw(dimensions, correlation, points, rng)
        case = f"{words}, correlated by {correlation:g}"
        normal = words == "Gaussian"
        part, missed = knn.ksg_corrected(x, y, seed=seed)
        plain = float(np.mean(part))
        rows.append(Row(case, "Kraskov", dimensions, truth, plain))
        rows.append(
            Row(case, "Kraskov, corrected", dimensions, truth, plain + missed, ideal=normal)
        )
        if normal and correlation == gaussians.CORRELATIONS[1]:
            told = infonce.info_nce(
                x, y, classifier_bound.folds(_dealt(x, np.zeros(points, int), 1))
            )
            rows.append(Row(case, "InfoNCE", dimensions, truth, float(np.nanmean(told)), True))
    return rows


def _dealt(x: NDArray[np.float64], y: NDArray[np.int64], classes: int) -> Taken:
    """Return points as windows of several sessions."""
    index = np.arange(len(x))
    labels = tuple(str(one) for one in range(classes))
    flat, nowhere = x[:, None].astype(np.float32), np.full((len(x), 2), np.nan, dtype=np.float32)
    return Taken(flat, y, index % PARTS, index, index, nowhere, labels, 1.0, (1, x.shape[1]))
