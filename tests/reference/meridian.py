"""The same dome by its meridian: a finger on the apex, everything axisymmetric.

Two-node elements along the reference radius; the equations are the derivatives of one energy,
and their Jacobian is taken by complex steps, so that nothing is derived twice.
"""

import numpy as np
from numpy.typing import NDArray

from . import material

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_TOLERANCE = 1e-10
_STEP_LIMIT = 0.1  # radii that a node may move in one Newton step


class Meridian:
    """A dome inflated once, then pressed on its apex."""

    def __init__(self, elements: int, volume: float, connected: float = 0.0) -> None:
        """Inflate the dome.

        elements: number of elements; they are finer towards the apex; volume: enclosed volume, R^3;
        connected: volume of hose and reservoir that shares the dome's gas, R^3.
        """
        self.reference = np.linspace(0.0, 1.0, elements + 1) ** 1.3
        self._length = np.diff(self.reference)
        self._middle = self.reference[1:] - 0.5 * self._length
        self._share = np.pi * np.gradient(self.reference**2) / 1.0
        self._share[[0, -1]] /= 2.0
        self._connected, self._gas = connected, 0.0
        r, z = self.reference.copy(), 0.05 * (1.0 - self.reference**2)
        self._held = np.zeros(elements + 1, dtype=bool)
        self._grip = np.zeros((2, elements + 1))
        y = np.concatenate([r[1:-1], z[:-1], [0.5]])  # the axis and the clamp stay
        for part in np.linspace(0.0, volume, max(2, int(volume / 0.2) + 1))[1:]:
            y = self._settle(y, None, float(part))
        self.rest, self.rest_pressure = self._unpack(y[None])[:2].real[:, 0], float(y[-1])
        self._gas = (self.rest_pressure + material.ATMOSPHERE) * (volume + connected)
        self._y = y

    def press(
        self,
        travel_mm: Array,
        radius_mm: float = 7.0,
        stiffness: float = material.PULP,
        sticky: bool = True,
    ) -> tuple[Array, Array, Array]:
        """Press a finger on the apex.

        Returns depth of the skin's apex in mm, (steps,); ln C / C0 of the taxels, (steps, 25);
        pressure, (steps,).
        """
        y, radius = self._y, radius_mm / material.RADIUS_MM
        self._held[:] = False
        arm = self.rest - np.array([[0.0], [self.rest[1, 0] + radius]])
        depth, log_c, pressure = [], [], []
        for travel in travel_mm:
            centre = self.rest[1, 0] + radius - travel / material.RADIUS_MM
            y = self._settle(y, (centre, radius, stiffness))
            r, z = self._unpack(y[None]).real[:, 0]
            before, arm = arm, np.stack([r, z - centre])
            above, below = (np.hypot(*at) - radius for at in (before, arm))
            new = (below < 0.0) & ~self._held & sticky
            when = np.clip(above / np.maximum(above - below, 1e-12), 0.0, 1.0)
            first = before + when * (arm - before)  # where it touched, within the step
            self._grip[:, new] = (first * radius / np.hypot(*first))[:, new]
            self._held |= new
            depth.append((self.rest[1, 0] - z[0]) * material.RADIUS_MM)
            log_c.append(self._log_capacitance(r, z))
            pressure.append(y[-1])
        return np.array(depth), np.array(log_c), np.array(pressure)

    def area_ratio(self, r: Array, z: Array) -> Array:
        """Return deformed over reference area of the elements, (elements,)."""
        along = np.hypot(np.diff(r), np.diff(z)) / self._length
        return np.asarray(along * 0.5 * (r[1:] + r[:-1]) / self._middle)

    def _log_capacitance(self, r: Array, z: Array) -> Array:
        offset = ((np.arange(20) + 0.5) / 20 - 0.5) * 5.0
        x = (np.arange(5) - 2.0)[:, None] * 10.0 + offset
        distance = np.hypot(x[None, :, None, :], x[:, None, :, None]) / material.RADIUS_MM
        charge = []
        for shape in ((r, z), self.rest):
            ratio = np.interp(distance, self._middle, self.area_ratio(*shape))
            drop = 1.0 - material.PERMITTIVITY_DROP * (ratio - 1.0)
            charge.append((ratio**2 * drop).mean(axis=(2, 3)).ravel())
        return np.asarray(np.log(charge[0] / charge[1]))

    def _unpack(self, y: Array | Complex) -> NDArray[np.complex128]:
        """Radius and height of every node, complex (2, batch, nodes)."""
        nodes, count = len(self.reference), len(y)
        out = np.zeros((2, count, nodes), dtype=np.complex128)
        out[0, :, 1:-1] = y[:, : nodes - 2]
        out[0, :, -1] = 1.0
        out[1, :, :-1] = y[:, nodes - 2 : -1]
        return out

    def _residual(
        self, y: Complex, finger: tuple[float, float, float] | None, volume: float | None
    ) -> Complex:
        """Forces on the free coordinates and the gas law, (batch, unknowns)."""
        r, z = self._unpack(y)
        pressure = y[:, -1]
        force = np.zeros((2, *r.shape), dtype=np.complex128)
        dr, dz, middle = np.diff(r), np.diff(z), 0.5 * (r[:, 1:] + r[:, :-1])
        along = np.sqrt(dr**2 + dz**2) / self._length
        hoop = middle / self._middle
        weight = 2.0 * np.pi * self._middle * self._length
        pull = weight * (along - along**-3 * hoop**-2) / (along * self._length**2)
        round_pull = 0.5 * weight * (hoop - along**-2 * hoop**-3) / self._middle
        for axis, delta in ((0, dr), (1, dz)):
            force[axis, :, 1:] += pull * delta
            force[axis, :, :-1] -= pull * delta
        force[0, :, 1:] += round_pull
        force[0, :, :-1] += round_pull
        # V = sum pi (r0^2 + r0 r1 + r1^2) (z0 - z1) / 3
        r0, r1 = r[:, :-1], r[:, 1:]
        square = np.pi / 3.0 * (r0**2 + r0 * r1 + r1**2)
        enclosed = -(square * dz).sum(axis=1)
        load = pressure[:, None]
        force[0, :, :-1] += load * np.pi / 3.0 * (2.0 * r0 + r1) * dz
        force[0, :, 1:] += load * np.pi / 3.0 * (r0 + 2.0 * r1) * dz
        force[1, :, :-1] -= load * square
        force[1, :, 1:] += load * square
        if finger is not None:
            centre, radius, stiffness = finger
            arm = np.stack([r, z - centre])
            length = np.sqrt((arm**2).sum(axis=0))
            near = (length.real < radius) & ~self._held
            spring = stiffness * self._share
            force += np.where(near, spring * (1.0 - radius / length) * arm, 0.0)
            force += np.where(self._held, spring * (arm - self._grip[:, None]), 0.0)
        if volume is None:
            total = enclosed + self._connected
            law = (pressure + material.ATMOSPHERE) * total / self._gas - 1.0
        else:
            law = enclosed - volume
        return np.concatenate([force[0, :, 1:-1], force[1, :, :-1], law[:, None]], axis=1)

    def _settle(
        self, y: Array, finger: tuple[float, float, float] | None, volume: float | None = None
    ) -> Array:
        """Newton's method; at a given volume, or with the gas closed."""
        nudge = 1e-30j * np.eye(len(y))
        for _ in range(60):
            residual = self._residual(y[None].astype(np.complex128), finger, volume)[0].real
            if np.abs(residual).max() < _TOLERANCE:
                return y
            jacobian = self._residual(y + nudge, finger, volume).imag.T / 1e-30
            step = np.linalg.solve(jacobian, -residual)
            y = y + step * min(1.0, _STEP_LIMIT / np.abs(step).max())
        raise ArithmeticError("Newton found no equilibrium in 60 steps")
