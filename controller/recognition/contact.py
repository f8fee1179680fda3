"""Estimate of the contact in each frame: place, depth, number of fingers, angle.

A small network sees the newest image, what it has been on average for a short and a longer time,
and how the touch began; it says each quantity with its own deviation. On a quiet sensor the newest
image decides, on a noisy one the averages: the network has learned both from simulated contacts.
"""

import math
from collections import deque
from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.frames import Image
from controller.shared.aliases import Array, Change, Complex, State

MOST_FINGERS: Final = 3  # a larger number is not told apart
VALUES: Final = 5  # x, y, depth, angle, rise
SPREADS: Final = (0, 0, 1, 2, 3)  # which of the variances is that of each
OUTPUTS: Final = VALUES + max(SPREADS) + 1 + 1 + MOST_FINGERS  # of the network
PICTURES, SCALARS = 4, 15  # among its inputs
TURNS: Final = 6  # the last of its inputs, which change their sign in a mirror
_FAST_S, SLOW_S = 0.05, 0.2  # of the two averages, time constants
_BEGIN_S: Final = (0.05, 0.15)  # of a touch, against which its angle is measured
_BEFORE_S: Final = 0.15  # of untouched images: what they show is no part of the touch
_AGE_S: Final = 0.3  # a longer touch is no different
_GRACE: Final = 2  # untouched images that do not end a touch
_FALLEN, _RISEN = 0.4, 1.3  # shares of the peak, and of the least since: another touch begins
_CLEAR, _DRIFT = 2.2, 0.006  # of a mean image: powers of its noise, and z of the baseline's error
_GROWN, _GROWS_S = 1.6, 0.2  # share of the strength of its beginning, and how long it grows
_FAINT: Final = 0.02  # strength of a beginning that was none
_LEAST: Final = 0.002  # added to the strength: an image without a touch has none
_HARMONICS: Final = (1, 2, 3)  # of what lies around the middle of a touch, by which it turns
_REACH: Final = (0.5, 1.5)  # exponents of the distance, with which they are weighed
_TINY: Final = 1e-6
_LEAST_SIGMA: Final = 1e-3  # share of the deviation in training

Matrix = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class ContactEstimate:
    """Estimate of the contact in one frame; each quantity has its standard deviation.

    Attributes:
        x: Place across, grid units: the middle of all contacts, weighed by their depth.
        y: Place along, grid units, from the near side.
        place_sigma: Of each axis, grid units.
        depth_mm: Of the deepest contact, mm.
        depth_sigma: mm.
        fingers: Number of contacts: 1, 2, or 3 for more.
        fingers_sure: Probability of that number.
        angle_deg: How far the contacts have turned since they landed, degrees, counter-clockwise
            positive; 0 for one contact.
        angle_sigma: Degrees.
        rise_mm: Depth above its mean in the `SLOW_S` before, mm: what the touch deepens by is seen
            better than how deep it is.
        rise_sigma: mm.
    """

    x: float
    y: float
    place_sigma: float
    depth_mm: float
    depth_sigma: float
    fingers: int
    fingers_sure: float
    angle_deg: float
    angle_sigma: float
    rise_mm: float
    rise_sigma: float

    def deeper(self, factor: float) -> "ContactEstimate":
        """Return the same with depth, rise and their deviations times a factor."""
        names = ("depth_mm", "depth_sigma", "rise_mm", "rise_sigma")
        return replace(self, **{name: factor * getattr(self, name) for name in names})


