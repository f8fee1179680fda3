"""Gaussian points whose mutual information is known, to test estimators on."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from models.studies.information.windows import Windows

Points = NDArray[np.float64]  # (n, dimensions)

# Information of `Mixture.of(classes, dimensions)`, nats: 10,000,000 draws of `sampled` each.
TRUTHS: Final = {
    (2, 1): 0.332767, (2, 2): 0.173557, (2, 5): 0.437269, (2, 10): 0.639735,
    (3, 1): 0.442745, (3, 2): 0.638832, (3, 5): 0.692778, (3, 10): 0.922265,
    (5, 1): 0.633643, (5, 2): 0.58956, (5, 5): 1.122821, (5, 10): 1.158215,
}  # fmt: skip
_AWAY: Final = 1.5  # of a class's middle from that of all
_UNEVEN: Final = 0.5  # deviation of the logarithm of a class's width, from axis to axis


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """Classes that are equally frequent, each a Gaussian of its own shape."""

    middle: Points  # of each, (classes, d)
    root: Points  # each one's covariance is root @ root.T, (classes, d, d).

    @classmethod
    def of(cls, classes: int, dimensions: int) -> "Mixture":
        """The case of that many classes and dimensions."""
        rng = np.random.default_rng((classes, dimensions))
        middle = rng.normal(size=(classes, dimensions))
        middle *= _AWAY / np.linalg.norm(middle, axis=1, keepdims=True)
        turned = [np.linalg.qr(rng.normal(size=(dimensions, dimensions)))[0] for _ in middle]
        width = np.exp(rng.normal(0.0, _UNEVEN, (classes, 1, dimensions)))
        return cls(middle, np.array(turned) * width)

    def draw(self, count: int, rng: np.random.Generator) -> tuple[Points, NDArray[np.int64]]:
        """Points, (count, d), and their classes, (count,)."""
        y = rng.integers(0, len(self.middle), count)
        x = rng.normal(size=(count, self.middle.shape[1]))
        for one, (middle, root) in enumerate(zip(self.middle, self.root, strict=True)):
            own = y == one
            x[own] = middle + x[own] @ root.T
        return x, y

    def sampled(self, count: int, seed: int = 1) -> tuple[float, float]:
        """The information from that many points, nats, and its standard error."""
        x, y = self.draw(count, np.random.default_rng(seed))
        log = self._log(x)
        part = log[np.arange(count), y] - logsumexp(log, axis=1) + math.log(len(self.middle))
        return float(part.mean()), float(part.std() / math.sqrt(count))

    def _log(self, x: Points) -> Points:
        """The logarithm of each class's density, but for a constant, (n, classes)."""
        every = []
        for middle, root in zip(self.middle, self.root, strict=True):
            away = (x - middle) @ np.linalg.inv(root).T
            every.append(-0.5 * (away**2).sum(axis=1) - np.linalg.slogdet(root)[1])
        return np.stack(every, axis=1)


def close(found: float, truth: float, dimensions: int) -> bool:
    """Whether an estimate is within 5 % or 0.02 nats; within 15 % beyond five dimensions."""
    return abs(found - truth) <= max(0.02, (0.05 if dimensions <= 5 else 0.15) * truth)


def as_windows(x: Points, y: NDArray[np.int64], sessions: int = 4) -> Windows:
    """Points as windows of one image, distributed over several sessions."""
    index = np.arange(len(x))
    labels = tuple(str(i) for i in range(int(y.max()) + 1))
    nowhere = np.full((len(x), 2), np.nan, dtype=np.float32)
    return Windows(x[:, None].astype(np.float32), y, index % sessions, index // sessions, index,
                   nowhere, labels, 10.0, (1, x.shape[1]))  # fmt: skip
