"""Fingers on the inflated dome: from where they are to how each capacitor stretches.

A closed-form model: the membrane is a tension membrane in its material coordinates (the flat
unit disc), pressed inward by regularised Green's functions, held by a closed gas volume, and
dragged in its plane by friction.

For speed, steps with equally many fingers are evaluated together, and time is the last axis.
A step's result does not depend on its company.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Array, Complex
from controller.simulator.dome.green_functions import (
    drag_system,
    poisson,
    press_system,
    pull,
    push,
    room,
    solve,
)
from controller.simulator.dome.membrane import Membrane, clamp_radius_mm

Single = NDArray[np.float32]
Steps = NDArray[np.intp]

# Fingers times nodes times steps evaluated at once: few enough for a core's cache, and yet so
# many steps that NumPy's inner loops are long.
_ELEMENTS: Final = 56_000
_FEWEST: Final = 32


@dataclass(frozen=True, slots=True)
class ContactModel:
    """Constants of the contact model; docs/simulator.md shows what the last four rest on.

    Attributes:
        bulge: Fraction of the indented gas volume that returns as a bulge elsewhere: 0 at constant
            pressure, .95 with the valve shut, .45 with a hundred dome volumes of reservoir.
        extremes: Limits of ln J; strongly converging fingers would invert an area.
        stick: Share of a local area change that stays local; the rest spreads over the membrane.
        wrap: ln J that the skin stuck to a fingertip gains by being bent around it, for an
            indentation by the clamped radius; it grows as the indentation squared.
    """

    bulge: float = 0.45
    regulated: float = 0.8  # fraction of the bulge that the pump's regulator takes away in time
    permittivity_drop: float = 0.08  # relative loss of permittivity per unit of area stretch
    extremes: tuple[float, float] = (-0.6, 0.5)
    stick: float = 0.5
    spread: float = 0.48  # how much of the mean area change the rest of the membrane takes up
    wrap: float = 1.7
    reach: float = 0.4  # how far from a finger's middle that gain extends, of the finger's radius


@dataclass(slots=True)
class Fingers:
    """Finger contacts over time; a slot keeps one finger."""

    position: Complex  # material position of each finger, unit disc, complex (steps, slots)
    depth_mm: Array  # indentation, 0 where the slot is empty, (steps, slots)
    radius_mm: Array  # finger radius, (steps, slots)
    drag_mm: Complex  # how far friction has pulled the skin with the finger, complex (steps, slots)


class FingerGroup(NamedTuple):
    """Steps with equally many fingers on the skin; lengths in clamped radii."""

    steps: Steps  # which steps, (steps,)
    at: Array  # where the fingers are on the unit disc, x and y, (2, fingers, steps)
    depth: Array  # how deep they press, (fingers, steps)
    size: Array  # how wide they are on the unstretched disc, (fingers, steps)
    force: Array  # how hard they pull the skin along x and y, (2, fingers, steps)
    system: Array  # what their loads do under each other, (fingers, fingers, steps)
    hold: Array  # loads that hold the depths, and what relief takes off them, (fingers, 2, steps)

    def part(self, of: NDArray[np.bool_] | slice) -> "FingerGroup":
        """Return some of the steps; `of` is a mask or a slice, (steps,)."""
        return FingerGroup(self.steps[of], *(values[..., of] for values in self[1:]))

    @property
    def room(self) -> Array:
        """Return the freedom of the skin under each finger, (fingers, steps): 1 apex, 0 clamp."""
        return np.asarray(room(*self.at), dtype=np.float64)

    def loads(self, relief: Array | float) -> Array:
        """Return the loads that hold the depths, (fingers, steps), for a relief, (steps,)."""
        load = self.hold[:, 0] - self.hold[:, 1] * relief
        return push(self.system, self.depth - self.room * relief, load)


class Skin:
    """The taxels' nodes on the inflated membrane, and what fingers do to them.

    Attributes:
        radius_mm: Clamped radius.
        taxels: Their number; in results the top row comes first.
        stretch: Mean linear stretch of the inflated membrane.
    """

    def __init__(
        self,
        membrane: Membrane,
        rows: int,
        columns: int,
        pitch_mm: float,
        model: ContactModel,
        *,
        nodes: int = 3,
    ) -> None:
        """Lay the taxels on the inflated membrane, with so many nodes along each one's side."""
        self.model, self.taxels = model, rows * columns
        self.radius_mm = clamp_radius_mm(rows, columns, pitch_mm)
        # Axes of all nodes: down and across a taxel, its row, its column, time.
        pitch = pitch_mm / self.radius_mm
        side = np.linspace(-0.25, 0.25, nodes)[:, None]  # half a pitch wide: paper, figure 3
        x = pitch * (np.arange(columns) - (columns - 1) / 2)
        y = pitch * ((rows - 1) / 2 - np.arange(rows))
        self._centre_x, self._centre_y = _single(x[:, None]), _single(y[:, None, None])
        self._x = _single((x + pitch * side)[None, :, None, :, None])
        self._y = _single((y - pitch * side)[:, None, :, None, None])
        distance = np.hypot(self._x, self._y)
        slope = membrane.at(distance, membrane.slope)
        lean, rise = membrane.at(distance, membrane.radius), membrane.at(distance, membrane.height)
        ray_x, ray_y = (a / np.maximum(distance, 1e-9) for a in (self._x, self._y))
        self._surface = [_single(a) for a in (lean * ray_x, lean * ray_y, rise)]
        lean = np.sin(slope)
        self._normal = [_single(a) for a in (lean * ray_x, lean * ray_y, np.cos(slope))]
        self._area = _area_on_dome(self._surface)
        self._flat_area = _area_on_disc(*np.broadcast_arrays(self._x, self._y))
        inflation = membrane.at(np.hypot(x, y[:, None]), membrane.area_ratio)
        self.stretch = float(np.sqrt(inflation.mean()))
        self._poisson = poisson(self.stretch)
        self._inflation = _single(inflation[:, :, None])

    def grips(self, fingers: Fingers) -> list[FingerGroup]:
        """Sort steps by how many fingers touch, and find what the fingers do to each other."""
        touch = fingers.depth_mm > 0.0
        count = touch.sum(axis=1)
        present = np.flatnonzero(np.bincount(count)).tolist()
        return [self._grip(fingers, np.flatnonzero(count == n), touch, n) for n in present]

    def free_bulge(self, grip: FingerGroup) -> Array:
        """Return the bulge that the closed gas alone would make, (steps,)."""
        return self._bulge(grip, grip.loads(0.0))

    def log_capacitance(self, grip: FingerGroup, relief: Array) -> Array:
        """Return ln(C / C0) of every taxel, (steps, taxels).

        The relief, (steps,), is the bulge in clamped radii that the regulator has taken away.
        """
        out = np.empty((len(relief), self.taxels))
        load = grip.loads(relief)
        bulge = self._bulge(grip, load) - relief
        count = max(_FEWEST, _ELEMENTS // (self._surface[0].size * max(1, len(load))))
        for start in range(0, len(relief), count):
            of = slice(start, start + count)
            part = grip.part(of)
            field = self.displacement(part, load[:, of], bulge[of], self._x, self._y)
            log_j = self._log_area(part, *field)
            out[of] = self._log_ratio(log_j).reshape(self.taxels, -1).T
        return out

    def displacement(
        self, grip: FingerGroup, load: Array, bulge: Array, x: Single, y: Single
    ) -> tuple[Single, Single, Single]:
        """Return how far points (x, y) of the disc move inward, and along x and y.

        Loads are (fingers, steps), the bulge by which the apex rises for lack of room (steps,), and
        the points' shapes broadcast and end in an axis for time.
        """
        free = room(x, y)
        over_all = (-1, *[1] * (free.ndim - 1), len(bulge))  # fingers, then the points, then time
        fingers = (*grip.at, grip.room, grip.size**2, 0.5 * load, *grip.force)
        at_x, at_y, here, wide, weight, force_x, force_y = (
            _single(values).reshape(over_all) for values in fingers
        )
        dx, dy = x - at_x, y - at_y
        near = (dx * dx + wide) + dy * dy
        rooms = free * here
        green = np.log((near + rooms) / near)
        inward = (weight * green).sum(axis=0) - _single(bulge) * free
        if not grip.force.any():
            return inward, np.zeros_like(inward), np.zeros_like(inward)
        ahead, aslant = pull(green, near, rooms, wide, self._poisson)
        along = aslant * (dx * force_x + dy * force_y)
        along_x = (ahead * force_x + along * dx).sum(axis=0)
        along_y = (ahead * force_y + along * dy).sum(axis=0)
        return inward, along_x, along_y

    def _grip(
        self, fingers: Fingers, steps: Steps, touch: NDArray[np.bool_], count: int
    ) -> FingerGroup:
        """Gather the fingers of `steps`, (n,), with `count` slots of `touch`, (n, slots)."""
        slots = np.nonzero(touch[steps])[1].reshape(len(steps), count).T.copy()
        position, drag = fingers.position[steps, slots], fingers.drag_mm[steps, slots]
        depth = fingers.depth_mm[steps, slots] / self.radius_mm
        size = fingers.radius_mm[steps, slots] / (self.radius_mm * self.stretch)
        at = np.stack([position.real, position.imag])
        target = np.stack([drag.real, drag.imag]) / self.radius_mm
        force = np.zeros_like(target)
        dragged = target.any(axis=(0, 1))
        if dragged.any():
            system = drag_system(at[..., dragged], size[:, dragged], self._poisson)
            wanted = target[..., dragged].reshape(2 * count, 1, -1)
            force[..., dragged] = solve(system, wanted).reshape(2, count, -1)
        system = press_system(at, size, self.model.bulge)
        hold = solve(system, np.stack([depth, room(*at)], axis=1))
        return FingerGroup(steps, at, depth, size, force, system, hold)

    def _bulge(self, grip: FingerGroup, load: Array) -> Array:
        """Return the bulge of the closed gas, (steps,), for loads, (fingers, steps)."""
        return np.asarray(self.model.bulge * (load * grip.room).sum(axis=0))

    def _log_area(
        self, grip: FingerGroup, inward: Single, along_x: Single, along_y: Single
    ) -> Single:
        """Return ln J of the patches of each taxel, (down, across, rows, columns, steps)."""
        model = self.model
        surface = [p - inward * n for p, n in zip(self._surface, self._normal, strict=True)]
        local: Single = np.log(np.maximum(_area_on_dome(surface) / self._area, 1e-6))
        mean = local.mean(axis=(0, 1, 2, 3), dtype=np.float64)
        local *= model.stick / 2
        local += _single((1.0 - model.stick) / 2 * model.spread * mean)
        plane = _area_on_disc(self._x + along_x, self._y + along_y)
        local += np.log(np.maximum(plane / self._flat_area, 1e-3))
        local += self._wrap(grip)
        return local

    def _wrap(self, grip: FingerGroup) -> Single:
        """Extra ln J where skin is bent around the fingers, (rows, columns, steps)."""
        gain = self.model.wrap * grip.depth**2
        blunt = -0.5 / (self.model.reach * self.stretch * grip.size) ** 2
        x, y, share, rate = (_single(values)[:, None, None] for values in (*grip.at, gain, blunt))
        across, down = (self._centre_x - x) ** 2, (self._centre_y - y) ** 2
        return np.asarray((share * np.exp(rate * across) * np.exp(rate * down)).sum(axis=0))

    def _log_ratio(self, log_j: Single) -> Single:
        """Return ln(C / C0) of every taxel for ln J of its patches, (rows, columns, steps)."""
        beta = self.model.permittivity_drop
        stretch = np.exp(np.clip(log_j, *self.model.extremes))
        ratio = stretch * stretch * ((1.0 + beta) - (beta * self._inflation) * stretch)
        mean = ratio.mean(axis=(0, 1))
        return np.asarray(np.log(mean / ((1.0 + beta) - beta * self._inflation)))


def _single(values: Array | Single) -> Single:
    """Return values, any shape, in single precision."""
    return np.asarray(values, dtype=np.float32)


def _diagonals(nodes: Single) -> tuple[Single, Single]:
    """Return differences along the diagonals of each patch, (down - 1, across - 1, ...)."""
    return nodes[1:, 1:] - nodes[:-1, :-1], nodes[:-1, 1:] - nodes[1:, :-1]


def _area_on_dome(nodes: Sequence[Single]) -> Single:
    """Return squared areas of patches, times four, (down - 1, across - 1, ...), from x, y, z."""
    (ax, bx), (ay, by), (az, bz) = map(_diagonals, nodes)
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return np.asarray(x * x + y * y + z * z)


def _area_on_disc(x: Single, y: Single) -> Single:
    """Return areas of the patches in the plane, times two, (down - 1, across - 1, ...)."""
    (ax, bx), (ay, by) = _diagonals(x), _diagonals(y)
    return np.abs(ax * by - ay * bx)
