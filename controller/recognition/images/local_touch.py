"""Local gate: light touches of few taxels, which the mean over a large sensor does not show."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.drift import mean_of
from controller.recognition.images.scale import FIRM
from controller.shared.aliases import State

Change = NDArray[np.floating]  # z, or z - 1, (rows, columns)

FEW: Final = 60  # taxels; on a sensor of fewer, a finger moves the mean
# Times the usual strength of noise. White noise exceeds 1.6 times in 1 of 200 frames of 12×21
# taxels, and less often on more.
NOISE: Final = 1.8
LIGHT: Final = 0.15  # of a firm touch's strength; the residue of a touch is weaker
_FOLLOW: Final = 0.01  # of the strength of a firm touch, a frame
_SLOW: Final = 0.05  # of the pace of noise at rest, as what is felt might be more noise
_MOST: Final = 3.0  # times the noise; a stronger change adds no more to it


class LocalGate:
    """Strength above which a finger touches, by the noise of the sensor and by its firm touches.

    Attributes:
        noise: Size of the usual strength while nothing touches; 0 until it is known.
        firm: Strength of a firm touch; 0: unknown, with its sign. A change of the other sign is
            a finger that was part of the baseline and has left.
    """

    def __init__(self, shape: tuple[int, int], firm: float) -> None:
        """Begin for a sensor of (rows, columns)."""
        self.noise, self.firm = 0.0, firm
        self._off = shape[0] * shape[1] <= FEW or min(shape) < 2

    def strength(self, change: Change) -> float:
        """Return the strongest mean of 2×2 taxels without what all share; 0 on a small sensor."""
        if self._off:
            return 0.0
        pairs = change[1:] + change[:-1]
        patches = (pairs[:, 1:] + pairs[:, :-1]) / 4.0
        middle = mean_of(change)
        low, high = float(patches.min()) - middle, float(patches.max()) - middle
        return high if high > -low else low

    def touched(self, strength: float) -> bool:
        """Return whether a strength is that of a touch."""
        light = max(NOISE * self.noise, LIGHT * max(FIRM, abs(self.firm)))
        return abs(strength) > light and strength * self.firm >= 0.0

    def measure(self, images: NDArray[np.float64]) -> None:
        """Take the noise from successive images, (n, rows, columns), by their changes."""
        found = [abs(self.strength(change)) for change in np.diff(images, axis=0)]
        self.noise = float(np.median(found) / np.sqrt(2.0))

    def rest(self, strength: float, pace: float) -> None:
        """Follow the noise by the strength of an untouched frame, at a pace a frame."""
        self.noise += (pace if self.noise else 1.0) * (abs(strength) - self.noise)

    def learn(self, strength: float, pace: float) -> None:
        """Follow firm touches, and noise that grows slowly, by the strength of a touched frame."""
        size = abs(strength)
        self.noise += _SLOW * pace * (min(size, _MOST * self.noise) - self.noise)
        if size > abs(self.firm) / 2.0:
            self.firm += _FOLLOW * (strength - self.firm)

    def rescale(self, factor: float) -> None:
        """Convert to another scale of images."""
        self.noise *= factor
        self.firm *= factor

    def state(self) -> State:
        """Return everything remembered; nothing on a small sensor."""
        return {} if self._off else {"local": np.array([self.noise, self.firm])}

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        if not self._off:
            self.noise, self.firm = state["local"].tolist()
