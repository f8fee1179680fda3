"""Fingers on the inflated dome: from where they are to how each capacitor stretches.

A closed-form model, vectorised over time: the membrane is a tension membrane in its material
coordinates (the flat unit disc, complex z = x + iy), pressed inward by regularised Green's
functions, held by a closed gas volume, and dragged in its plane by friction.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.simulator.membrane import RADIUS_MM, Membrane

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

POISSON: Final = 0.5  # incompressible rubber, plane stress
ELECTRODE_MM: Final = 5.0  # width of an electrode, so the side of a taxel: paper, figure 3
_RIDGE_PRESS: Final = 0.05  # keeps two fingers on one spot solvable
_RIDGE_DRAG: Final = 0.08


@dataclass(frozen=True, slots=True)
class ContactModel:
    """Constants of the contact model.

    Attributes:
        bulge: Fraction of the indented gas volume that returns as a bulge elsewhere.
        regulated: Fraction of the bulge that the pump's regulator takes away in time.
        stick: Share of a local area change that stays local: .26 frictionless ... 1 stuck;
            the rest spreads over the membrane.
        spread: How much of the mean area change the rest of the membrane takes up.
        thickness: Extra ln J right under a finger, from compressing the dielectric.
        permittivity_drop: Relative loss of permittivity per unit of area stretch.
        extremes: Limits of ln J; strongly converging fingers would invert an area.
    """

    bulge: float = 0.45
    regulated: float = 0.8
    stick: float = 0.45
    spread: float = 0.8
    thickness: float = 0.015
    permittivity_drop: float = 0.08
    extremes: tuple[float, float] = (-0.6, 0.5)


@dataclass(slots=True)
class Fingers:
    """Finger contacts over time; a slot keeps one finger.

    Attributes:
        position: Material position of each finger, unit disc, complex (steps, slots).
        depth_mm: Indentation, 0 where the slot is empty, (steps, slots).
        radius_mm: Finger radius, (steps, slots).
        drag_mm: How far friction has pulled the skin with the finger, complex (steps, slots).
    """

    position: Complex
    depth_mm: Array
    radius_mm: Array
    drag_mm: Complex


class Skin:
    """The taxels' nodes on the inflated membrane, and what fingers do to them."""

    def __init__(
        self, membrane: Membrane, rows: int, columns: int, pitch_mm: float, model: ContactModel
    ) -> None:
        self.model = model
        self.taxels = rows * columns
        self.nodes = _nodes(rows, columns, pitch_mm)  # (taxels, 3, 3), unit disc
        flat = self.nodes.ravel()
        reference = np.minimum(np.abs(flat), 1.0)
        angle = np.angle(flat)
        radius = membrane.at(reference, membrane.radius)
        slope = membrane.at(reference, membrane.slope)
        height = membrane.at(reference, membrane.height)
        outward = np.exp(1j * angle)
        self._surface = np.stack([radius * outward.real, radius * outward.imag, height])
        self._normal = np.stack(
            [np.sin(slope) * outward.real, np.sin(slope) * outward.imag, np.cos(slope)]
        )
        self._free = 1.0 - np.abs(flat) ** 2  # vanishes at the clamp
        self._area = _areas_3d(self._surface.reshape(3, self.taxels, 3, 3))
        self._flat_area = _areas_plane(self.nodes)
        centres = self.nodes[:, 1, 1]
        self.inflation = membrane.at(np.abs(centres), membrane.area_ratio)[:, None]
        self.stretch = float(np.sqrt(self.inflation.mean()))  # mean linear stretch

    def log_capacitance(self, fingers: Fingers, relief: Array) -> tuple[Array, Array]:
        """Return ln(C / C0) of every taxel, (steps, taxels), and the bulge, (steps,).

        Args:
            fingers: Contacts, (steps, slots).
            relief: Bulge that the regulator has taken away so far, in radii, (steps,).
        """
        model = self.model
        z = fingers.position
        size = fingers.radius_mm / (RADIUS_MM * self.stretch)
        load, bulge = self._loads(z, size, fingers.depth_mm / RADIUS_MM, relief)
        flat = self.nodes.ravel()
        inward = np.einsum("tk,tkn->tn", load, _green(z[:, :, None], size[:, :, None], flat))
        inward -= bulge[:, None] * self._free
        surface = self._surface[:, None, :] - inward[None] * self._normal[:, None, :]
        area = _areas_3d(surface.reshape(3, len(z), self.taxels, 3, 3))
        local = np.log(np.maximum(area / self._area, 1e-3))
        mean = local.mean(axis=(1, 2))[:, None, None]
        log_j = model.stick * local + (1.0 - model.stick) * model.spread * mean
        moved = self.nodes.ravel() + self._drag(z, size, fingers)
        plane = _areas_plane(moved.reshape(-1, self.taxels, 3, 3))
        log_j += np.log(np.maximum(plane / self._flat_area, 1e-3))
        log_j += self._pad(fingers)[:, :, None]
        stretch = np.exp(np.clip(log_j, *model.extremes))
        beta = model.permittivity_drop
        ratio = stretch**2 * (1.0 - beta * (self.inflation * stretch - 1.0))
        ratio /= 1.0 - beta * (self.inflation - 1.0)
        return np.log(ratio.mean(axis=2)), bulge

    def free_bulge(self, z: Complex, depth_mm: Array, radius_mm: Array) -> Array:
        """Return the bulge that the closed gas alone would make, in radii, (steps,)."""
        size = radius_mm / (RADIUS_MM * self.stretch)
        return self._loads(z, size, depth_mm / RADIUS_MM, np.zeros(len(z)))[1]

    def _loads(self, z: Complex, size: Array, depth: Array, relief: Array) -> tuple[Array, Array]:
        """Solve for each finger's load so that the skin is `depth` inward under it."""
        slots = z.shape[1]
        room = 1.0 - np.abs(z) ** 2
        kernel = _green(z[:, None, :], size[:, None, :], z[:, :, None])
        matrix = kernel - self.model.bulge * room[:, :, None] * room[:, None, :]
        matrix += _RIDGE_PRESS * np.eye(slots)
        target = depth - room * relief[:, None]
        active = depth > 0.0
        for _ in range(2):  # a finger cannot pull: drop those that would, and solve again
            both = active[:, :, None] & active[:, None, :]
            system = np.where(both, matrix, np.eye(slots))
            load = np.linalg.solve(system, np.where(active, target, 0.0)[:, :, None])[:, :, 0]
            pulling = active & (load < 0.0)
            if not pulling.any():
                break
            active = active & ~pulling
        load = np.maximum(load, 0.0)
        bulge = self.model.bulge * (load * room).sum(axis=1) - relief
        return load, bulge

    def _drag(self, z: Complex, size: Array, fingers: Fingers) -> Complex:
        """In-plane displacement of the nodes, unit disc, complex (steps, nodes)."""
        drag = np.where(fingers.depth_mm > 0.0, fingers.drag_mm, 0.0) / RADIUS_MM
        if not drag.any():
            return np.zeros((1, self.nodes.size), dtype=np.complex128)
        steps, slots = z.shape
        system = np.empty((steps, 2 * slots, 2 * slots))
        taper = 1.0 - np.abs(z) ** 2
        between = z[:, :, None] - z[:, None, :]
        direct, cross = _kelvin(between, size[:, None, :])
        scale = taper[:, :, None]
        unit = between.conjugate()
        # (r . f) r, written with real and imaginary parts of f.
        x, y = between.real, -unit.imag
        system[:, :slots, :slots] = scale * (direct + cross * x * x)
        system[:, :slots, slots:] = scale * cross * x * y
        system[:, slots:, :slots] = scale * cross * x * y
        system[:, slots:, slots:] = scale * (direct + cross * y * y)
        idle = fingers.depth_mm <= 0.0
        off = np.concatenate([idle, idle], axis=1)
        system[off[:, :, None] | off[:, None, :]] = 0.0
        system += np.eye(2 * slots) * np.where(off, 1.0, _RIDGE_DRAG)[:, :, None]
        target = np.concatenate([drag.real, drag.imag], axis=1)
        force = np.linalg.solve(system, target[:, :, None])[:, :, 0]
        pull = force[:, :slots] + 1j * force[:, slots:]
        pull[idle] = 0.0
        flat = self.nodes.ravel()
        r = flat - z[:, :, None]
        direct, cross = _kelvin(r, size[:, :, None])
        along = (r.conjugate() * pull[:, :, None]).real
        field: Complex = direct * pull[:, :, None] + cross * r * along
        moved: Complex = field.sum(axis=1) * self._free
        return moved

    def _pad(self, fingers: Fingers) -> Array:
        """Thickness compression right under the fingers, (steps, taxels)."""
        centres = self.nodes[:, 1, 1]
        distance = np.abs(centres - fingers.position[:, :, None]) * RADIUS_MM
        reach = np.maximum(fingers.radius_mm, 1.0)[:, :, None]
        firm = np.minimum(fingers.depth_mm / 5.0, 1.0)[:, :, None]
        under = firm * np.exp(-0.5 * (distance / reach) ** 2)
        return np.asarray(self.model.thickness * under.sum(axis=1))


