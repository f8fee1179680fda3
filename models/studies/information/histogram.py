"""Histogram estimates of a sensor's entropy and information: section 6 of the paper, figure 9.

The paper scales every sensor to [0, 1] for each gesture on its own, puts scaled values and labels
into 25-bin histograms, and prints H(y), H(z) and I(z, y) as "bits"; the figures are nats (R's
`entropy` package counts in nats by default). Scaling each gesture on its own leaks the label into
z; `scaling="global"` does not.
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
BITS: Final = 1.0 / np.log(2.0)  # bits in a nat
SHUFFLES: Final = 5

Scaling = Literal["paper", "global"]
Signals = NDArray[np.floating]  # (frames, sensors), C / C0
Classes = NDArray[np.integer]  # (frames,), from 0


@dataclass(frozen=True, slots=True)
class Statistics:
    """Entropies and information of several sensors in nats, (sensors,) each."""

    h_z: NDArray[np.float64]  # entropy of each sensor's quantised signal
    h_y: NDArray[np.float64]  # entropy of the labels, the same for each
    information: NDArray[np.float64]  # mutual information of each sensor with the labels


def statistics(
    z: Signals, y: Classes, scaling: Scaling = "paper", *, corrected: bool = False, bins: int = BINS
) -> Statistics:
    """Return the statistics of section 6, of signals (frames, sensors) and labels (frames,).

    The scaling is min-max of each sensor and label ("paper"), or of each sensor ("global"). If
    corrected, the bias of each entropy is removed, (used cells - 1) / 2n. Source: Miller, Note on
    the bias of information estimates, 1955 ("Miller-Madow").
    """
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
    joint = count.reshape(sensors, bins, len(labels)) / len(z)
    return mutual_information(joint, len(z) if corrected else 0)


def null_information(z: Signals, y: Classes, *, slow: bool = False) -> float:
    """Return the estimate where sensors are unrelated to the labels, nats, mean of the sensors.

    Labels are shuffled; if `slow`, shifted in time by random amounts instead, the end joined to the
    beginning: both stay as slow as they are, so drift may agree with long gestures by chance.
    """
    rng, quarter, found = np.random.default_rng(0), len(y) // 4, []
    for _ in range(SHUFFLES):
        by = int(rng.integers(quarter, max(len(y) - quarter, quarter + 1)))
        other = np.roll(y, by) if slow else rng.permutation(y)
        found.append(statistics(z, other, "global").information.mean())
    return float(np.mean(found))


def entropy(y: Classes) -> float:
    """Return the Shannon entropy of class numbers (n,) from their frequencies, nats."""
    return float(entr(np.bincount(y) / max(1, len(y))).sum())


def mutual_information(joint: NDArray[np.float64], samples: float = 0) -> Statistics:
    """Return the statistics of (sensors, bins, labels), the bias of so many samples removed."""
    several = joint.sum(axis=2), joint.sum(axis=1), joint.reshape(len(joint), -1)
    h_z, h_y, h_both = (
        entr(p).sum(axis=1) + (np.count_nonzero(p, axis=1) - 1.0) / (2.0 * (samples or np.inf))
        for p in several
    )
    return Statistics(h_z, h_y, h_z + h_y - h_both)
