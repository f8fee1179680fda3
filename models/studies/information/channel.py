"""Capacity of a noisy channel, per use and per time.

Source: C. Shannon, A mathematical theory of communication, 1948; R. Blahut, Computation of channel
capacity and rate-distortion functions, and S. Arimoto, An algorithm for computing the capacity of
arbitrary discrete memoryless channels, both IEEE Transactions on Information Theory 18, 1972. With
symbols of unequal duration, information per time is greatest where I - rate x duration is: the rate
is found by W. Dinkelbach's iteration, On nonlinear fractional programming, Management Science 13,
1967. Each use is taken to be independent of those before it.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import rel_entr  # the [train] extra

from models.studies.information.histogram import mutual_information

TOLERANCE: Final = 1e-9  # nats between the bounds of the capacity
ROUNDS: Final = 20_000
_LEAST: Final = 1e-300

Shares = NDArray[np.float64]  # (inputs,): how often each input is sent; sums to 1
Transitions = NDArray[np.float64]  # (inputs, outputs): probability of each output given the input


@dataclass(frozen=True, slots=True, eq=False)
class Use:
    """The best use of a channel.

    Attributes:
        nats: Information of each use.
        seconds: Mean duration of a use.
        share: Relative frequency of each symbol, (inputs,).
    """

    nats: float
    seconds: float
    share: Shares

    @property
    def nats_per_min(self) -> float:
        """Information per minute."""
        return 60.0 * self.nats / self.seconds if self.seconds else math.nan


def transitions(counts: ArrayLike) -> Transitions:
    """Return the probability of outputs given inputs that occur, of counts (inputs, outputs)."""
    table = np.asarray(counts, dtype=np.float64)
    table = table[table.sum(axis=1) > 0]
    return np.asarray(table / table.sum(axis=1, keepdims=True))


def information(share: ArrayLike, given: Transitions) -> float:
    """Return I(input; output), nats, for shares (inputs,) and transitions (inputs, outputs)."""
    p = np.asarray(share, dtype=np.float64)
    return float(p @ _divergence(given, p @ given))


def counted(counts: ArrayLike) -> float:
    """Return I(input; output) of counted uses (inputs, outputs), nats, at least 0.

    The bias is removed (Miller-Madow).
    """
    table = np.asarray(counts, dtype=np.float64)
    total = float(table.sum())
    if not total:
        return math.nan
    return max(0.0, float(mutual_information(table[None] / total, total).information[0]))


def best_use(given: Transitions, seconds: ArrayLike | None = None) -> Use:
    """Return the use of most information (the capacity), or of most information per time.

    Args:
        given: Probability of each output given each input, (inputs, outputs).
        seconds: Duration of a use of each input, (inputs,); None: most information per use.

    Raises:
        ValueError: A row is no distribution, or durations do not fit.
    """
    lasts = np.zeros(len(given)) if seconds is None else np.asarray(seconds, dtype=np.float64)
    if given.ndim != 2 or lasts.shape != given.shape[:1] or (lasts < 0).any():
        raise ValueError(f"{lasts.shape} durations for {given.shape} probabilities; one per row")
    if (given < 0).any() or not np.allclose(given.sum(axis=1), 1.0):
        raise ValueError("each row of a channel is a distribution; these do not sum to 1")
    rate = 0.0  # nats per second
    while True:
        share = _blahut_arimoto(given, rate * lasts)
        nats, mean = information(share, given), float(share @ lasts)
        if not lasts.any() or nats <= rate * mean + TOLERANCE:
            return Use(nats, mean, share)
        rate = nats / mean


def _blahut_arimoto(given: Transitions, cost: NDArray[np.float64]) -> Shares:
    """Return the shares (inputs,) with the greatest information less the cost (inputs,), nats."""
    share = np.full(len(given), 1.0 / len(given))
    for _ in range(ROUNDS):
        worth = _divergence(given, share @ given) - cost
        if worth.max() - share @ worth < TOLERANCE:
            break
        share = share * np.exp(worth - worth.max())
        share /= share.sum()
    return share


def _divergence(given: Transitions, output: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the relative entropy of each input's outputs to the outputs (outputs,), (inputs,)."""
    return np.asarray(rel_entr(given, np.maximum(output, _LEAST)).sum(axis=1))
