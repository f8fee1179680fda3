"""A drum of 3 x 4 pads that rests at zero, and taps itself once a second, pad after pad."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orbtouch.plugins import Geometry, Sensor, SensorError, SensorOptions, Signal


@dataclass(frozen=True)
class Options(SensorOptions):
    """Options of the drum: --sensor drum:strength=300."""

    strength: float = 200.0


def create(options: Options, rate_hz: float | None = None) -> "Drum":
    """Return the drum, at a rate or its own; SensorError if it cannot be read."""
    if options.strength <= 0.0:
        raise SensorError(f"strength = {options.strength:g} must be above 0")
    return Drum(options.strength, rate_hz or 20.0)


class Drum(Sensor):
    """The pads: counts of 0 at rest, up to the strength under a tap."""

    hardware = "drum"
    signal = Signal(unit="counts", sign=1)  # a touch raises the readings

    def __init__(self, strength: float, rate_hz: float) -> None:
        """Open what has to be opened."""
        self.geometry = Geometry(rows=3, columns=4, pitch_mm=25.0)
        self.rate_hz, self.device_id = rate_hz, "drum-1"
        self._strength = strength

    def read(self, t_s: float) -> NDArray[np.float32]:
        """Return the scan that ends at `t_s`, (3, 4), counts."""
        second, phase = divmod(t_s, 1.0)
        frame = np.zeros((3, 4), dtype=np.float32)
        if second >= 6.0 and phase < 0.5:
            frame.flat[int(second) % 12] = self._strength
        return frame
