"""Fit the new units: gradient descent on the cross entropy, in NumPy; some seconds on a board."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.adapt.head import LearnedUnits

Values = NDArray[np.float32]

TEAMS: Final = 3  # fitted each for itself; their mean errs less than each alone
UNITS: Final = 16  # of a team, beside those that were trained, the constant one not counted
STEPS: Final = 300
BATCH: Final = 512
RATE: Final = 5e-3  # falls to nothing along a cosine
DECAY: Final = 1e-2  # of the weights, times the rate, a step
_SEED: Final = 0  # of the first weights and of the batches
_FIRST, _SECOND, _TINY = 0.9, 0.999, 1e-8  # Adam's moments: Kingma and Ba 2015, algorithm 1


@dataclass(frozen=True, slots=True, eq=False)
class TrainingSet:
    """What is learned from.

    Attributes:
        embedding: Of each window, (n, width).
        logits: What the network answers as it was trained, (n, old classes).
        target: What it shall answer, (n, classes), each row summing to 1.
        weight: How much each window counts, (n,).
    """

    embedding: Values
    logits: Values
    target: Values
    weight: NDArray[np.float64]


def fit(material: TrainingSet) -> LearnedUnits:
    """Return units that make the network answer as it shall."""
    teams = [_team(material, np.random.default_rng([_SEED, team])) for team in range(TEAMS)]
    return LearnedUnits(
        np.concatenate([team.weights for team in teams]),
        np.concatenate([team.bias for team in teams]),
        np.asarray(np.concatenate([team.out for team in teams], axis=1) / TEAMS, np.float32),
    )


def _team(material: TrainingSet, rng: np.random.Generator) -> LearnedUnits:
    """Return units that are fitted by themselves."""
    mean, spread = _scale(material)
    seen = ((material.embedding - mean) / spread).astype(np.float32)
    count, classes = len(seen), material.target.shape[1]
    old = material.logits.shape[1]
    parameters: list[Values] = [
        (rng.normal(size=(seen.shape[1], UNITS)) * np.sqrt(2.0 / seen.shape[1])).astype(np.float32),
        np.zeros(UNITS, dtype=np.float32),
        np.zeros((UNITS, classes), dtype=np.float32),
        np.zeros(classes, dtype=np.float32),
    ]
    first = [np.zeros_like(one) for one in parameters]
    second = [np.zeros_like(one) for one in parameters]
    drawn = np.cumsum(material.weight / material.weight.sum())
    logits = np.zeros((BATCH, classes), dtype=np.float32)
    for step in range(1, STEPS + 1):
        batch = np.minimum(np.searchsorted(drawn, rng.random(BATCH)), count - 1)
        x = seen[batch]
        hidden_weights, hidden_bias, out_weights, out_bias = parameters
        hidden = np.maximum(x @ hidden_weights + hidden_bias, 0.0)
        logits[:] = hidden @ out_weights + out_bias
        logits[:, :old] += material.logits[batch]
        power = np.exp(logits - logits.max(axis=1, keepdims=True))
        off = (power / power.sum(axis=1, keepdims=True) - material.target[batch]) / BATCH
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
    # The scale goes into the weights; a unit that is always 1 carries the bias of the output.
    weights = (hidden_weights / spread[:, None]).T
    offset = hidden_bias - (mean / spread) @ hidden_weights
    return LearnedUnits(
        np.vstack([weights, np.zeros((1, len(mean)))]).astype(np.float32),
        np.append(offset, 1.0).astype(np.float32),
        np.column_stack([out_weights.T, out_bias]).astype(np.float32),
    )


def _scale(material: TrainingSet) -> tuple[Values, Values]:
    """Return mean and deviation of each number of the embedding; quiet ones are not blown up."""
    share = material.weight / material.weight.sum()
    mean = share @ material.embedding
    spread = np.sqrt(share @ np.square(material.embedding - mean))
    return mean.astype(np.float32), (spread + 0.1 * float(spread.mean()) + 1e-6).astype(np.float32)
