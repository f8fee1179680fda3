"""Fit rows of a head to examples, and to what the head answered before.

Units take the embedding, and their outputs are added to the logits of the head as it was trained.
They are fitted by gradient descent (Adam) on the cross entropy, in NumPy.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.head import Head, Matrix

TEAMS: Final = 3  # size of the ensemble: members are fitted separately and averaged
UNITS: Final = 16  # of a member
STEPS: Final = 300
BATCH: Final = 512
RATE: Final = 5e-3  # falls to nothing along a cosine
DECAY: Final = 1e-2  # of the weights, times the rate, a step
_SEED: Final = 0  # of the first weights and of the batches
_FIRST, _SECOND, _TINY = 0.9, 0.999, 1e-8  # Adam's moments: Kingma and Ba 2015, algorithm 1


@dataclass(frozen=True, slots=True, eq=False)
class TrainingSet:
    """Training data of n windows."""

    embedding: Matrix  # (n, width)
    logits: Matrix  # of the network as it was trained, (n, old classes)
    target: Matrix  # probabilities, (n, classes); each row sums to 1
    weight: NDArray[np.float64]  # of each window, (n,)


def fit(data: TrainingSet, progress: Callable[[float], None]) -> Head:
    """Return rows fitted to the targets; `progress` is called with the share that is done."""
    members = []
    for team in range(TEAMS):
        members.append(_team(data, np.random.default_rng([_SEED, team])))
        progress((team + 1) / TEAMS)
    return Head(
        np.concatenate([team.hidden for team in members]),
        np.concatenate([team.hidden_bias for team in members]),
        np.asarray(np.concatenate([team.out for team in members], axis=1) / TEAMS, np.float32),
        np.asarray(sum(team.out_bias for team in members) / TEAMS, dtype=np.float32),
    )


def _team(data: TrainingSet, rng: np.random.Generator) -> Head:
    """Return the units of one member of the ensemble."""
    mean, spread = _scale(data)
    seen = ((data.embedding - mean) / spread).astype(np.float32)
    count, classes = len(seen), data.target.shape[1]
    old = data.logits.shape[1]
    parameters: list[Matrix] = [
        (rng.normal(size=(seen.shape[1], UNITS)) * np.sqrt(2.0 / seen.shape[1])).astype(np.float32),
        np.zeros(UNITS, dtype=np.float32),
        np.zeros((UNITS, classes), dtype=np.float32),
        np.zeros(classes, dtype=np.float32),
    ]
    first = [np.zeros_like(one) for one in parameters]
    second = [np.zeros_like(one) for one in parameters]
    drawn = np.cumsum(data.weight / data.weight.sum())
    logits = np.zeros((BATCH, classes), dtype=np.float32)
    for step in range(1, STEPS + 1):
        batch = np.minimum(np.searchsorted(drawn, rng.random(BATCH)), count - 1)
        x = seen[batch]
        hidden_weights, hidden_bias, out_weights, out_bias = parameters
        hidden = np.maximum(x @ hidden_weights + hidden_bias, 0.0)
        logits[:] = hidden @ out_weights + out_bias
        logits[:, :old] += data.logits[batch]
        power = np.exp(logits - logits.max(axis=1, keepdims=True))
        off = (power / power.sum(axis=1, keepdims=True) - data.target[batch]) / BATCH
        back = (off @ out_weights.T) * (hidden > 0.0)
        gradients = (x.T @ back, back.sum(axis=0), hidden.T @ off, off.sum(axis=0))
        rate = 0.5 * RATE * (1.0 + np.cos(np.pi * step / STEPS))
        for i, gradient in enumerate(gradients):
            first[i] += (1.0 - _FIRST) * (gradient - first[i])
            second[i] += (1.0 - _SECOND) * (np.square(gradient) - second[i])
            slope = first[i] / (1.0 - _FIRST**step)
            slope /= np.sqrt(second[i] / (1.0 - _SECOND**step)) + _TINY
            parameters[i] -= (rate * slope).astype(np.float32)
            if parameters[i].ndim == 2:
                parameters[i] *= np.float32(1.0 - rate * DECAY)
    hidden_weights, hidden_bias, out_weights, out_bias = parameters
    # The scale is merged into the weights.
    offset = np.asarray(hidden_bias - (mean / spread) @ hidden_weights, dtype=np.float32)
    return Head((hidden_weights / spread[:, None]).T, offset, out_weights.T, out_bias)


def _scale(data: TrainingSet) -> tuple[Matrix, Matrix]:
    """Return mean and deviation of each number of the embedding, each (width,).

    A lower bound of the deviation keeps nearly constant numbers from being amplified.
    """
    share = data.weight / data.weight.sum()
    mean = share @ data.embedding
    spread = np.sqrt(share @ np.square(data.embedding - mean))
    return mean.astype(np.float32), (spread + 0.1 * float(spread.mean()) + 1e-6).astype(np.float32)
