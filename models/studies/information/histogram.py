"""Histogram estimates of a sensor's entropy and information: section 6 of the paper, figure 9.

The paper scales every sensor to [0, 1] for each gesture on its own, puts scaled values and
labels into 25-bin histograms, and prints H(y), H(z) and I(z, y); the paper says "bits", the figures
are nats (R's `entropy` package counts in nats by default). Scaling each gesture on its
own leaks the label into z; `scaling="global"` does not.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import entr  # the [train] extra

BINS: Final = 25  # paper, section 6
PAPER_FRAMES: Final = 34_795
PAPER_H_Y: Final = 1.28  # nats
PAPER_H_Z: Final = 2.71  # nats, mean over the sensors: paper, section 6
PAPER_INFORMATION: Final = 0.13  # nats
PAPER_STATIC: Final = 0.57  # share of frames without a gesture
OUTLIERS: Final = 0.001  # share of frames that `clipped` limits at either end
BITS: Final = 1.0 / np.log(2.0)  # bits in a nat

Scaling = Literal["paper", "global"]
Signals = NDArray[np.floating]  # (frames, sensors), C / C0
Classes = NDArray[np.integer]  # (frames,), from 0


@dataclass(frozen=True, slots=True)
class Statistics:
    """Entropies and information of several sensors in nats; multiply by `BITS` for bits.

    Attributes:
        h_z: Entropy of each sensor's quantised signal, (sensors,).
        h_y: Entropy of the labels, the same for each, (sensors,).
        information: Mutual information of each sensor with the labels, (sensors,).
    """

    h_z: NDArray[np.float64]
    h_y: NDArray[np.float64]
    information: NDArray[np.float64]


def statistics(
    z: Signals,
    y: Classes,
    bins: int = BINS,
    scaling: Scaling = "paper",
    *,
    corrected: bool = False,
) -> Statistics:
    """Return the statistics of section 6.

    Args:
        z: Signals, (frames, sensors).
        y: Label of each frame, (frames,).
        bins: Bins of each sensor's histogram.
        scaling: "paper": min-max of each sensor and label; "global": of each sensor.
        corrected: Remove the bias of each entropy, (used cells - 1) / 2n. Source: Miller, Note on
            the bias of information estimates, 1955 ("Miller-Madow").

    Raises:
        ValueError: There are no frames, or not one label for each.
    """
    return mutual_information(_joint(z, y, bins, scaling), len(z) if corrected else 0)


def null_information(
    z: Signals,
    y: Classes,
    bins: int = BINS,
    *,
    slow: bool = False,
    seed: int = 0,
    shuffles: int = 5,
) -> float:
    """Return the estimate where sensors are unrelated to the labels, nats, mean of the sensors.

    (Scaled globally: scaled by its label, even noise would be informative.)

    Args:
        z: Signals, (frames, sensors).
        y: Label of each frame, (frames,).
        bins: Bins of each sensor's histogram.
        slow: Labels are not shuffled frame by frame, but shifted in time by random amounts, the
            end joined to the beginning: both stay as slow as they are, so drift may agree with
            long gestures by chance.
        seed: Of the shuffling.
        shuffles: Number of shuffles.
    """
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(shuffles):
        quarter = len(y) // 4
        by = int(rng.integers(quarter, max(len(y) - quarter, quarter + 1)))
        other = np.roll(y, by) if slow else rng.permutation(y)
        found.append(statistics(z, other, bins, "global").information.mean())
    return float(np.mean(found))


def clipped(z: Signals, y: Classes) -> NDArray[np.float64]:
    """Return signals limited to all but the outermost frame in a thousand, for each gesture.

    The paper's scaling depends on the two most extreme frames of each sensor and gesture.

    Args:
        z: Signals, (frames, sensors).
        y: Label of each frame, (frames,).

    Returns:
        The same shape as `z`.
    """
    out = np.asarray(z, dtype=np.float64).copy()
    for label in np.unique(y):
        own = y == label
        out[own] = np.clip(z[own], *np.quantile(z[own], [OUTLIERS, 1.0 - OUTLIERS], axis=0))
    return out


def entropy(y: Classes) -> float:
    """Return the Shannon entropy of class numbers (n,) from their frequencies, nats."""
    return float(entr(np.bincount(y) / max(1, len(y))).sum())


def mutual_information(joint: NDArray[np.float64], samples: float = 0) -> Statistics:
    """Return the statistics of joint distributions.

    Args:
        joint: Of each sensor and the label, (sensors, bins, labels); each sums to 1.
        samples: Number of samples behind each, to remove the bias of each entropy; 0: none.
    """
    several = joint.sum(axis=2), joint.sum(axis=1), joint.reshape(len(joint), -1)
    h_z, h_y, h_both = (
        entr(p).sum(axis=1) + (np.count_nonzero(p, axis=1) - 1.0) / (2.0 * (samples or np.inf))
        for p in several
    )
    return Statistics(h_z, h_y, h_z + h_y - h_both)


def _joint(z: Signals, y: Classes, bins: int, scaling: Scaling) -> NDArray[np.float64]:
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
