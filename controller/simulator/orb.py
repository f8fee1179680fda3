"""An orb: mechanics and electronics joined, finger paths in and frames out."""

from dataclasses import dataclass, field, replace
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Array, Complex
from controller.shared.errors import UserError
from controller.simulator.dome.electronics import Electronics, ElectronicsModel
from controller.simulator.dome.mechanics import Mechanics, MechanicsModel
from controller.simulator.hand.performance import MECHANICS_HZ, SLOTS


@dataclass(frozen=True, slots=True)
class OrbModel:
    """Everything about an orb that is not drawn at random: paper, section 3.1."""

    rows: int = 5  # taxel rows
    columns: int = 5  # taxel columns
    pitch_mm: float = 10.0  # distance of two taxels
    mechanics: MechanicsModel = field(default_factory=MechanicsModel)  # the dome
    electronics: ElectronicsModel = field(default_factory=ElectronicsModel)  # taxels and circuit


NOMINAL: Final = OrbModel()
_CIRCUIT: Final = NOMINAL.electronics

# `paper-snr` is as noisy as the paper's own figures say: taxels drift and readings scatter so much
# that the histogram statistics of section 6 come out as printed (H(z) = 2.71 and I(z, y) = 0.13,
# read as nats: docs/paper.md, section 6). The match is not unique.
PRESETS: Final[dict[str, OrbModel]] = {
    "nominal": NOMINAL,
    "paper-snr": replace(
        NOMINAL,
        electronics=replace(
            _CIRCUIT,
            taxel_drift=(0.03, 120.0),
            readout=replace(_CIRCUIT.readout, noise_lsb=48.0),
        ),
    ),
}


# Constants of the contact model that no measurement fixes: coupling, bulge, width of a contact.
_VARIED: Final = ("bulge", "permittivity_drop", "stick", "spread", "wrap", "reach")
_FACTOR: Final = 1.18  # greatest of them, and of what the apex stretches beyond 1
_FRICTION: Final = (0.25, 1.0)  # mm of drag per mm of depth
_MEMORY: Final = (0.6, 1.6)  # factor of both shares of the rubber's memory


def vary(model: OrbModel, rng: np.random.Generator) -> OrbModel:
    """Return an orb of the same electronics and another physics, drawn within stated limits."""

    def factor() -> float:
        return float(_FACTOR ** rng.uniform(-1.0, 1.0))

    mechanics = model.mechanics
    contact = {name: factor() * getattr(mechanics.contact, name) for name in _VARIED}
    friction, much = float(rng.uniform(*_FRICTION)), float(rng.uniform(*_MEMORY))
    varied = replace(
        mechanics,
        apex_stretch=1.0 + factor() * (mechanics.apex_stretch - 1.0),
        contact=replace(mechanics.contact, **contact),
        friction=(friction, friction),
        memory=tuple((much * share, tau_s) for share, tau_s in mechanics.memory),
    )
    return replace(model, mechanics=varied)


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


class PresetError(UserError, ValueError):
    """There is no such preset; the message is one sentence."""


def preset(name: str) -> OrbModel:
    """Return the orb of that name.

    Raises:
        PresetError: There is none.
    """
    if name not in PRESETS:
        raise PresetError(f"there is no preset {name!r}; there are {', '.join(PRESETS)}")
    return PRESETS[name]
