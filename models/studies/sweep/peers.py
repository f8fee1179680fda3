"""Peers of CNN-3D: plain models of gestures that learn from the same windows of the same people.

A peer has `fit(windows, label)` and `predict_proba(windows)`, with windows (n, window, rows,
columns) of relative capacitance, oldest image first, and classes (n,) numbered from 0 without a
gap. It is given at most `baseline.LEARNED` windows.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from models.data.recipe import NetworkRecipe
from models.studies.sweep.baseline import CHOSEN, LEAF, TREES, Signal, Windows

UNITS: Final = 64  # of the GRU
RATE: Final = 1e-3  # learning rate of the GRU: that of Adam, falling to zero
REFERENCES: Final = 2_000  # windows that dynamic time warping compares with, evenly spread
COARSE: Final = (8, 6, 6)  # most images, rows and columns of a course that it compares
AT_ONCE: Final = 100  # windows whose distances are in memory together

Index = NDArray[np.int64]  # (n,)


@dataclass
class Peer:
    """Settings of a peer."""

    recipe: NetworkRecipe  # of CNN-3D; its batches are the peer's, if it has any
    seed: int


class Trees(Peer):
    """Two forests, of the trajectory and of all features; the mean of their probabilities."""

    def fit(self, windows: Windows, label: Index) -> None:
        """Grow them on windows of classes (n,)."""
        from sklearn.ensemble import ExtraTreesClassifier

        self.signal = Signal.of(windows)
        rows = self.signal.features(windows)
        widths = (self.signal.trajectory(windows[:1]).shape[1], rows.shape[1])
        forest = partial(ExtraTreesClassifier, TREES, min_samples_leaf=LEAF, random_state=self.seed)
        self.forests = [
            forest(max_features=chosen).fit(rows[:, :width], label)
            for width, chosen in zip(widths, CHOSEN, strict=True)
        ]

    def predict_proba(self, windows: Windows) -> NDArray[np.floating]:
        """Return the probability of each class, (n, classes)."""
        rows = self.signal.features(windows)
        answers = [one.predict_proba(rows[:, : one.n_features_in_]) for one in self.forests]
        return np.asarray(np.mean(answers, axis=0))


class Perceptron(Peer):
    """Perceptron of scikit-learn's default size, on the standardised features of the trees."""

    def fit(self, windows: Windows, label: Index) -> None:
        """Train for as many batches as the recipe says."""
        from sklearn.neural_network import MLPClassifier
        from sklearn.preprocessing import StandardScaler

        self.signal, self.scaler = Signal.of(windows), StandardScaler()
        rows = self.scaler.fit_transform(self.signal.features(windows))
        size = min(self.recipe.batch, len(rows))
        self.net = MLPClassifier(batch_size=size, random_state=self.seed)
        for _ in range(self.recipe.passes(len(rows))):  # `fit` would warn that it may go on
            self.net.partial_fit(rows, label, classes=np.unique(label))

    def predict_proba(self, windows: Windows) -> NDArray[np.floating]:
        """Return the probability of each class, (n, classes)."""
        rows = self.scaler.transform(self.signal.features(windows))
        return np.asarray(self.net.predict_proba(rows))


class NearestCourse(Peer):
    """Nearest of `REFERENCES` windows under dynamic time warping of coarse images."""

    def fit(self, windows: Windows, label: Index) -> None:
        """Keep windows to compare with."""
        every = -(-len(windows) // REFERENCES)
        self.signal = Signal.of(windows)
        self.courses = self._courses(windows[::every])
        self.answers = np.eye(label.max() + 1)[label[::every]]

    def predict_proba(self, windows: Windows) -> NDArray[np.floating]:
        """Return 1 for the class of the nearest window, else 0, (n, classes)."""
        parts = [windows[i : i + AT_ONCE] for i in range(0, len(windows), AT_ONCE)]
        near = [warped(self._courses(one), self.courses).argmin(axis=1) for one in parts]
        return np.asarray(self.answers[np.concatenate(near)])

    def _courses(self, windows: Windows) -> NDArray[np.float32]:
        """Return coarse courses of windows, (n, images, taxels)."""
        seen = self.signal.seen(windows)
        for axis, most in enumerate(COARSE, 1):
            edges = np.linspace(0, seen.shape[axis], min(most, seen.shape[axis]) + 1).astype(int)
            width = np.diff(edges).reshape(-1, *[1] * (3 - axis))
            seen = np.asarray(np.add.reduceat(seen, edges[:-1], axis=axis) / width, np.float32)
        return seen.reshape(*seen.shape[:2], -1)


def warped(ones: NDArray[np.float32], others: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return distances (n, m) under dynamic time warping of courses (n, w, d) and (m, w, d)."""
    (n, images, size), m = ones.shape, len(others)
    square = [(one**2).sum(axis=2) for one in (ones, others)]
    product = ones.reshape(-1, size) @ others.reshape(-1, size).T
    product = product.reshape(n, images, m, images).transpose(1, 3, 0, 2)
    sums = np.full((images + 1, images + 1, n, m), np.inf, dtype=np.float32)
    sums[0, 0] = 0.0
    for i, j in np.ndindex(images, images):
        apart = square[0][:, i, None] + square[1][None, :, j] - 2.0 * product[i, j]
        before = np.minimum(np.minimum(sums[i, j + 1], sums[i + 1, j]), sums[i, j])
        sums[i + 1, j + 1] = np.sqrt(np.maximum(apart, 0.0)) + before
    return np.asarray(sums[-1, -1])


class Recurrent(Peer):
    """Gated recurrent units over the images of a window, in the unit of a firm touch."""

    def fit(self, windows: Windows, label: Index) -> None:
        """Train for as many batches as the recipe says."""
        torch.manual_seed(self.seed)
        rng, size = np.random.default_rng(self.seed), self.recipe.batch
        self.signal = Signal.of(windows)
        taxels = windows.shape[2] * windows.shape[3]
        self.units = nn.GRU(taxels, UNITS, batch_first=True)
        self.last = nn.Linear(UNITS, int(label.max()) + 1)
        steps = self.recipe.passes(len(windows)) * -(-len(windows) // size)
        optimizer = torch.optim.Adam([*self.units.parameters(), *self.last.parameters()], RATE)
        falling = torch.optim.lr_scheduler.LinearLR(optimizer, 1.0, 0.0, steps)
        for _ in range(steps):
            some = rng.integers(len(windows), size=size)
            logits = self._logits(windows[some])
            loss = nn.functional.cross_entropy(logits, torch.from_numpy(label[some]))
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            falling.step()

    def predict_proba(self, windows: Windows) -> NDArray[np.floating]:
        """Return the probability of each class, (n, classes)."""
        with torch.no_grad():
            return np.asarray(self._logits(windows).softmax(dim=1).numpy())

    def _logits(self, windows: Windows) -> torch.Tensor:
        seen = self.signal.seen(windows).reshape(*windows.shape[:2], -1)
        course, _ = self.units(torch.from_numpy(seen / np.float32(self.signal.firm)))
        logits: torch.Tensor = self.last(course[:, -1])
        return logits


# A peer is a line here, and its name in `Training.model` of models/studies/sweep/plan.py.
PEERS: Final[Mapping[str, Callable[[NetworkRecipe, int], Any]]] = {
    "trees": Trees,
    "mlp": Perceptron,
    "dtw": NearestCourse,
    "gru": Recurrent,
}
