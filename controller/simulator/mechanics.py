"""From finger paths to stretched capacitors: grip, contact, bulge, and the rubber's memory."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.simulator.contact import ContactModel, Fingers, Skin
from controller.simulator.membrane import APEX_STRETCH, RADIUS_MM, inflate

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_STICK_MM: Final = 4.0  # no skin is dragged farther
_NO_RELIEF: Final = 1e-4  # of the radius; moves no taxel by more than 0.05 %
_CHUNK: Final = 512  # steps evaluated at once; bounds memory


@dataclass(frozen=True, slots=True)
class MechanicsModel:
    """What the dome is made of.

    Attributes:
        apex_stretch: Stretch of the inflated apex.
        contact: Contact mechanics.
        friction: Least and greatest mm of drag per mm of depth before a finger slips.
        memory: (share, time constant in s) of the rubber's viscoelastic memory of ln C.
        bulge_s: How fast the pump's regulator takes the bulge away.
    """

    apex_stretch: float = APEX_STRETCH
    contact: ContactModel = field(default_factory=ContactModel)
    friction: tuple[float, float] = (0.4, 0.8)
    memory: tuple[tuple[float, float], ...] = ((0.05, 0.25), (0.04, 3.0))
    bulge_s: float = 3.0


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
        """Inflate the dome.

        Args:
            model: Its constants.
            grid: Rows and columns of taxels.
            pitch_mm: Distance of two taxels.
            step_s: Time of one step.
            slots: Fingers at once.
            friction: Of this dome: mm of drag per mm of depth.
        """
        self._model, self._step_s, self._friction = model, step_s, friction
        self._skin = Skin(inflate(model.apex_stretch), *grid, pitch_mm, model.contact)
        self._anchor = np.zeros(slots, dtype=np.complex128)
        self._touching = np.zeros(slots, dtype=bool)
        self._relief = 0.0
        self._memory = np.zeros((len(model.memory), self._skin.taxels))

    def advance(self, point: Complex, depth_mm: Array, radius_mm: Array) -> tuple[Array, Complex]:
        """Return ln(C / C0) at each step, (steps, taxels), and where the fingers hold the skin.

        Args:
            point: Hand points, complex mm from the centre, (steps, slots).
            depth_mm: Indentations, same shape.
            radius_mm: Finger radii, same shape.
        """
        position, drag = self._stick(point, depth_mm)
        log_c = np.empty((len(point), self._skin.taxels))
        for start in range(0, len(point), _CHUNK):
            part = slice(start, start + _CHUNK)
            log_c[part] = self._stretch(position[part], depth_mm[part], radius_mm[part], drag[part])
        self._remember(log_c)
        return log_c, position

    def _stick(self, point: Complex, depth_mm: Array) -> tuple[Complex, Complex]:
        """Prandtl stick-slip: the skin follows a finger until friction gives way."""
        touching: NDArray[np.bool_] = depth_mm > 0.0
        before = np.concatenate([self._touching[None], touching[:-1]])
        landing: NDArray[np.bool_] = touching & ~before
        self._touching = touching[-1]
        position = np.zeros_like(point)
        drag = np.zeros_like(point)
        for i in np.flatnonzero(touching.any(axis=1)):
            self._anchor = np.where(landing[i], point[i], self._anchor)
            pull = point[i] - self._anchor
            limit = np.minimum(self._friction * depth_mm[i], _STICK_MM)
            length = np.abs(pull)
            held = np.where(length > limit, pull * limit / np.maximum(length, 1e-9), pull)
            self._anchor = np.where(touching[i], point[i] - held, self._anchor)
            position[i] = np.where(touching[i], self._anchor, 0.0)
            drag[i] = np.where(touching[i], held, 0.0)
        return position, drag

    def _stretch(self, position: Complex, depth: Array, radius: Array, drag: Complex) -> Array:
        """Return ln(C / C0) at each step, (steps, taxels), before memory."""
        out = np.zeros((len(position), self._skin.taxels))
        used: NDArray[np.bool_] = np.any(depth > 0.0, axis=0)
        used[0] = True
        z, depth, drag = position[:, used] / RADIUS_MM, depth[:, used], drag[:, used]
        radius = np.maximum(radius[:, used], 1.0)
        relief = self._relieve(z, depth, radius)
        active = (depth > 0.0).any(axis=1) | (relief > _NO_RELIEF)
        if active.any():
            fingers = Fingers(z[active], depth[active], radius[active], drag[active])
            out[active] = self._skin.log_capacitance(fingers, relief[active])[0]
        return out

    def _relieve(self, z: Complex, depth: Array, radius: Array) -> Array:
        """Return how much of the bulge the pump's regulator has taken away, radii, (steps,)."""
        free = np.zeros(len(z))
        pressed = (depth > 0.0).any(axis=1)
        if pressed.any():
            free[pressed] = self._skin.free_bulge(z[pressed], depth[pressed], radius[pressed])
        decay = np.exp(-self._step_s / self._model.bulge_s)
        gain = (1.0 - decay) * self._model.contact.regulated
        relief = np.empty(len(z))
        for i, bulge in enumerate(free):
            self._relief = decay * self._relief + gain * bulge
            relief[i] = self._relief
        return relief

    def _remember(self, log_c: Array) -> None:
        """Apply the rubber's memory in place: x_v = (x + sum g LP x) / (1 + sum g)."""
        total = 1.0 + sum(share for share, _ in self._model.memory)
        plain = log_c.copy()
        for m, (share, tau_s) in enumerate(self._model.memory):
            decay = np.exp(-self._step_s / tau_s)
            level = self._memory[m]
            for i in range(len(log_c)):
                level = decay * level + (1.0 - decay) * plain[i]
                log_c[i] += share * level
            self._memory[m] = level
        log_c /= total
