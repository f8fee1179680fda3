"""Fingertips of any radius that move over the dome, slip on it, and lift again.

The skin under a fingertip follows it without local slip. The fingertip slips as a whole when its
total shear force exceeds a limit. Two laws give the limit:

- Coulomb's: a share of the force that presses;
- adhesion: a constant strength times the area of contact, whatever the pressure, as of soft and
  sticky surfaces.

Nothing pulls the skin outward: a point that leaves a fingertip is free. Fingertips do not spin.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import interpolate

from controller.shared.aliases import Array, Complex, Index, Mask

from . import material
from .dome import Dome, State

_LEAST_MOVE: Final = 0.02  # radii; no step of a path is divided below it
_STEP_MM: Final = 2.5  # at most, of a finger in one solution
_YIELD: Final = 4.0  # slip by excess of shear: the skin follows, so that the shear hardly falls
_TINY: Final = 1e-12


@dataclass(frozen=True)
class Friction:
    """Law of the greatest shear force between skin and fingertip."""

    coefficient: float = 0.0  # of Coulomb's law: shear by pressing force
    strength_pa: float = 0.0  # of adhesion

    def limit(self, pressed: float, area: float) -> float:
        """Return the limit for a pressing force and an area; forces are displacement times area."""
        constant = self.strength_pa / material.UNIT_PA / material.PULP
        return constant * area + self.coefficient * pressed


class RubbedDome(Dome):
    """A dome on which fingers slide; they touch the middles of triangles' edges."""

    tolerance, iterations = 1e-5, 16

    def __init__(self, rings: int, volume: float, connected: float) -> None:
        """Inflate the dome to a volume, R^3, connected with another."""
        self._radius, self._friction = np.zeros(0), Friction()
        super().__init__(rings, volume, connected)
        pairs = self.mesh.triangle[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        edge, which = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
        area = np.bincount(which.ravel(), np.repeat(self.mesh.area / 3, 3))
        inner = self.mesh.free[edge].any(axis=1)
        self._edge: Index = edge[inner]
        self._share = area[inner]
        self._profile = self._meridian(rings)

    def surface(self, point_mm: Complex) -> tuple[Array, Array]:
        """Return places and outward normals at material points, complex mm, (fingers, 3) each."""
        flat = point_mm / material.RADIUS_MM
        distance = np.abs(flat)
        ray = np.where(distance > 1e-9, flat / np.maximum(distance, 1e-9), 1.0)
        (lean, rise), (out, up) = (
            [part(distance, order) for part in self._profile] for order in (0, 1)
        )
        length = np.hypot(out, up)
        place, normal = (
            np.stack([across * ray.real, across * ray.imag, along], axis=1)
            for across, along in ((lean, rise), (-up / length, out / length))
        )
        return place, normal

    def rub(
        self, point_mm: Complex, travel_mm: Array, radius_mm: Array, friction: Friction
    ) -> Array:
        """Move fingertips along a path from rest; return ln C / C0 of every taxel, (steps, 25).

        Args:
            point_mm: Material points that they aim at, complex, (steps, fingers).
            travel_mm: How far each is moved inward there, 0 where it does not touch, same shape.
            radius_mm: Their radii, (fingers,).
            friction: Its law.

        Raises:
            ArithmeticError: No equilibrium was found.
        """
        self._radius, self._friction = radius_mm / material.RADIUS_MM, friction
        fingers, points = len(radius_mm), len(self._edge)
        held, grip = np.zeros((fingers, points), dtype=bool), np.zeros((fingers, points, 3))
        state = State(self.rest.x, self.rest.pressure, held, grip)
        log_c, before = [], None
        for at, travel in zip(point_mm, travel_mm, strict=True):
            place, normal = self.surface(at)
            centre = place + normal * (self._radius - travel / material.RADIUS_MM)[:, None]
            start = centre if before is None else before
            far = np.linalg.norm(centre - start, axis=1).max() * material.RADIUS_MM
            parts = int(far / _STEP_MM) + 1
            for part in range(parts):
                ways = [start + (centre - start) * ((part + i) / parts) for i in (0, 1)]
                state = self._follow(state, *ways)
            before = centre
            log_c.append(self.log_capacitance(state.x))
        return np.array(log_c)

    def _meridian(self, rings: int) -> list[interpolate.CubicSpline]:
        """Return the resting dome's radius and height over the distance on the flat disc."""
        ring = np.rint(np.linalg.norm(self.mesh.node, axis=1) * rings).astype(int)
        lean = np.linalg.norm(self.rest.x[:, :2], axis=1)
        radius, height = (
            np.bincount(ring, values) / np.bincount(ring) for values in (lean, self.rest.x[:, 2])
        )
        distance = np.arange(-rings, rings + 1) / rings
        return [
            interpolate.CubicSpline(distance, np.concatenate([sign * half[:0:-1], half]))
            for sign, half in ((-1.0, radius), (1.0, height))
        ]

    def _arms(self, x: Array, centre: Array) -> Array:
        """Return the points that fingers may touch, from each finger's centre."""
        return np.asarray(x[self._edge].mean(axis=1) - centre[:, None])

    def _follow(self, state: State, before: Array, centre: Array) -> State:
        """Move the fingers, in smaller steps where Newton loses its way; skin slips or is freed."""
        try:
            settled = self._settle(state, centre)
        except ArithmeticError:
            if np.abs(centre - before).max() < _LEAST_MOVE:
                raise
            middle = (before + centre) / 2
            return self._follow(self._follow(state, before, middle), middle, centre)
        held, grip = settled.held.copy(), self._slip(settled, centre)
        above, below = self._arms(state.x, before), self._arms(settled.x, centre)
        for k, radius in enumerate(self._radius):
            pressed = (below[k] ** 2).sum(axis=1) < radius**2
            new = pressed & ~held.any(axis=0)
            grip[k, new] = _first(above[k, new], below[k, new], radius)
            held[k] = (held[k] & pressed) | new
        return State(settled.x, settled.pressure, held, grip)

    def _slip(self, state: State, centre: Array) -> Array:
        """Return the grips after fingers whose shear exceeds the limit have slipped."""
        grip = state.grip.copy()
        arms = self._arms(state.x, centre)
        for k, (arm, radius) in enumerate(zip(arms, self._radius, strict=True)):
            on = state.held[k] & ((arm**2).sum(axis=1) < radius**2)
            contact, share = _Contact.of(arm[on], grip[k, on], radius), self._share[on]
            area, shear = float(share.sum()), share @ contact.shear
            size = float(np.linalg.norm(shear))
            excess = size - self._friction.limit(-float(share @ contact.gap), area)
            if excess > 0.0 and size > 0.0:
                moved = grip[k, on] + _YIELD * excess / area * shear / size
                grip[k, on] = moved * radius / np.linalg.norm(moved, axis=1, keepdims=True)
        return grip

    def _push(self, x: Array, state: State, centre: Array) -> tuple[Array, Index, Index, Array]:
        """Return the force of the fingers, (nodes * 3,), and rows, columns, values of stiffness."""
        force, ends, blocks = np.zeros_like(x), [], []
        near = ~state.held.any(axis=0)
        for k, arm in enumerate(self._arms(x, centre)):
            within = (arm**2).sum(axis=1) < self._radius[k] ** 2
            on = np.flatnonzero(within & (near | state.held[k]))
            contact = _Contact.of(arm[on], state.grip[k, on], self._radius[k])
            push, rise = contact.push(state.held[k, on])
            spring = 0.5 * material.PULP * self._share[on]  # half to each end of the edge
            for end in self._edge[on].T:
                np.add.at(force, end, spring[:, None] * push)
            ends.append(self._edge[on])
            blocks.append(0.5 * spring[:, None, None] * rise)
        dofs = 3 * np.concatenate(ends)[:, :, None] + np.arange(3)  # (points, end, axis)
        shape = (len(dofs), 2, 3, 2, 3)
        rows = np.broadcast_to(dofs[:, :, :, None, None], shape)
        columns = np.broadcast_to(dofs[:, None, None], shape)
        values = np.broadcast_to(np.concatenate(blocks)[:, None, :, None], shape)
        return force.ravel(), rows.ravel(), columns.ravel(), values.ravel()


@dataclass(frozen=True)
class _Contact:
    """Points under a fingertip; lengths in radii.

    Attributes:
        normal: Direction from the fingertip's centre, (points, 3).
        gap: Distance from its surface, below zero where it is pressed in, (points,).
        length: The same from its centre, (points,).
        shear: How far each is sheared against the fingertip, (points, 3).
        slope: Its derivative by the point, (points, 3, 3).
    """

    normal: Array
    length: Array
    gap: Array
    shear: Array
    slope: Array

    @classmethod
    def of(cls, arm: Array, grip: Array, radius: float) -> "_Contact":
        """Return the contact of points whose grips are where they were touched, from the centre."""
        length = np.linalg.norm(arm, axis=1)
        normal, gap = arm / length[:, None], length - radius
        along = (normal * grip).sum(axis=1)
        shear = along[:, None] * normal - grip
        plane = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        slope = along[:, None, None] * plane - normal[:, :, None] * shear[:, None, :]
        slope /= length[:, None, None]
        return cls(normal, length, gap, shear, slope)

    def push(self, held: Mask) -> tuple[Array, Array]:
        """Return displacements of springs, (points, 3), and slopes; only held points have shear."""
        radial = self.normal[:, :, None] * self.normal[:, None, :]
        rise = radial + (self.gap / self.length)[:, None, None] * (np.eye(3) - radial)
        push = self.gap[:, None] * self.normal
        return push + held[:, None] * self.shear, rise + held[:, None, None] * self.slope


def _first(before: Array, after: Array, radius: float) -> Array:
    """Return where a fingertip touched points first on their way, (points, 3)."""
    above, below = (np.linalg.norm(arm, axis=1) - radius for arm in (before, after))
    when = np.clip(above / np.maximum(above - below, _TINY), 0.0, 1.0)[:, None]
    first = before + when * (after - before)
    return np.asarray(first * radius / np.linalg.norm(first, axis=1, keepdims=True))
