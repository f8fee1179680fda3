"""Radius of a touch, by which elbows, palms and several fingers are told from one finger.

An elbow is no press.

The radius is that of the circle around all that touches. A small network estimates it from each
image. The estimates are combined by their precision, beginning with that of an ordinary finger: on
a noisy sensor a touch is a finger's until its images show otherwise.
"""

import math
from dataclasses import dataclass, field, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Array

_FEWEST_IMAGES: Final = 2  # images of a touch: each is compared with the one before
_LEAST_STRENGTH: Final = 0.002  # added to each: an image without a touch has none
_FINGER_LOG_MM: Final = (math.log(7.5), 0.4)  # ln mm of an ordinary finger: mean, deviation
# Deviation of ln mm that more images do not go below: people and orbs vary
_LEAST_DEVIATION: Final = 0.1

Matrix = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """What a touch shows of gestures beside CNN-3D; stored in the bundle.

    Attributes:
        widest_mm: Greatest radius of a touch that they are answered for: the radius less its
            deviation must not exceed it.
        labels: Those gestures: of a single finger.
        several: Gestures of several fingers.
        taught: Gestures that CNN-3D was taught anew, of which the recurrent network has no say.
        quiet: Mean of |z - 1| while nothing touches, above which images do not show a radius: there
            a loss of pressure looks like a palm.
    """

    widest_mm: float = field(default=12.0, metadata={"range": (1.0, 1000.0)})
    labels: tuple[str, ...] = ()
    several: tuple[str, ...] = ()
    taught: tuple[str, ...] = ()
    quiet: float = field(default=0.03, metadata={"range": (0.0, 10.0)})

    def too_wide(self, log_mm: float, deviation: float) -> bool:
        """Whether a touch is too wide, by ln mm of its radius and the deviation of that."""
        return log_mm - deviation > math.log(self.widest_mm)


@dataclass(frozen=True, slots=True, eq=False)
class RadiusNetwork:
    """Two hidden layers with relu; from features of an image to ln radius, and ln variance."""

    first: Matrix  # (units, features)
    first_bias: Matrix  # (units,)
    second: Matrix  # (units, units)
    second_bias: Matrix  # (units,)
    out: Matrix  # (2, units)
    out_bias: Matrix  # (2,)
    prior: Matrix  # mean and deviation of ln mm in its training, (2,)

    def estimates(self, inputs: Matrix) -> tuple[Array, Array]:
        """Return ln mm and its variance, (n,) each, of features (n, features)."""
        hidden = np.maximum(inputs @ self.first.T + self.first_bias, 0.0)
        hidden = np.maximum(hidden @ self.second.T + self.second_bias, 0.0)
        out = (hidden @ self.out.T + self.out_bias).astype(np.float64)
        mean, deviation = self.prior.tolist()
        return mean + deviation * out[:, 0], deviation**2 * np.exp(np.minimum(out[:, 1], 0.0))

    def log_radius(self, touch: Array, idle: float) -> tuple[float, float]:
        """Return ln mm of a touch's radius, and its deviation.

        Args:
            touch: z - 1 of its images, without what was there before, (n, rows, columns).
            idle: Mean of |z - 1| while nothing touches.
        """
        if len(touch) < _FEWEST_IMAGES:
            return _FINGER_LOG_MM
        return self.combined(*self.estimates(features(touch, idle)))

    def combined(self, logs: Array, variances: Array) -> tuple[float, float]:
        """Return ln mm of a contact's radius, and its deviation, from the estimates of images."""
        (finger, varies), (mean, deviation) = _FINGER_LOG_MM, self.prior.tolist()
        # An image adds what it says beyond the radii of the training.
        added = np.maximum(1.0 / variances - 1.0 / deviation**2, 0.0)
        weighed = (logs / variances - mean / deviation**2)[added > 0.0]
        share = 1.0 / max(1.0, float(added.sum()) * _LEAST_DEVIATION**2)
        precision = 1.0 / varies**2 + share * float(added.sum())
        total = finger / varies**2 + share * float(weighed.sum())
        return total / precision, 1.0 / math.sqrt(precision)

    def arrays(self) -> dict[str, Matrix]:
        """Return the arrays by name."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


def features(touch: Array, idle: float) -> Matrix:
    """Return the network's inputs, (n - 1, 2 * taxels + 2), of all images but the first.

    The image and its change since the one before, both by its strength; the logarithm of the
    strength; the noise by the strength. Arguments are as in `RadiusNetwork.log_radius`.
    """
    images = touch.reshape(len(touch), -1)
    now, before = images[1:], images[:-1]
    strength = np.sqrt(np.square(now).mean(axis=1, keepdims=True)) + _LEAST_STRENGTH
    parts = (now / strength, (now - before) / strength, np.log(strength / 0.05), idle / strength)
    return np.concatenate(parts, axis=1).astype(np.float32)
