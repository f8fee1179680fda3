"""Touch image: the stacked frames of one touch, from which its position is estimated.

One frame of a noisy sensor gives a poor position, and the median of many poor positions keeps
their common error. So the frames of a touch are averaged before the network, each weighted by its
signal, and the residue of the touch before is subtracted.

A touch is where it began. So only its first frames count, and of these only the ones before the
finger slid: while the last third shows another place than the rest, it is left out. Images show
another place if they differ in shape by more than the noise of both and the deepening of a finger.

The noise of the stacked image, as a share of its strength, determines the uncertainty of the
position: `PositionSpread` converts it to a standard deviation in grid units.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np

from controller.recognition.images.frames import Image
from controller.shared.aliases import Change, State

_LEAD_S: Final = 0.05  # before the first gesture frame, in which the finger arrives
_BEFORE_S: Final = 0.3  # untouched images before that
_FEWEST: Final = 4  # of these
_TOUCH_S: Final = 0.3  # of a touch: where a finger slides later, it does not move the place
_LANDING_S: Final = 0.12  # of it: so many show a place
_CLEAR: Final = 4.0  # times its noise: the power of an image that shows a finger
_SLID: Final = 0.3  # share of an image that differs where the finger is elsewhere: measured
_CHANCE: Final = 1.4  # times its expectation: noise hardly reaches it
_RISING_S: Final = 0.09  # after a touch, in which its finger rises: another's residue is none of it
_GRACE: Final = 2  # images without a gesture that do not end a touch
_RESIDUE: Final = 0.01  # deviation left by a touch, by hysteresis and drift: measured
_OWN: Final = 0.25  # share of a touch's power that a residue does not reach
_ROUNDS: Final = 3  # of the weights; they have converged by then
_NEWEST: Final = 0.5  # weight of the newest image in the level of the contact
_FAST: Final = 0.9  # weight of a noiseless sensor's newest image in the uneven level
_NOISY: Final = 0.03  # noise that halves it
_TINY: Final = 1e-12  # power of an image without a signal
_TO_SIGMA: Final = float(np.sqrt(np.pi / 2.0))  # of a normal deviate's mean magnitude


@dataclass(frozen=True, slots=True)
class PositionSpread:
    """Uncertainty of the positions that a network estimates, measured by `models train`.

    Attributes:
        floor: Standard deviation of each axis without sensor noise, grid units.
        noise: Further standard deviation per unit of the image's relative noise, grid units.
    """

    floor: float
    noise: float

    def sigma(self, blur: float) -> float:
        """Return the standard deviation of each axis of a position, grid units.

        Args:
            blur: `TouchImage.blur` of its image.
        """
        return math.hypot(self.floor, self.noise * blur)


class ContactLevel:
    """Strength of the contact: the norm of the smoothed deviation above its noise.

    Source: the deviation of n taxels with noise of variance v has the mean square signal² + n v.

    Attributes:
        uneven: The same without what all taxels have in common, as a change of pressure.
    """

    def __init__(self, rows: int, columns: int) -> None:
        """Begin without a contact, for images of (rows, columns)."""
        self._mean: Change = np.zeros((rows, columns))
        self._slow: Change = np.zeros((rows, columns))
        self.uneven = 0.0

    def step(self, image: Image, idle: float) -> float:
        """Return the level after the next image, z, (rows, columns); `idle` as in `TouchImage`."""
        self._mean = self._mean + _NEWEST * (image.astype(np.float64) - 1.0 - self._mean)
        noise = self._mean.size * (_TO_SIGMA * idle) ** 2
        weight = _FAST / (1.0 + idle / _NOISY)
        self._slow = self._slow + weight * (image.astype(np.float64) - 1.0 - self._slow)
        uneven = self._slow - np.median(self._slow)
        power = float((uneven * uneven).sum()) - noise * weight / (2.0 - weight)
        self.uneven = math.sqrt(max(0.0, power))
        noise *= _NEWEST / (2.0 - _NEWEST)
        return math.sqrt(max(0.0, float((self._mean * self._mean).sum()) - noise))

    def restart(self) -> None:
        """Begin again without a contact."""
        self._mean, self._slow = np.zeros_like(self._mean), np.zeros_like(self._mean)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {"level": self._mean.copy(), "slow": self._slow.copy()}

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._mean, self._slow = state["level"].copy(), state["slow"].copy()


class TouchImage:
    """Weighted mean of the images of a touch; `state` and `restore` carry its state exactly.

    Attributes:
        blur: Relative noise of the last result of `image`, the residue before the touch included.
    """

    def __init__(self, frames: int, rows: int, columns: int, rate_hz: float = 10.0) -> None:
        """Keep at most `frames` images, (rows, columns), of a touch."""
        self._shape = (rows, columns)
        self._lead = max(1, round(_LEAD_S * rate_hz))
        self._rising = int(_RISING_S * rate_hz)
        self._skip = 0  # further images that a rising finger is in
        before = max(_FEWEST, round(_BEFORE_S * rate_hz))
        self._untouched: deque[Change] = deque(maxlen=self._lead + before)  # since the last touch
        self._most = max(_FEWEST, round(_TOUCH_S * rate_hz))
        self._landing = max(_FEWEST, round(_LANDING_S * rate_hz))
        self._signals: deque[Change] = deque(maxlen=frames)  # of the present touch
        self._gap: list[Change] = []  # those since the last gesture frame
        self._left: Change = np.zeros(self._shape)  # residue before the touch
        self._touched = False
        self._noise = 0.0  # variance of a taxel while nothing touched
        self._residue = 0.0  # variance of the residue before the touch
        self._image: Image | None = None  # of the signals, if computed
        self.blur = 0.0

    def step(
        self,
        image: Image,
        idle: float,
        *,
        null: bool,
        released: bool = False,
        left: bool = False,
    ) -> None:
        """Take the next image.

        Args:
            image: z, (rows, columns).
            idle: Mean of |z - 1| while nothing touches.
            null: The label is "null".
            released: The held gesture has ended: the next image begins another touch.
            left: Fingers that stayed after their touch have left: they are no residue.
        """
        signal = image.astype(np.float64) - 1.0
        if null:
            self._rest(signal, released=released, left=left)
            return
        if not self._touched:
            self._begin(idle)
        for newest in (*self._gap, signal):
            if len(self._signals) < self._most:
                self._signals.append(newest - self._left)
                self._image = None
        self._gap.clear()

    def restart(self, idle: float) -> None:
        """Begin another touch: what was there before is in no further image."""
        self._untouched.clear()
        self._gap.clear()
        self._begin(idle)

    @property
    def signals(self) -> Change:
        """Its first images, z - 1, (n, rows, columns), without the residue before it.

        An uneven residue half as strong as the touch is none: a finger came down slowly.
        """
        signals = self._stack(self._signals)
        uneven = float(np.square(self._left - np.median(self._left)).mean())
        return signals + self._left if uneven > _OWN * float(np.square(signals).mean()) else signals

    def image(self, *, latest: bool = False) -> Image | None:
        """Return the image of the present touch, z, (rows, columns); None while there is none.

        Args:
            latest: Without a present touch, return the image of the latest.
        """
        if not (self._touched or latest) or not self._signals:
            return None
        if self._image is None:
            self._image = self._averaged()
        return self._image

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {
            "untouched": self._stack(self._untouched),
            "signals": self._stack(self._signals),
            "gap": self._stack(self._gap),
            "left": self._left.copy(),
            "touched": np.array([float(self._touched)]),
            "noise": np.array([self._noise, self._residue]),
            "skip": np.array([float(self._skip)]),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._untouched.clear()
        self._untouched.extend(state["untouched"])
        self._signals.clear()
        self._signals.extend(state["signals"])
        self._image = None
        self._gap = list(state["gap"])
        self._left = state["left"].copy()
        self._touched = bool(state["touched"][0]) and bool(self._signals)
        self._noise, self._residue = state["noise"].tolist()
        self._skip = int(state["skip"][0])

    def _rest(self, signal: Change, *, released: bool, left: bool) -> None:
        """Take an image, (rows, columns), without a gesture; several of them end the touch."""
        if not self._touched:
            if left:
                self._untouched.clear()
                self._skip = self._rising
            if self._skip:
                self._skip -= 1
            else:
                self._untouched.append(signal)
            return
        self._gap.append(signal)
        if released or len(self._gap) > _GRACE:
            self._touched = False
            self._untouched.clear()
            self._untouched.extend(self._gap[self._rising :])
            self._skip = max(0, self._rising - len(self._gap))
            self._gap.clear()

    def _begin(self, idle: float) -> None:
        """Begin a touch: its residue, and the images in which the finger arrived."""
        recent = list(self._untouched)
        before = recent[: -self._lead]
        self._left = np.zeros(self._shape)
        self._noise, self._residue = (_TO_SIGMA * idle) ** 2, _RESIDUE**2
        if before:  # shrinkage: the noisier the sensor, the less its images show the residue
            noise = self._noise / _RESIDUE**2 / len(before)
            self._left = np.mean(before, axis=0) / (1.0 + noise)
            self._residue *= noise / (1.0 + noise)
        self._signals.clear()
        self._signals.extend(signal - self._left for signal in recent[-self._lead :])
        self._touched, self._skip = True, 0

    def _averaged(self) -> Image:
        """Return the mean of the images before the finger slid, and measure its blur."""
        signals = np.array(self._signals).reshape(len(self._signals), -1)
        while (first := 2 * len(signals) // 3) >= self._landing and self._slid(signals, first):
            signals = signals[:first]
        mean, share = _filtered(signals)
        noise = self._noise * share + self._residue
        self.blur = math.sqrt(noise / max(float(mean @ mean), noise, _TINY))
        return np.asarray(1.0 + mean, dtype=np.float32).reshape(self._shape)

    def _slid(self, signals: Change, first: int) -> bool:
        """Return whether images (n, taxels) after the first show another place than these."""
        (before, share), (after, later) = _filtered(signals[:first]), _filtered(signals[first:])
        noise, power = self._noise * len(before), float(before @ before)
        if power <= _CLEAR * (noise * share + self._residue * len(before)):
            return False
        scale = float(after @ before) / power
        rest = after - scale * before
        by_noise = noise * (later + scale * scale * share)
        seen = max(0.0, float(after @ after) - noise * later)
        return float(rest @ rest) > _CHANCE * by_noise + _SLID**2 * seen

    def _stack(self, signals: "deque[Change] | list[Change]") -> Change:
        """Return images (rows, columns) as (n, rows, columns)."""
        return np.array(signals) if signals else np.empty((0, *self._shape))


def _filtered(signals: Change) -> tuple[Change, float]:
    """Return the mean of images (n, taxels) by a matched filter, and its share of their noise."""
    mean, shares = signals.mean(axis=0), np.full(len(signals), 1.0 / len(signals))
    for _ in range(_ROUNDS):  # weights by similarity to the mean
        weights = np.maximum(signals @ mean, 0.0)
        total = float(weights.sum())
        if total <= 0.0:
            break
        shares = weights / total
        mean = shares @ signals
    return mean, float(shares @ shares)
