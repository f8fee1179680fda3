"""Noise of every taxel at rest, and the two limits of a touch that follow from it.

A frame is touched if the mean deviation of all taxels, or the mean of 2×2 of them on a large
sensor, exceeds what their noise explains. The noise also says how fast the rest image may follow an
untouched frame.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.drift import mean_of
from controller.recognition.images.frames import Image, PreprocessSettings
from controller.recognition.images.scale import FIRM
from controller.shared.aliases import State

# A light finger on a noisy skin stays below the gate, so the baseline would follow its touches: at
# a press every 1.3 s, two of five followed frames are touched. But noise cancels in the mean over
# the skin, and a finger only lowers it: where the mean of a quiet frame is this low, the baseline
# follows more slowly. A quarter of the rate, or none, helps light hands more, but loses fast drift.
# Where noise is not most of the gate, it hides no finger, and the rate is the usual one.
_LOW: Final = 0.4  # of the gate
_WARY: Final = 0.5  # of the usual rate
_PACE: Final = 0.2  # of the rate of the baseline: the noise follows more slowly

# Of 2×2 taxels:
_FEW: Final = 60  # taxels; on a sensor of fewer, a finger moves the mean of all
# Times the root mean square of their `size`, which is 0.8 standard deviations: five standard
# deviations of their mean.
_PATCH_NOISE: Final = 3.1
_LIGHT: Final = 0.15  # of a firm touch's strength; the residue of a touch is weaker
_FOLLOW: Final = 0.01  # of the strength of a firm touch, a frame
_SLOW: Final = 0.05  # of the pace of noise at rest, as what is felt might be more noise
_MOST: Final = 3.0  # times the noise; a stronger change adds no more to it


class TaxelNoise:
    """Noise of every taxel, followed while nothing touches, and the two limits of a touch.

    Attributes:
        size: Mean |z - 1| of each taxel while nothing touches, (rows, columns); 0 until known.
        idle: Mean of `size`.
        firm: Strength of a firm touch of 2×2 taxels, with its sign; 0: unknown. A change of the
            other sign is a finger that was part of the baseline and has left.
    """

    def __init__(self, settings: PreprocessSettings, shape: tuple[int, int]) -> None:
        """Begin for a sensor of (rows, columns)."""
        self.size = np.zeros(shape)
        self.idle = 0.0
        self.firm = -FIRM if settings.normalise == "ratio" else 0.0
        self._settings = settings
        self._pace = _PACE / max(1.0, settings.follow_s * settings.rate_hz)
        self._local = shape[0] * shape[1] > _FEW and min(shape) > 1

    @property
    def gate(self) -> float:
        """Mean deviation of all taxels below which nothing touches."""
        return self._settings.gate + self._settings.gate_noise * self.idle

    def strength(self, image: Image) -> float:
        """Return the strongest mean of 2×2 taxels, less what all share; 0: noise explains all."""
        if not self._local:
            return 0.0
        change = _patches(image) - mean_of(image)
        noise = _PATCH_NOISE * np.sqrt(_patches(np.square(self.size)))
        low, high = float((change + noise).min()), float((change - noise).max())
        if low >= 0.0 >= high:
            return 0.0
        return float(change.max() if high > -low else change.min())

    def touched(self, deviation: float, strength: float) -> bool:
        """Return whether a frame of mean deviation |z - 1| and this strength is touched."""
        light = _LIGHT * max(FIRM, abs(self.firm))
        return deviation >= self.gate or (abs(strength) > light and strength * self.firm >= 0.0)

    def pace(self, image: Image) -> float:
        """Return how fast the baseline may follow an untouched image, of the usual rate."""
        hidden = self._settings.normalise == "ratio" and self.gate > 2.0 * self._settings.gate
        return _WARY if hidden and 1.0 - mean_of(image) > _LOW * self.gate else 1.0

    def begin(self, size: NDArray[np.float64] | float) -> None:
        """Take the noise of each taxel, (rows, columns), or the same of all."""
        self.size = np.broadcast_to(size, self.size.shape).astype(np.float64)
        self.idle = mean_of(self.size)

    def follow(self, image: Image, pace: float) -> None:
        """Follow the noise by an untouched image, at a share of the usual pace."""
        self.begin(self.size + pace * self._pace * (np.abs(image - 1.0) - self.size))

    def learn(self, image: Image, deviation: float, strength: float) -> None:
        """Follow firm touches, and noise that grows slowly, by a touched image."""
        if deviation < self.gate:  # a light touch, or more noise than before
            change = np.minimum(np.abs(image - 1.0), _MOST * self.size)
            self.begin(self.size + _SLOW * self._pace * (change - self.size))
        if self._local and abs(strength) > abs(self.firm) / 2.0:
            self.firm += _FOLLOW * (strength - self.firm)

    def rescale(self, settings: PreprocessSettings) -> None:
        """Convert to settings of another scale of images."""
        factor = abs(self._settings.scale / settings.scale)
        self.begin(self.size * factor)
        self.firm *= factor
        self._settings = settings

    def state(self) -> State:
        """Return everything remembered."""
        return {"noise": self.size.copy(), "firm": np.array([self.firm])}

    def restore(self, state: State, idle: float) -> None:
        """Continue exactly where `state` was taken; an older one has the mean deviation only."""
        self.begin(state["noise"] if state["noise"].any() else idle)
        self.firm = float(state["firm"][0])


def _patches(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the mean of each 2×2 taxels of (rows, columns), one row and column less."""
    pairs = values[1:] + values[:-1]
    return (pairs[:, 1:] + pairs[:, :-1]) / 4.0