def _nodes(rows: int, columns: int, pitch_mm: float) -> Complex:
    """Three by three nodes of every taxel, row 0 at the top, (taxels, 3, 3), unit disc."""
    x = (np.arange(columns) - (columns - 1) / 2) * pitch_mm
    y = ((rows - 1) / 2 - np.arange(rows)) * pitch_mm
    side = np.array([-0.5, 0.0, 0.5]) * min(ELECTRODE_MM, pitch_mm)
    centre = x[None, :] + 1j * y[:, None]
    offset = side[None, :] + 1j * side[:, None]
    return np.asarray((centre.reshape(-1, 1, 1) + offset) / RADIUS_MM, dtype=np.complex128)


def _green(source: Complex, size: Array, point: Complex) -> Array:
    """Inward displacement at `point` for a unit load at `source`; zero at the clamp."""
    image = np.abs(1.0 - source.conjugate() * point) ** 2
    near = np.abs(point - source) ** 2
    return np.asarray(0.5 * np.log((image + size**2) / (near + size**2)))


def _kelvin(r: Complex, size: Array) -> tuple[Array, Array]:
    """Plane-stress Kelvin solution, regularised: factors of f and of r (r . f)."""
    square = np.abs(r) ** 2 + size**2
    direct = (3.0 - POISSON) * -0.5 * np.log(np.minimum(square, 1.0))
    return direct, (1.0 + POISSON) / square


def _areas_3d(points: Array) -> Array:
    """Areas of the four quadrilaterals of each taxel; points (3, ..., 3, 3) -> (..., 4)."""
    a, b = points[..., :-1, :-1], points[..., 1:, 1:]
    c, d = points[..., :-1, 1:], points[..., 1:, :-1]
    p, q = b - a, c - d
    x = p[1] * q[2] - p[2] * q[1]
    y = p[2] * q[0] - p[0] * q[2]
    z = p[0] * q[1] - p[1] * q[0]
    area = 0.5 * np.sqrt(x * x + y * y + z * z)
    return np.asarray(area.reshape(*area.shape[:-2], 4))


def _areas_plane(points: Complex) -> Array:
    """Areas of the four quadrilaterals of each taxel in the plane; (..., 3, 3) -> (..., 4)."""
    p = points[..., 1:, 1:] - points[..., :-1, :-1]
    q = points[..., :-1, 1:] - points[..., 1:, :-1]
    area = 0.5 * np.abs((p.conjugate() * q).imag)
    return np.asarray(area.reshape(*area.shape[:-2], 4))
