"""From finger paths to stretched capacitors: grip, contact, bulge, and the rubber's memory."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Array, Complex
from controller.simulator.dome.contact import ContactModel, Fingers, Skin
from controller.simulator.dome.lowpass import Lowpass
from controller.simulator.dome.membrane import APEX_STRETCH, inflate

_STICK_MM: Final = 4.0  # no skin is dragged farther
_NO_RELIEF: Final = 1e-4  # of the radius; moves no taxel by more than 0.05 %
_CHUNK: Final = 2048  # steps evaluated at once; bounds memory


@dataclass(frozen=True, slots=True)
class MechanicsModel:
    """Constants of the dome's material."""

    apex_stretch: float = APEX_STRETCH  # stretch of the inflated apex
    contact: ContactModel = field(default_factory=ContactModel)  # contact mechanics
    friction: tuple[float, float] = (0.4, 0.8)  # least, greatest mm of drag per mm of depth
    memory: tuple[tuple[float, float], ...] = ((0.05, 0.25), (0.04, 3.0))  # of ln C: shares, s
    bulge_s: float = 3.0  # how fast the pump's regulator takes the bulge away


class Mechanics:
    """The membrane under fingers, step by step; many or few steps at a time, the same result."""

    def __init__(
        self,
        model: MechanicsModel,
        grid: tuple[int, int],
        pitch_mm: float,
        step_s: float,
        slots: int,
        friction: float,
    ) -> None:
        """Inflate the dome, whose friction is so many mm of drag per mm of depth."""
        self._model, self._step_s, self._friction = model, step_s, friction
        self._skin = Skin(inflate(model.apex_stretch), *grid, pitch_mm, model.contact)
        self._anchor = np.zeros(slots, dtype=np.complex128)
        self._touching = np.zeros(slots, dtype=bool)
        keep = np.exp(-step_s / model.bulge_s)
        self._gain = (1.0 - keep) * model.contact.regulated
        self._relief = Lowpass(keep, np.zeros(()))
        share, tau_s = np.array(model.memory).reshape(-1, 2).T[:, :, None]
        decay = np.exp(-step_s / tau_s)
        self._share = (1.0 - decay) * share
        self._memory = Lowpass(decay, np.zeros((len(model.memory), self._skin.taxels)))

    def advance(self, point: Complex, depth_mm: Array, radius_mm: Array) -> tuple[Array, Complex]:
        """Return ln(C / C0) at each step, (steps, taxels), and where the fingers hold the skin.

        Hand points, indentations and radii are (steps, slots), points complex mm from the centre.
        """
        position, drag = self._stick(point, depth_mm)
        log_c = np.empty((len(point), self._skin.taxels))
        for start in range(0, len(point), _CHUNK):
            of = slice(start, start + _CHUNK)
            z, wide = position[of] / self._skin.radius_mm, np.maximum(radius_mm[of], 1.0)
            log_c[of] = self._remember(self._stretch(Fingers(z, depth_mm[of], wide, drag[of])))
        return log_c, position

    def _stick(self, point: Complex, depth_mm: Array) -> tuple[Complex, Complex]:
        """Return positions and drags of the skin, (steps, slots), by Prandtl stick-slip."""
        touching: NDArray[np.bool_] = depth_mm > 0.0
        landing = touching & ~np.concatenate([self._touching[None], touching[:-1]])
        self._touching = touching[-1].copy()
        limit_mm = np.minimum(self._friction * depth_mm, _STICK_MM)
        held = np.zeros_like(point)
        for slot in np.flatnonzero(touching.any(axis=0)):
            on = touching[:, slot]
            anchor, pulls = complex(self._anchor[slot]), []
            path = (values[on, slot].tolist() for values in (point, landing, limit_mm))
            for here, lands, limit in zip(*path, strict=True):
                pull = 0j if lands else here - anchor
                length = abs(pull)
                if length > limit:
                    pull *= limit / length
                anchor = here - pull
                pulls.append(pull)
            held[on, slot], self._anchor[slot] = pulls, anchor
        return np.where(touching, point - held, 0.0), held

    def _stretch(self, fingers: Fingers) -> Array:
        """Return ln(C / C0) at each step, (steps, taxels), before memory."""
        grips = self._skin.grips(fingers)
        free = np.zeros(len(fingers.position))
        for grip in grips:
            free[grip.steps] = self._skin.free_bulge(grip)
        relief = self._relief.advance(self._gain * free)
        out = np.zeros((len(free), self._skin.taxels))
        for grip in grips:
            if not len(grip.depth):
                grip = grip.part(relief[grip.steps] > _NO_RELIEF)
            if len(grip.steps):
                out[grip.steps] = self._skin.log_capacitance(grip, relief[grip.steps])
        return out

    def _remember(self, log_c: Array) -> Array:
        """Add the memory, (steps, taxels): x_v = (x + sum g LP x) / (1 + sum g)."""
        levels = self._memory.advance(self._share * log_c[:, None])
        total = 1.0 + sum(share for share, _ in self._model.memory)
        return np.asarray((log_c + levels.sum(axis=1)) / total)