@dataclass(frozen=True, slots=True, eq=False)
class ContactNetwork:
    """Two hidden layers with relu, from `ContactTracker.inputs` to quantities and their variances.

    The outputs are `VALUES` quantities, the ln variances of place, depth, angle and rise, and
    the logits of no finger, one, two, more.
    """

    first: Matrix  # (units, inputs)
    first_bias: Matrix  # (units,)
    second: Matrix  # (units, units)
    second_bias: Matrix  # (units,)
    out: Matrix  # (OUTPUTS, units)
    out_bias: Matrix  # (OUTPUTS,)
    scale: Matrix  # mean and deviation of the quantities in training, (2, VALUES)

    def outputs(self, inputs: Matrix) -> Matrix:
        """Return the outputs, (n, OUTPUTS), of inputs (n, inputs)."""
        hidden = np.maximum(inputs @ self.first.T + self.first_bias, 0.0)
        hidden = np.maximum(hidden @ self.second.T + self.second_bias, 0.0)
        return np.asarray(hidden @ self.out.T + self.out_bias, dtype=np.float32)

    def estimate(self, inputs: Matrix) -> ContactEstimate | None:
        """Return the estimate for the inputs of one frame, (inputs,); None: probably no contact."""
        out = self.outputs(inputs[None])[0].astype(np.float64)
        mean, deviation = self.scale.astype(np.float64)
        split = VALUES, OUTPUTS - 1 - MOST_FINGERS
        x, y, depth_mm, angle_deg, rise_mm = (mean + deviation * out[: split[0]]).tolist()
        spread = np.maximum(np.exp(0.5 * np.minimum(out[slice(*split)], 4.0)), _LEAST_SIGMA)
        place, _, depth, angle, rise = (spread[list(SPREADS)] * deviation).tolist()
        share = np.exp(out[split[1] :] - out[split[1] :].max())
        share /= share.sum()
        if share[0] > 0.5:
            return None
        fingers = 1 + int(share[1:].argmax())
        return ContactEstimate(
            *(x, y, place),
            *(max(0.0, depth_mm), depth),
            *(fingers, float(share[fingers])),
            *(0.0 if fingers == 1 else angle_deg, angle),
            *(rise_mm, rise),
        )

    def arrays(self) -> dict[str, Matrix]:
        """Return the arrays by name."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


class ContactTracker:
    """History of the present touch, from which the network's inputs are made."""

    def __init__(self, rows: int, columns: int, rate_hz: float) -> None:
        """Begin untouched, with images of (rows, columns)."""
        self._shape, self._rate_hz = (rows, columns), rate_hz
        row, column = np.indices(self._shape)
        self._taxels = (column + 1j * (rows - 1 - row)).ravel()
        self._before: deque[Change] = deque(maxlen=max(2, round(_BEFORE_S * rate_hz)))
        self._begin = tuple(round(at * rate_hz) for at in _BEGIN_S)
        self._age = 0  # images of the touch; 0: none
        self._still = 0  # untouched images in a row, during a touch
        self._peak = self._least = 0.0  # strength of the touch, and the least since that
        self._ever = np.zeros(self._shape)  # average over touches and pauses
        self._left, self._fast, self._slow, self._first = np.zeros((4, rows, columns))

    def inputs(self, image: Image, idle: float, *, quiet: bool) -> Matrix | None:
        """Return the network's inputs for the next image, (inputs,); None while nothing touches.

        They are the image, its two averages and the touch's beginning, each by its strength; the
        logarithm of the strength, the noise by the strength, the touch's age, and by what the
        harmonics around its middle have turned.

        Args:
            image: z, (rows, columns).
            idle: Mean of |z - 1| while nothing touches.
            quiet: Nothing touches in this image.
        """
        signal = image.astype(np.float64) - 1.0
        quiet = quiet and self._silent(signal, idle)
        self._still = self._still + 1 if quiet else 0
        if self._age == 0 or self._still > _GRACE:
            if self._age:
                self._restart()
            if quiet:
                self._before.append(signal)
                return None
            if len(self._before) > 1:
                self._left = self._remains(np.mean(self._before, axis=0), idle)
        signal = signal - self._left
        if self._lands(signal):
            self._age = 0
        self._age += 1
        for average, over_s in ((self._fast, _FAST_S), (self._slow, SLOW_S)):
            average += (signal - average) * self.newest(over_s)
        begin, end = self._begin
        if self._age <= max(1, begin):
            self._first = signal
        elif self._age <= max(begin + 1, end):
            self._first = self._first + (signal - self._first) / (self._age - begin)
        return self._features(signal, idle)

    def newest(self, over_s: float) -> float:
        """Return the newest image's share of an average over the touch, with a time constant."""
        return max(1.0 / self._age, 1.0 / (over_s * self._rate_hz + 1))

    def _remains(self, mean: Change, idle: float) -> Change:
        """Return what a mean of untouched signals, (rows, columns), shows beyond their noise."""
        power = float(np.square(mean).sum())
        noise = mean.size * 0.5 * math.pi * idle**2 / len(self._before)
        return mean * max(0.0, 1.0 - noise / (power + _TINY))

    def _silent(self, signal: Change, idle: float) -> bool:
        """Whether the average of signals, (rows, columns), is no more than noise and drift.

        A single image of a noisy sensor hides a touch that the average shows.
        """
        newest = 1.0 / (_FAST_S * self._rate_hz + 1)
        self._ever += (signal - self._ever) * newest
        noise = newest / (2.0 - newest) * 0.5 * math.pi * idle**2
        return float(np.square(self._ever).mean()) <= _CLEAR * noise + _DRIFT**2

    def _lands(self, signal: Change) -> bool:
        """Whether a touch begins, or begins again, with a signal, (rows, columns).

        It does while it grows to more than `_GROWN` of how it began, soon or from nearly nothing,
        and where it rises after it had fallen: soon after a touch the sensor is not at rest when
        the next one lands. A touch that deepens later is the same.
        """
        strength = math.sqrt(float(np.square(0.5 * (self._fast + signal)).mean()))
        if self._age == 0:
            self._peak = self._least = strength
            return True
        begin = math.sqrt(float(np.square(self._first).mean()))
        if strength > self._peak:
            self._peak = self._least = strength
        self._least = min(self._least, strength)
        risen = self._least < _FALLEN * self._peak and strength > _RISEN * self._least
        grows = self._age <= _GROWS_S * self._rate_hz or begin < _FAINT
        if not risen and not (grows and strength > _GROWN * (begin + _LEAST)):
            return False
        self._peak = self._least = strength
        return True

    def beginning(self, course: Array) -> float | None:
        """Return the mean of a course, (n,), over the touch's beginning; None once that is over."""
        begin, end = self._begin
        if self._age > max(begin + 1, end):
            return None
        return float(course[-max(1, self._age - begin) :].mean())

    def _restart(self) -> None:
        """Begin another touch with the next image."""
        self._age = self._still = 0
        self._before.clear()
        self._left, self._fast, self._slow, self._first = np.zeros((4, *self._shape))

    def _features(self, signal: Change, idle: float) -> Matrix:
        """Return the inputs for the newest signal, (rows, columns)."""
        strength = math.sqrt(float(np.square(self._fast).mean())) + _LEAST
        begin = math.sqrt(float(np.square(self._first).mean())) + _LEAST
        parts = (signal / strength, self._fast / strength, self._slow / strength)
        age = min(1.0, self._age / (_AGE_S * self._rate_hz))
        rest = (math.log(strength / 0.05), min(idle / strength, 2.0), age)
        flat = [part.ravel() for part in (*parts, self._first / begin)]
        turned = self._harmonics(flat[0]) * self._harmonics(flat[3]).conj()
        turned /= np.sqrt(np.abs(turned) + _TINY)
        return np.concatenate([*flat, rest, turned.real, turned.imag]).astype(np.float32)

    def _harmonics(self, picture: Change) -> Complex:
        """Return how a picture, (taxels,), lies around its middle: harmonics, (6,), complex."""
        weight = np.maximum(np.median(picture) - picture, 0.0) + _TINY
        weight /= weight.sum()
        away = self._taxels - weight @ self._taxels
        distance = np.abs(away) + _TINY
        found = []
        for exponent in _REACH:
            share = weight * distance**exponent
            share /= share.sum()
            found += [share @ (away / distance) ** order for order in _HARMONICS]
        return np.array(found)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        before = np.array(self._before) if self._before else np.empty((0, *self._shape))
        averages = np.array([self._left, self._fast, self._slow, self._first, self._ever])
        return {
            "before": before,
            "averages": averages,
            "age": np.array([self._age, self._still, self._peak, self._least], dtype=np.float64),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._before.clear()
        self._before.extend(state["before"])
        averages = state["averages"].copy()
        self._left, self._fast, self._slow, self._first, self._ever = averages
        self._age, self._still = int(state["age"][0]), int(state["age"][1])
        self._peak, self._least = state["age"][2:].tolist()
