"""Scale of sensors that are not divided by rest: from the noise first, then from the touches."""

from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.frames import PreprocessSettings
from controller.shared.aliases import State

PICOFARAD: Final = "pF"
SIGNS: Final = {"falls": -1, "rises": 1}  # what a touch does to the readings
# Mean |z - 1| of a firm touch of the orb, measured on simulated presses. Other sensors are scaled
# to it: the gate and the networks' first layer are made for it.
FIRM: Final = 0.08
_FIRM_SHARE: Final = 0.5  # quantile of the touched frames that counts as firm
_GATE: Final = 1 / 3  # of the orb's gate, which allows for the hysteresis of its rubber
_NOISE: Final = 0.0025  # mean |z - 1| of noise, until there is a touch
_LEARN_S: Final = 6.0  # of touched frames that decide
_LIGHT: Final = 0.3  # of the strongest touch; anything below is not counted
_TINY: Final = 1e-6  # least scale, and least share of the readings


@dataclass(frozen=True, slots=True)
class Signal:
    """What a sensor's readings are.

    Attributes:
        unit: Unit of the readings; "pF" is capacitance.
        sign: -1: a touch lowers the readings, as on the orb; 1: it raises them.
        scale: Mean change by a firm touch over `FIRM`, in the unit; 0: unknown, to be learned.
        learned: The same, learned from touches in an earlier session; 0: none.
    """

    unit: str = PICOFARAD
    sign: int = -1
    scale: float = 0.0
    learned: float = 0.0

    @property
    def ratio(self) -> bool:
        """Whether frames are divided by rest; else rest, which may be zero, is subtracted."""
        return self.unit == PICOFARAD and self.sign < 0

    def fit(self, settings: PreprocessSettings) -> PreprocessSettings:
        """Return the settings for such a sensor; those trained on differences fit already.

        A touch then lowers z, by as much as on the orb, whatever the sign and the unit.
        """
        if self.ratio or settings.normalise == "difference":
            return settings
        scale, gate = -self.sign * (self.scale or 1.0), _GATE * settings.gate
        return replace(settings, normalise="difference", scale=scale, gate=gate)


SKIN: Final = Signal()  # of the orb


class ScaleEstimator:
    """The scale of a sensor, learned frame by frame.

    Attributes:
        scale: Divisor of the difference from rest, in the sensor's unit, above zero.
    """

    def __init__(self, rate_hz: float, shape: tuple[int, int], learned: float = 0.0) -> None:
        """Begin before the first frame of a sensor of (rows, columns), or with its scale."""
        self.scale = learned or _TINY
        self._steps: list[float] = []  # change from frame to frame before the first baseline
        self._last = np.empty((0, *shape))  # the latest frame, (0 or 1, rows, columns)
        frames = max(1, round(_LEARN_S * rate_hz))
        self._energies = deque([FIRM * learned] * (frames if learned else 0), maxlen=frames)

    @property
    def learned(self) -> float:
        """The scale once it is fixed; 0 before."""
        return self.scale if len(self._energies) == self._energies.maxlen else 0.0

    def begin(self, values: NDArray[np.float64]) -> float:
        """Take a frame, (rows, columns), before there is a baseline; return the scale.

        A scale that was learned from touches stays.
        """
        if self._energies:
            return self.scale
        if len(self._last):
            self._steps.append(float(np.abs(values - self._last).mean()) / np.sqrt(2.0))
        self._last = values[None].copy()
        noise = float(np.median(self._steps)) if self._steps else 0.0
        least = _TINY * max(1.0, float(np.abs(values).max()))
        self.scale = max(noise / _NOISE, least)
        return self.scale

    def learn(self, deviation: float) -> float:
        """Take mean |z - 1| of a touched frame; return the scale, fixed after `_LEARN_S`."""
        if not self.learned:
            self._energies.append(deviation * self.scale)
            found = np.array(self._energies)
            firm = np.quantile(found[found >= _LIGHT * found.max()], _FIRM_SHARE)
            self.scale = max(float(firm) / FIRM, _TINY)
        return self.scale

    def state(self) -> State:
        """Return everything remembered, for an exact continuation."""
        return {
            "scale": np.array([self.scale]),
            "energies": np.array(self._energies).reshape(-1, 1),
            "steps": np.array(self._steps).reshape(-1, 1),
            "last": self._last.copy(),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken, or raise ValueError."""
        if not _TINY <= state["scale"][0] < np.inf:
            raise ValueError("the state has a scale that is not above zero")
        self.scale = float(state["scale"][0])
        self._energies.clear()
        self._energies.extend(state["energies"].ravel().tolist())
        self._steps = state["steps"].ravel().tolist()
        self._last = state["last"].copy()
