"""Cases whose information is known, to try estimators on: Gaussian mixtures, correlated Gaussians.

    python -m models.studies.information.gaussians

draws the mixtures' truths anew, 10^7 points each, into truths.json beside this file (a minute or
two). A mixture's information has no closed form; with one dimension an integral gives it too.
"""

import json
import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models import user_files

Points = NDArray[np.float64]

CLASSES: Final = (2, 3, 5)
DIMENSIONS: Final = (1, 2, 5, 10)
CORRELATIONS: Final = (0.3, 0.6, 0.9)
TAILS: Final = 4.0  # degrees of freedom of the heavy-tailed case
DRAWN: Final = 10_000_000
TRUTHS: Final = "truths.json"
_AWAY: Final = 1.5  # of a class's middle from that of all
_UNEVEN: Final = 0.5  # deviation of the logarithm of a class's width, from axis to axis
_CHUNK: Final = 200_000


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """Classes that are equally frequent, each a Gaussian of its own shape.

    Attributes:
        middle: Of each, (classes, d).
        root: Each one's covariance is root @ root.T, (classes, d, d).
    """

    middle: Points
    root: Points

    @classmethod
    def of(cls, classes: int, dimensions: int) -> "Mixture":
        """Return the case of so many classes and dimensions."""
        rng = np.random.default_rng((classes, dimensions))
        middle = rng.normal(size=(classes, dimensions))
        middle *= _AWAY / np.linalg.norm(middle, axis=1, keepdims=True)
        turned = [np.linalg.qr(rng.normal(size=(dimensions, dimensions)))[0] for _ in middle]
        width = np.exp(rng.normal(0.0, _UNEVEN, (classes, 1, dimensions)))
        return cls(middle, np.array(turned) * width)

    def draw(self, count: int, rng: np.random.Generator) -> tuple[Points, NDArray[np.int64]]:
        """Return points, (count, d), and their classes."""
        y = rng.integers(0, len(self.middle), count)
        x = rng.normal(size=(count, self.middle.shape[1]))
        for one, (middle, root) in enumerate(zip(self.middle, self.root, strict=True)):
            own = y == one
            x[own] = middle + x[own] @ root.T
        return x, y

    def part(self, x: Points, y: NDArray[np.int64]) -> Points:
        """Return log p(y | x) / p(y) of each point, nats; its mean is the information."""
        log = self._log(x)
        top = log.max(axis=1)
        all_of_them = top + np.log(np.exp(log - top[:, None]).sum(axis=1))
        own: Points = log[np.arange(len(y)), y]
        return np.asarray(own - all_of_them + math.log(len(self.middle)), dtype=np.float64)

    def sampled(self, count: int = DRAWN, seed: int = 1) -> tuple[float, float]:
        """Return the information from so many points, nats, and its standard error."""
        rng, total, square, left = np.random.default_rng(seed), 0.0, 0.0, count
        while left:
            part = self.part(*self.draw(min(_CHUNK, left), rng))
            total, square, left = total + part.sum(), square + (part**2).sum(), left - len(part)
        mean = total / count
        return float(mean), float(math.sqrt((square / count - mean**2) / count))

    def integrated(self, points: int = 200_001) -> float:
        """Return the information of a mixture in one dimension by quadrature, nats."""
        wide = 12.0 * float(np.abs(self.root).max()) + _AWAY
        x = np.linspace(-wide, wide, points)[:, None]
        log = self._log(x) - 0.5 * math.log(2.0 * math.pi)
        p = np.exp(log)
        mean = p.mean(axis=1, keepdims=True)
        inside = np.where(p > 0, p * (log - np.log(np.maximum(mean, 1e-300))), 0.0).mean(axis=1)
        steps = np.diff(x[:, 0])  # by trapezoids
        return float((0.5 * (inside[1:] + inside[:-1]) * steps).sum())

    def _log(self, x: Points) -> Points:
        """Return the logarithm of each class's density, but for a constant, (n, classes)."""
        every = []
        for middle, root in zip(self.middle, self.root, strict=True):
            away = (x - middle) @ np.linalg.inv(root).T
            every.append(-0.5 * (away**2).sum(axis=1) - np.linalg.slogdet(root)[1])
        return np.stack(every, axis=1)


@cache
def truths() -> dict[str, float]:
    """Return the information of each mixture, nats, by `name`."""
    text = files(__package__).joinpath(TRUTHS).read_text(encoding="utf-8")
    return {name: float(value) for name, (value, _) in json.loads(text)["nats"].items()}


def name(classes: int, dimensions: int) -> str:
    """Return what a mixture is called in the table."""
    return f"{classes} classes, {dimensions} dimensions"


def correlated(
    dimensions: int, correlation: float, count: int, rng: np.random.Generator
) -> tuple[Points, Points, float]:
    """Return pairs of points, (count, dimensions) each, and their information, nats.

    Each coordinate of one is correlated with the same one of the other.
    """
    x = rng.normal(size=(count, dimensions))
    noise = rng.normal(size=(count, dimensions))
    y = correlation * x + math.sqrt(1.0 - correlation**2) * noise
    return x, y, -0.5 * dimensions * math.log(1.0 - correlation**2)


def heavy(
    dimensions: int, correlation: float, count: int, rng: np.random.Generator
) -> tuple[Points, Points, float]:
    """Return the same with tails as heavy as Student's, which all coordinates share.

    Source: C. Guerrero-Cusumano, A measure of total variability for the multivariate t distribution
    with applications to finance, Information Sciences 92, 1996.
    """
    from scipy.special import digamma, gammaln  # the [train] extra

    x, y, told = correlated(dimensions, correlation, count, rng)
    far = np.sqrt(TAILS / rng.chisquare(TAILS, count))[:, None]
    half, one, both = TAILS / 2, (TAILS + dimensions) / 2, (TAILS + 2 * dimensions) / 2
    told += gammaln(half) + gammaln(both) - 2.0 * gammaln(one)
    told += 2.0 * one * digamma(one) - both * digamma(both) - half * digamma(half)
    return x * far, y * far, float(told)


def main() -> None:
    """Write the table of truths."""
    nats = {}
    for classes in CLASSES:
        for dimensions in DIMENSIONS:
            found = Mixture.of(classes, dimensions).sampled()
            nats[name(classes, dimensions)] = [round(value, 6) for value in found]
            print(f"{name(classes, dimensions)}: {found[0]:.5f} ({found[1]:.5f}) nats", flush=True)
    table = {"drawn": DRAWN, "nats": nats}
    path = Path(__file__).with_name(TRUTHS)
    user_files.write_text(path, f"{json.dumps(table, indent=1)}\n")


if __name__ == "__main__":
    main()
