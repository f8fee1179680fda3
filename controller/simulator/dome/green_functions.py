"""Green's functions of the unit disc: the effect of one finger, and the loads of several.

Time is the last axis everywhere. Systems have at most a few unknowns but thousands of steps, so
elimination is written out: each operation runs over all steps, and a step's result does not
depend on its company.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Array

Real = NDArray[np.floating[Any]]

_RIDGE_PRESS: Final = 0.05  # keeps two fingers on one spot solvable
_RIDGE_DRAG: Final = 0.08


def press_system(at: Array, size: Array, bulge: float) -> Array:
    """Return how far each finger's unit load moves the skin under each, (at, from, steps).

    The tension membrane's Green's function in the unit disc, zero at the clamp, regularised by
    the finger's size; less the bulge by which the closed gas answers every load. Fingers are at
    places (x and y, fingers, steps), their sizes (fingers, steps) those on the unstretched disc.
    """
    free = room(*at)
    rooms = free[:, None] * free
    near = ((at[:, :, None] - at[:, None]) ** 2).sum(axis=0) + size * size
    system: Array = 0.5 * np.log((near + rooms) / near) - bulge * rooms
    system[np.diag_indices(len(size))] += _RIDGE_PRESS
    return system


def poisson(stretch: float) -> float:
    """Return Poisson's ratio of rubber for small displacements in its plane once it is stretched.

    1/2 for rubber at rest, as for any incompressible sheet; but a neo-Hookean sheet stretched
    by s both ways answers with (3 s^-6 - 1) / (3 s^-6 + 1), which is negative from s = 1.2 on: far
    stretched it is nearly a net of springs, and pulling a piece of it draws all around along.
    """
    soft = 3.0 * stretch**-6
    return (soft - 1.0) / (soft + 1.0)


def drag_system(at: Array, size: Array, ratio: float) -> Array:
    """Return how far unit forces in x, then y, drag the skin; (2 at, 2 from, steps).

    Kelvin's plane-stress solution, see `pull`; fingers as in `press_system`, ratio is Poisson's.
    """
    count = len(size)
    free = room(*at)
    dx, dy = at[:, :, None] - at[:, None]
    wide, rooms = size * size, free[:, None] * free
    near = dx * dx + dy * dy + wide
    ahead, cross = pull(np.log((near + rooms) / near), near, rooms, wide, ratio)
    system = np.empty((2 * count, 2 * count, size.shape[1]))
    system[:count, :count] = ahead + cross * dx * dx
    system[:count, count:] = system[count:, :count] = cross * dx * dy
    system[count:, count:] = ahead + cross * dy * dy
    system[np.diag_indices(2 * count)] += _RIDGE_DRAG
    return system


def room(x: Real, y: Real) -> Real:
    """Return how free the skin is at points, any shape: 1 at the apex, 0 at the clamp."""
    return 1.0 - x * x - y * y


def pull(green: Any, near: Any, rooms: Any, wide: Any, ratio: float) -> tuple[Any, Any]:
    """Return how a unit force f drags the skin: factors of f and of r (r . f), r from the force.

    Kelvin's plane-stress solution for a force on a finger's patch, regularised as a whole as
    Cortez (2001) does with Stokes' solution, so that the systems of many fingers stay positive
    definite. An image takes it to zero at the clamp and leaves it alone near the finger.

    `green` is ln((near + rooms) / near), `near` the squared distance from the force plus `wide`,
    the finger's squared radius, `rooms` the product of the room at the force and here.
    """
    inside = rooms / (near * (near + rooms))
    return 0.5 * (3.0 - ratio) * green + 2.0 * wide * inside, (1.0 + ratio) * inside


def push(system: Array, target: Array, load: Array) -> Array:
    """Return loads, (fingers, steps), without pulls: drop fingers that pull, and solve again."""
    pulls: NDArray[np.bool_] = np.any(load < 0.0, axis=0)
    if pulls.any():
        held: NDArray[np.bool_] = load[:, pulls] >= 0.0
        rest = np.where(held[:, None] & held, system[..., pulls], 0.0)
        rest[np.diag_indices(len(load))] += ~held
        wanted = np.where(held, target[:, pulls], 0.0)
        load = load.copy()
        load[:, pulls] = np.maximum(solve(rest, wanted[:, None])[:, 0], 0.0)
    return load


def solve(system: Array, target: Array) -> Array:
    """Solve each step's system by elimination; (n, n, steps) and (n, sides, steps).

    Without pivoting: grips of fingers give pivots well above zero.
    """
    rows = np.concatenate([system, target], axis=1)
    for i in range(len(rows)):
        rows[i, i + 1 :] /= rows[i, i]
        factor = rows[:, i].copy()
        factor[i] = 0.0
        rows[:, i + 1 :] -= factor[:, None] * rows[i, i + 1 :]
    return rows[:, len(rows) :]
