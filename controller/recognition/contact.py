"""Estimate of the contact in each frame: place, depth, number of fingers, angle, and gesture.

A small recurrent network sees each image and two running means of the images. It says each quantity
with its own deviation. On a quiet sensor the newest image decides, on a noisy one what came before:
the network has learned both from simulated contacts.
"""

import math
from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.frames import Image
from controller.shared.aliases import Change, Complex, State

MOST_FINGERS: Final = 3  # a larger number is not told apart
VALUES: Final = 5  # x, y, depth, angle, rise
SPREADS: Final = (0, 0, 1, 2, 3)  # which of the variances is that of each
OUTPUTS: Final = VALUES + max(SPREADS) + 1 + 1 + MOST_FINGERS  # of the network
PICTURES, SCALARS = 3, 14  # among its inputs
TURNS: Final = 6  # the last of its inputs, which change their sign in a mirror
SLOW_S: Final = 0.2  # time constant of the slower mean
_FAST_S: Final = 0.05  # and of the faster one
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
    """Gated recurrent units, from `ContactTracker.inputs` to quantities and their variances.

    The outputs are `VALUES` quantities, the ln variances of place, depth, angle and rise, the
    logits of no finger, one, two, more, and perhaps those of the first labels. They see the units,
    and a hidden layer with relu before them. The gates stand in the order of PyTorch's `GRU`:
    reset, update, new.
    """

    first: Matrix  # (units, inputs)
    first_bias: Matrix  # (units,)
    gates: Matrix  # of the hidden layer, (3 * units, units)
    gates_bias: Matrix  # (3 * units,)
    memory: Matrix  # of the units before, (3 * units, units)
    memory_bias: Matrix  # (3 * units,)
    out: Matrix  # (OUTPUTS + labels, 2 * units)
    out_bias: Matrix  # (OUTPUTS + labels,)
    scale: Matrix  # mean and deviation of the quantities in training, (2, VALUES)

    @property
    def units(self) -> int:
        """Number of recurrent units."""
        return len(self.first)

    @property
    def labels(self) -> int:
        """How many of the first labels it says."""
        return len(self.out) - OUTPUTS

    def step(self, inputs: Matrix, before: Matrix) -> tuple[Matrix, Matrix]:
        """Return the outputs, (OUTPUTS + labels,), of a frame's inputs, and the units after it.

        Args:
            inputs: (inputs,).
            before: The units, (units,); zeros at first.
        """
        hidden = np.maximum(self.first @ inputs + self.first_bias, 0.0)
        own = (self.gates @ hidden + self.gates_bias).reshape(3, -1)
        kept = (self.memory @ before + self.memory_bias).reshape(3, -1)
        reset, update = 0.5 + 0.5 * np.tanh(0.5 * (own[:2] + kept[:2]))  # a logistic function
        new = np.tanh(own[2] + reset * kept[2])
        units = (new + update * (before - new)).astype(np.float32)
        return self.out @ np.concatenate([units, hidden]) + self.out_bias, units

    def outputs(self, inputs: Matrix) -> Matrix:
        """Return the outputs, (n, outputs), of the inputs of frames in order, (n, inputs)."""
        found, units = [], np.zeros(self.units, dtype=np.float32)
        for row in inputs:
            out, units = self.step(row, units)
            found.append(out)
        return np.array(found, dtype=np.float32).reshape(-1, len(self.out))

    def estimate(self, outputs: Matrix) -> ContactEstimate | None:
        """Return the estimate by the outputs of a frame; None: probably no contact."""
        out = outputs.astype(np.float64)
        mean, deviation = self.scale.astype(np.float64)
        split = VALUES, OUTPUTS - 1 - MOST_FINGERS, OUTPUTS
        x, y, depth_mm, angle_deg, rise_mm = (mean + deviation * out[: split[0]]).tolist()
        spread = np.maximum(np.exp(0.5 * np.minimum(out[slice(*split[:2])], 4.0)), _LEAST_SIGMA)
        place, _, depth, angle, rise = (spread[list(SPREADS)] * deviation).tolist()
        number = out[slice(*split[1:])]
        share = np.exp(number - number.max())
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
    """What came before the newest image: means, and the network's units.

    Attributes:
        labels: Probability of each label that the network says, (labels,), or empty.
    """

    def __init__(self, rows: int, columns: int, rate_hz: float, units: int = 0) -> None:
        """Begin untouched, with images of (rows, columns), for a network of so many units."""
        self._shape = (rows, columns)
        row, column = np.indices(self._shape)
        self._taxels = (column + 1j * (rows - 1 - row)).ravel()
        self._newest = [1.0 / (over_s * rate_hz + 1) for over_s in (_FAST_S, SLOW_S)]
        self._signal, self._fast, self._slow = np.zeros((3, rows, columns))
        self._units = np.zeros(units, dtype=np.float32)
        self.labels = np.zeros(0, dtype=np.float32)

    def step(self, image: Image, idle: float, network: ContactNetwork) -> ContactEstimate | None:
        """Return the network's estimate for the next image; arguments are as in `inputs`."""
        outputs, self._units = network.step(self.inputs(image, idle), self._units)
        shares = np.exp(outputs[OUTPUTS:] - outputs[OUTPUTS:].max(initial=-np.inf))
        self.labels = shares / shares.sum()
        return network.estimate(outputs)

    def inputs(self, image: Image, idle: float) -> Matrix:
        """Return the network's inputs for the next image, (inputs,).

        They are the image and its two means, each by the strength of the faster one; the logarithm
        of that, and the noise by it; and by what the harmonics around the middle have turned from
        the slower mean to the image.

        Args:
            image: z, (rows, columns).
            idle: Mean of |z - 1| while nothing touches.
        """
        self._signal = image.astype(np.float64) - 1.0
        for average, newest in zip((self._fast, self._slow), self._newest, strict=True):
            average += (self._signal - average) * newest
        strength = math.sqrt(float(np.square(self._fast).mean())) + _LEAST
        pictures = [p.ravel() / strength for p in (self._signal, self._fast, self._slow)]
        turned = self._harmonics(pictures[0]) * self._harmonics(pictures[2]).conj()
        turned /= np.sqrt(np.abs(turned) + _TINY)
        rest = (math.log(strength / 0.05), min(idle / strength, 2.0))
        return np.concatenate([*pictures, rest, turned.real, turned.imag]).astype(np.float32)

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
        return {
            "averages": np.array([self._signal, self._fast, self._slow]),
            "units": self._units.astype(np.float64),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._signal, self._fast, self._slow = state["averages"].copy()
        self._units = state["units"].astype(np.float32)
