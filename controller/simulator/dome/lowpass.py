"""The first-order low-pass that memory, regulator and drift share, without a loop over time."""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from controller.shared.aliases import Array

_BLOCK: Final = 1024  # steps at once, as long as the powers below stay finite
_RANGE: Final = 300.0  # their greatest exponent: exp(2 * 300) is far from overflow


class Lowpass:
    """y[i] = keep y[i - 1] + x[i], by y[i] / keep^i being a running sum.

    Equal to the loop to 14 digits, however time is cut.

    Attributes:
        level: The latest y.
    """

    def __init__(self, keep: ArrayLike, level: Array) -> None:
        """Start at a level; what a step keeps is from 0 to 1, a shape that broadcasts to it."""
        self.level = level
        rate = -np.log(np.maximum(keep, 1e-100))
        block = int(np.clip(_RANGE / rate.max(), 1, _BLOCK))
        time = np.arange(1.0, block + 1.0).reshape(-1, *[1] * level.ndim)
        self._powers = np.exp(-rate * time)

    def advance(self, x: Array) -> Array:
        """Return y at each step, (steps, ...), for x, same shape."""
        out = np.empty_like(x)
        for start in range(0, len(x), len(self._powers)):
            part = x[start : start + len(self._powers)]
            power = self._powers[: len(part)]
            y = np.cumsum(part / power, axis=0)
            y += self.level
            y *= power
            out[start : start + len(part)] = y
            self.level = y[-1]
        return out


class Coloured:
    """Noise of deviation 1 and a time constant (Ornstein-Uhlenbeck); frame by frame or at once.

    The same process at any frame rate: frames closer together than the time constant are alike, so
    that a faster scan does not average it away.
    """

    def __init__(self, size: int, frames: float, rng: np.random.Generator) -> None:
        """Start in the stationary state.

        Args:
            size: Independent values at once.
            frames: Time constant, frames.
            rng: Draws.
        """
        self._rng = rng
        keep = float(np.exp(-1.0 / frames))
        self._kick = float(np.sqrt(1.0 - keep**2))
        self._level = Lowpass(keep, rng.normal(0.0, 1.0, size))

    def advance(self, frames: int) -> Array:
        """Return the next values, (frames, size)."""
        return self._level.advance(
            self._kick * self._rng.normal(0.0, 1.0, (frames, len(self._level.level)))
        )
