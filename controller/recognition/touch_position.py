"""Touch image: the frames of one touch stacked, so that its position is estimated once.

A noisy sensor locates a finger poorly in one frame, and the median of many poor positions
keeps their common error. So the frames of a touch are laid over each other before the network
sees them, each weighted by how strongly it shows the touch, and what the rubber still remembers
of the touch before is taken away.

The noise of the stacked image, as a share of its strength, determines the uncertainty of the
position: `PositionSpread` converts it to a standard deviation in grid units.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.frames import Image, State

_LEAD: Final = 1  # image just before the networks notice: the finger arrives in it
_BEFORE: Final = 4  # images before that, of the sensor untouched
_GRACE: Final = 2  # images without a gesture that do not end a touch: the networks blink
_RESIDUE: Final = 0.01  # deviation that a touch leaves behind, with memory and drift: measured
_ROUNDS: Final = 3  # until the weights agree with the image that they make
_TINY: Final = 1e-12  # of an image that shows nothing at all
_TO_SIGMA: Final = float(np.sqrt(np.pi / 2.0))  # of a normal deviate's mean magnitude

Signal = NDArray[np.float64]  # z - 1, (rows, columns)


@dataclass(frozen=True, slots=True)
class PositionSpread:
    """Uncertainty of the positions that a network estimates, measured by `models tune`.

    Attributes:
        floor: Deviation of a place, of each axis, where the sensor has no noise, grid units.
        noise: What the image's noise, as a share of its strength, adds to it, grid units.
    """

    floor: float
    noise: float

    def sigma(self, blur: float) -> float:
        """Return the deviation of a place, of each axis, grid units.

        Args:
            blur: `TouchImage.blur` of the image that it was told from.
        """
        return math.hypot(self.floor, self.noise * blur)


class TouchImage:
    """Lays the images of a touch over each other, as they come.

    Pure but for what it remembers, which `state` and `restore` carry exactly.

    Attributes:
        blur: Of the image that `image` made last: its noise, what was left before the touch
            included, as a share of its strength.
    """

    def __init__(self, frames: int, rows: int, columns: int) -> None:
        """Remember at most `frames` of a touch."""
        self._shape = (rows, columns)
        self._untouched: deque[Signal] = deque(maxlen=_LEAD + _BEFORE)  # since the last touch
        self._signals: deque[Signal] = deque(maxlen=frames)  # of the present touch
        self._gap: list[Signal] = []  # those since the networks last saw a gesture
        self._left: Signal = np.zeros(self._shape)  # what was there before the touch
        self._touched = False
        self._noise = 0.0  # variance of a reading while nothing touched
        self._doubt = 0.0  # variance of what was there before the touch
        self.blur = 0.0

    def step(self, image: Image, idle: float, *, null: bool, released: bool = False) -> None:
        """Take the next image.

        Args:
            image: z, (rows, columns).
            idle: Mean of |z - 1| while nothing touches: how noisy the sensor is.
            null: The networks see no gesture.
            released: The gesture that was held is over: what comes next is another touch.
        """
        signal = image.astype(np.float64) - 1.0
        if null:
            self._rest(signal, released=released)
            return
        if not self._touched:
            self._begin(idle)
        self._signals.extend(between - self._left for between in self._gap)
        self._gap.clear()
        self._signals.append(signal - self._left)

    def image(self) -> Image | None:
        """Return the image of the present touch, z, (rows, columns); None while there is none."""
        if not self._touched:
            return None
        signals = np.array(self._signals).reshape(len(self._signals), -1)
        mean, shares = signals.mean(axis=0), np.full(len(signals), 1.0 / len(signals))
        for _ in range(_ROUNDS):  # a matched filter: a frame counts as far as it is like the whole
            weights = np.maximum(signals @ mean, 0.0)
            total = float(weights.sum())
            if total <= 0.0:
                break
            shares = weights / total
            mean = shares @ signals
        noise = self._noise * float(shares @ shares) + self._doubt
        self.blur = math.sqrt(noise / max(float(mean @ mean), noise, _TINY))
        return np.asarray(1.0 + mean, dtype=np.float32).reshape(self._shape)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {
            "untouched": self._stack(self._untouched),
            "signals": self._stack(self._signals),
            "gap": self._stack(self._gap),
            "left": self._left.copy(),
            "touched": np.array([float(self._touched)]),
            "noise": np.array([self._noise, self._doubt]),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._untouched.clear()
        self._untouched.extend(state["untouched"])
        self._signals.clear()
        self._signals.extend(state["signals"])
        self._gap = list(state["gap"])
        self._left = state["left"].copy()
        self._touched = bool(state["touched"][0]) and bool(self._signals)
        self._noise, self._doubt = state["noise"].tolist()

    def _rest(self, signal: Signal, *, released: bool) -> None:
        """Take an image, (rows, columns), without a gesture: after several the touch has ended."""
        if not self._touched:
            self._untouched.append(signal)
            return
        self._gap.append(signal)
        if released or len(self._gap) > _GRACE:
            self._touched = False
            self._untouched.clear()
            self._untouched.extend(self._gap)
            self._signals.clear()
            self._gap.clear()

    def _begin(self, idle: float) -> None:
        """Begin a touch: what was there before it, and the images in which the finger arrived."""
        recent = list(self._untouched)
        before = recent[:-_LEAD]
        self._left = np.zeros(self._shape)
        self._noise, self._doubt = (_TO_SIGMA * idle) ** 2, _RESIDUE**2
        if before:  # the noisier the sensor, the less its latest images show of what was left
            noise = self._noise / _RESIDUE**2 / len(before)
            self._left = np.mean(before, axis=0) / (1.0 + noise)
            self._doubt *= noise / (1.0 + noise)
        self._signals.clear()
        self._signals.extend(signal - self._left for signal in recent[-_LEAD:])
        self._touched = True

    def _stack(self, signals: "deque[Signal] | list[Signal]") -> Signal:
        """Return images (rows, columns) as (n, rows, columns)."""
        return np.array(signals) if signals else np.empty((0, *self._shape))
