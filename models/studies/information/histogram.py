"""Information of a sensor: the paper's histogram statistics (section 6, figure 9).

The paper scales every sensor to [0, 1] for each gesture on its own, puts scaled values and
labels into 25-bin histograms, and prints H(y), H(z) and I(z, y); the paper says "bits", the figures
are nats (R's `entropy` package counts in nats unless told otherwise). Scaling each gesture on its
own leaks the label into z; `scaling="global"` does not.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

BINS: Final = 25  # paper, section 6
PAPER_FRAMES: Final = 34_795
PAPER_H_Y: Final = 1.28  # nats
PAPER_H_Z: Final = 2.71  # nats, mean over the sensors: paper, section 6
PAPER_INFORMATION: Final = 0.13  # nats
PAPER_STATIC: Final = 0.57  # share of frames without a gesture
OUTLIERS: Final = 0.001  # share of frames that `clipped` cuts off at either end
BITS: Final = 1.0 / np.log(2.0)  # bits in a nat

Scaling = Literal["paper", "global"]


@dataclass(frozen=True, slots=True)
class Statistics:
    """Entropies and information in nats; multiply by `BITS` for bits.

    Attributes:
        h_y: Entropy of the labels.
        h_z: Entropy of each sensor's quantised signal, (sensors,).
        information: Mutual information of each sensor with the labels, (sensors,).
    """

    h_y: float
    h_z: NDArray[np.float64]
    information: NDArray[np.float64]


def histogram_statistics(
    z: NDArray[np.floating],
    y: NDArray[np.integer],
    bins: int = BINS,
    scaling: Scaling = "paper",
) -> Statistics:
    """Return the statistics of section 6.

    Args:
        z: Signals, (frames, sensors); C / C0 in the paper.
        y: Label of each frame, whole numbers from 0, (frames,).
        bins: Bins of each sensor's histogram.
        scaling: "paper": min-max of each sensor and label; "global": of each sensor.

    Raises:
        ValueError: There are no frames, or not one label for each.
    """
    return _statistics(_joint(z, y, bins, scaling))


def corrected_statistics(
    z: NDArray[np.floating],
    y: NDArray[np.integer],
    bins: int = BINS,
    scaling: Scaling = "global",
) -> Statistics:
    """Return the same with the bias of each entropy taken off: (cells in use - 1) / 2n.

    Source: Miller, Note on the bias of information estimates, 1955 ("Miller-Madow").
    """
    joint = _joint(z, y, bins, scaling)
    found, n = _statistics(joint), len(z)

    def off(counts: NDArray[np.float64]) -> NDArray[np.float64]:
        used = np.count_nonzero(counts.reshape(len(counts), -1), axis=1)
        return np.asarray((used - 1.0) / (2.0 * n))

    of_y = off(joint.sum(axis=1)[:1])
    of_z, of_both = off(joint.sum(axis=2)), off(joint)
    return Statistics(
        found.h_y + float(of_y[0]), found.h_z + of_z, found.information + of_z + of_y - of_both
    )


def null_information(
    z: NDArray[np.floating],
    y: NDArray[np.integer],
    bins: int = BINS,
    *,
    slow: bool = False,
    seed: int = 0,
    shuffles: int = 5,
) -> float:
    """Return what the estimate says where sensors know nothing, nats, mean over the sensors.

    (One scaling for all: scaled by its label, even noise would know it.)

    Args:
        z: As above.
        y: As above.
        bins: As above.
        slow: Labels are not shuffled frame by frame, but moved against the signals by random times,
            the end joined to the beginning: both stay as slow as they are, and what drifts may
            agree with what lasts by chance.
        seed: Of the shuffling.
        shuffles: How often.
    """
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(shuffles):
        quarter = len(y) // 4
        by = int(rng.integers(quarter, max(len(y) - quarter, quarter + 1)))
        other = np.roll(y, by) if slow else rng.permutation(y)
        found.append(histogram_statistics(z, other, bins, "global").information.mean())
    return float(np.mean(found))


def clipped(z: NDArray[np.floating], y: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return signals with one frame in a thousand cut off at either end, for each gesture.

    The paper's scaling hangs on the two most extreme frames of each sensor and gesture.
    """
    out = np.asarray(z, dtype=np.float64).copy()
    for label in np.unique(y):
        own = y == label
        out[own] = np.clip(z[own], *np.quantile(z[own], [OUTLIERS, 1.0 - OUTLIERS], axis=0))
    return out


def entropy(probabilities: NDArray[np.float64]) -> float:
    """Return the Shannon entropy of a distribution that sums to 1, nats."""
    used = probabilities[probabilities > 0.0]
    return float(-(used * np.log(used)).sum())


def _joint(
    z: NDArray[np.floating], y: NDArray[np.integer], bins: int, scaling: Scaling
) -> NDArray[np.float64]:
    """Return the joint distribution of each sensor and the label, (sensors, bins, labels)."""
    if z.ndim != 2 or not len(z) or len(z) != len(y):
        raise ValueError(f"{z.shape} signals and {y.shape} labels; expected are (n, sensors), (n,)")
    labels, index = np.unique(y, return_inverse=True)
    scaled = np.empty(z.shape)
    groups = [index == k for k in range(len(labels))] if scaling == "paper" else [index >= 0]
    for group in groups:
        low, high = z[group].min(axis=0), z[group].max(axis=0)
        scaled[group] = (z[group] - low) / np.maximum(high - low, 1e-12)
    cell = np.minimum((scaled * bins).astype(np.int64), bins - 1)
    sensors = z.shape[1]
    place = (np.arange(sensors) * bins + cell) * len(labels) + index[:, None]
    count = np.bincount(place.ravel(), minlength=sensors * bins * len(labels))
    return np.asarray(count.reshape(sensors, bins, len(labels)) / len(z), dtype=np.float64)


def _statistics(joint: NDArray[np.float64]) -> Statistics:
    h_y = entropy(joint[0].sum(axis=0))
    h_z = np.array([entropy(p) for p in joint.sum(axis=2)])
    h_joint = np.array([entropy(p.ravel()) for p in joint])
    return Statistics(h_y, h_z, h_z + h_y - h_joint)
