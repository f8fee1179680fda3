"""Bits over a noisy channel: what comes out, given what went in, and how long each use takes.

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

ENOUGH: Final = 1e-9  # nats between the bounds of the capacity
ROUNDS: Final = 20_000
_LEAST: Final = 1e-300

Row = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Best:
    """The best use of a channel.

    Attributes:
        nats: For each use.
        seconds: That a use takes on average.
        share: How often each symbol is sent, (inputs,).
    """

    nats: float
    seconds: float
    share: Row

    @property
    def nats_per_min(self) -> float:
        """Information per minute."""
        return 60.0 * self.nats / self.seconds if self.seconds else math.nan


def rows(counts: ArrayLike) -> Row:
    """Return the probability of each output (columns) given each input that was ever sent."""
    table = np.asarray(counts, dtype=np.float64)
    total = table.sum(axis=1, keepdims=True)
    return np.asarray(table[total[:, 0] > 0] / total[total[:, 0] > 0])


def information(share: ArrayLike, given: Row) -> float:
    """Return I(input; output), nats.

    Args:
        share: How often each input is sent, (inputs,).
        given: Probability of each output given each input, (inputs, outputs).
    """
    p = np.asarray(share, dtype=np.float64)
    return float(p @ _divergence(given, p @ given))


def counted(counts: ArrayLike) -> float:
    """Return I(input; output) of counted uses, its bias taken off (Miller-Madow), nats.

    Never below 0.
    """
    table = np.asarray(counts, dtype=np.float64)
    total = table.sum()
    if not total:
        return math.nan
    found = information(table.sum(axis=1)[table.sum(axis=1) > 0] / total, rows(table))
    cells, inputs, outputs = (
        np.count_nonzero(one) for one in (table, table.sum(axis=1), table.sum(axis=0))
    )
    return max(0.0, found - float(cells - inputs - outputs + 1) / (2.0 * float(total)))


def best_use(given: Row) -> Best:
    """Return the use of most information: the capacity, by Blahut and Arimoto.

    Args:
        given: Probability of each output given each input, (inputs, outputs).

    Raises:
        ValueError: A row is no distribution.
    """
    return fastest_use(given, np.zeros(len(given)))


def fastest_use(given: Row, seconds: ArrayLike) -> Best:
    """Return the use of most information per time.

    Args:
        given: Probability of each output given each input, (inputs, outputs).
        seconds: How long a use of each input takes, (inputs,); all 0: information per use.

    Raises:
        ValueError: A row is no distribution, or durations do not fit.
    """
    lasts = np.asarray(seconds, dtype=np.float64)
    if given.ndim != 2 or lasts.shape != given.shape[:1] or (lasts < 0).any():
        raise ValueError(f"{lasts.shape} durations for {given.shape} probabilities; one per row")
    if (given < 0).any() or not np.allclose(given.sum(axis=1), 1.0):
        raise ValueError("each row of a channel is a distribution; these do not sum to 1")
    timed = bool(lasts.any())
    rate = 0.0  # nats per second
    while True:
        share = _balanced(given, rate * lasts)
        nats, mean = information(share, given), float(share @ lasts)
        if not timed or nats <= rate * mean + ENOUGH:
            return Best(nats, mean, share)
        rate = nats / mean


def _balanced(given: Row, cost: Row) -> Row:
    """Return the inputs' shares for which I - cost is greatest, (inputs,)."""
    share = np.full(len(given), 1.0 / len(given))
    for _ in range(ROUNDS):
        worth = _divergence(given, share @ given) - cost
        if worth.max() - share @ worth < ENOUGH:
            break
        share = share * np.exp(worth - worth.max())
        share /= share.sum()
    return share


def _divergence(given: Row, output: Row) -> Row:
    """Return how far each input's outputs are from all outputs: relative entropy, (inputs,)."""
    ratio = np.log(np.maximum(given, _LEAST)) - np.log(np.maximum(output, _LEAST))
    return np.asarray(np.where(given > 0, given * ratio, 0.0).sum(axis=1))
