"""An orb: mechanics and electronics joined, finger paths in and frames out."""

from dataclasses import dataclass, field
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.simulator.electronics import Electronics, ElectronicsModel
from controller.simulator.hand import MECHANICS_HZ, SLOTS
from controller.simulator.mechanics import Mechanics, MechanicsModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class OrbModel:
    """Everything about an orb that is not drawn at random: paper, section 3.1."""

    rows: int = 5  # taxel rows
    columns: int = 5  # taxel columns
    pitch_mm: float = 10.0  # distance of two taxels
    mechanics: MechanicsModel = field(default_factory=MechanicsModel)  # the dome
    electronics: ElectronicsModel = field(default_factory=ElectronicsModel)  # taxels and circuit


NOMINAL: Final = OrbModel()


class OrbSimulator:
    """Finger paths in, frames out; the same orb and the same noise for the same seed."""

    def __init__(
        self,
        seed: np.random.SeedSequence,
        rate_hz: float = 10.0,
        slots: int = SLOTS,
        model: OrbModel = NOMINAL,
        day: int = 0,
    ) -> None:
        """Build an orb for so many fingers at once; each day has other drift and noise."""
        self.model = model
        self.steps_per_frame = ceil(MECHANICS_HZ / rate_hz - 1e-9)
        self.step_s = 1.0 / (rate_hz * self.steps_per_frame)
        grid, pitch_mm = (model.rows, model.columns), model.pitch_mm
        circuit, surface = seed.spawn(2)
        friction = float(np.random.default_rng(surface).uniform(*model.mechanics.friction))
        self._mechanics = Mechanics(model.mechanics, grid, pitch_mm, self.step_s, slots, friction)
        self.electronics = Electronics(
            model.electronics, grid, pitch_mm, rate_hz, self.steps_per_frame, slots, circuit, day
        )

    def advance(self, point: Complex, depth_mm: Array, radius_mm: Array) -> NDArray[np.float32]:
        """Simulate on and return the frames that were completed, (frames, rows, columns), pF.

        Points, complex mm from the centre, depths and radii: (frames * steps_per_frame, slots).
        """
        log_c, position = self._mechanics.advance(point, depth_mm, radius_mm)
        return self.electronics.scan(log_c, position, depth_mm)
