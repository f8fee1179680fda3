"""The whole dome in space: neo-Hookean membrane, closed gas, spherical fingers, full Newton.

Constant-strain triangles; the energy per reference area is (tr C + 1 / det C - 3) / 2. The gas
obeys Boyle's law in the dome and whatever is connected with it. A finger is a sphere of radial
springs; where it has touched, it either holds the skin (no slip) or lets it slide freely.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from controller.shared.aliases import Array, Index, Mask

from . import material
from .mesh import disc, taxels

FINGER = 7.0 / material.RADIUS_MM  # radius of a fingertip
_STEP_LIMIT = 0.15  # radii that a node may move in one Newton step


@dataclass
class State:
    """A state of equilibrium."""

    x: Array  # node positions, (nodes, 3)
    pressure: float  # above the atmosphere's
    held: Mask  # which nodes each finger holds, bool (fingers, nodes)
    grip: Array  # where it holds them, from its centre, (fingers, nodes, 3)


@dataclass(frozen=True)
class Press:
    """What a finger path did, step by step."""

    depth_mm: Array  # how far inward the skin under each finger moved, (steps, fingers)
    log_c: Array  # ln C / C0 of every taxel, (steps, 25)
    x: Array  # node positions, (steps, nodes, 3)

    def at(self, depth_mm: float) -> Array:
        """Return ln C / C0 at an indentation of the first finger, (25,)."""
        depth = np.concatenate([[0.0], self.depth_mm[:, 0]])
        if not depth[-1] >= depth_mm:
            raise ValueError(f"the finger only came to {depth[-1]:.1f} mm, not {depth_mm} mm")
        log_c = np.concatenate([np.zeros((1, 25)), self.log_c])
        return np.array([np.interp(depth_mm, depth, taxel) for taxel in log_c.T])


class Dome:
    """A dome that is inflated once and pressed often."""

    tolerance, iterations = 1e-9, 60  # of Newton's method

    def __init__(
        self,
        rings: int,
        volume: float,
        connected: float = 0.0,
        focus: complex = 0j,
        grading: float = 1.0,
    ) -> None:
        """Inflate the dome to a volume, R^3; above a grading of 1, rings crowd around the focus."""
        self.mesh = mesh = disc(rings, focus, grading)
        dofs = (3 * mesh.triangle[:, :, None] + np.arange(3)).reshape(-1, 9)
        self._rows, self._columns = np.repeat(dofs, 9, axis=1).ravel(), np.tile(dofs, 9).ravel()
        self._free = np.flatnonzero(np.repeat(mesh.free, 3))
        self._pattern()
        self._cover = taxels(mesh)
        self._connected = connected
        flat = np.concatenate([mesh.node, np.zeros((len(mesh.node), 1))], axis=1)
        parts = np.linspace(0.0, volume, max(2, int(volume / 0.2) + 1))[1:]
        flat[:, 2] = 2.0 / np.pi * parts[0] * (1.0 - (mesh.node**2).sum(axis=1))
        self.rest = self._free_state(flat, 0.1, 0)
        for part in parts:
            self.rest = self._settle(self.rest, np.zeros((0, 3)), volume=float(part))
        self.gas = (self.rest.pressure + material.ATMOSPHERE) * (volume + connected)

    def touch(self, points: Sequence[complex]) -> tuple[NDArray[np.int64], Array, Array]:
        """Return the nodes nearest to reference points, where they are, and outward normals."""
        flat = self.mesh.node[:, 0] + 1j * self.mesh.node[:, 1]
        nodes = np.array([int(np.abs(flat - point).argmin()) for point in points])
        _, gradient, _ = self._volume(self.rest.x)  # of the volume: normal times area
        normal = gradient.reshape(-1, 3)[nodes]
        return nodes, self.rest.x[nodes], normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def press(
        self, points: Sequence[complex], travel_mm: Array, shift_mm: Array | None = None
    ) -> Press:
        """Press fingers inward by a travel, (steps,), and along the skin by (steps, fingers, 3)."""
        nodes, surface, normal = self.touch(points)
        state = self._free_state(self.rest.x, self.rest.pressure, len(points))
        depth, log_c, x = [], [], []
        before = surface + normal * FINGER
        for i, travel in enumerate(travel_mm):
            centre = surface + normal * (FINGER - travel / material.RADIUS_MM)
            if shift_mm is not None:
                centre = centre + shift_mm[i] / material.RADIUS_MM
            state = self._follow(state, before, centre)
            before = centre
            moved = (state.x - self.rest.x)[nodes]
            depth.append(-(moved * normal).sum(axis=1) * material.RADIUS_MM)
            log_c.append(self.log_capacitance(state.x))
            x.append(state.x)
        return Press(np.array(depth), np.array(log_c), np.array(x))

    def area_ratio(self, x: Array) -> Array:
        """Return deformed over reference area, (triangles,)."""
        corner = x[self.mesh.triangle]
        cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        return np.asarray(0.5 * np.linalg.norm(cross, axis=1) / self.mesh.area)

    def log_capacitance(self, x: Array) -> Array:
        """Return ln C / C0 of every taxel: the area squared, less permittivity, (25,)."""
        drop = material.PERMITTIVITY_DROP
        now, rest = (
            self._cover @ (ratio**2 * (1.0 - drop * (ratio - 1.0)))
            for ratio in (self.area_ratio(x), self.area_ratio(self.rest.x))
        )
        return np.asarray(np.log(now / rest))

    def _free_state(self, x: Array, pressure: float, fingers: int) -> State:
        """Return a state in which no finger holds anything."""
        held = np.zeros((fingers, len(x)), dtype=bool)
        return State(x, pressure, held, np.zeros((fingers, len(x), 3)))

    def _follow(self, state: State, before: Array, centre: Array) -> State:
        """Move the fingers, in smaller steps where Newton loses its way."""
        try:
            settled = self._settle(state, centre)
        except ArithmeticError:
            if np.abs(centre - before).max() < 1e-3:
                raise
            middle = (before + centre) / 2
            settled = self._follow(state, before, middle)
            return self._follow(settled, middle, centre)
        held, grip = state.held.copy(), state.grip.copy()
        for k in range(len(centre)):
            touched, first = _caught(state.x - before[k], settled.x - centre[k])
            new = touched & ~held.any(axis=0) & self.mesh.free
            grip[k, new] = first[new]
            held[k] |= new
        return State(settled.x, settled.pressure, held, grip)

    def _settle(self, state: State, centre: Array, volume: float | None = None) -> State:
        """Newton's method for positions and pressure; at a given volume, or with the gas closed."""
        x, pressure = state.x, state.pressure
        size, free = 3 * len(self.mesh.node), self._free
        for _ in range(self.iterations):
            _, force, tangent = self._elastic(x)
            enclosed, swell, bend = self._volume(x)
            entries = self._gather @ (tangent - pressure * bend).ravel()
            residual = force - pressure * swell
            if len(centre):
                push, rows, columns, values = self._push(x, state, centre)
                residual = residual + push
                code = self._code(rows, columns)
                where = np.searchsorted(self._codes, code[code >= 0])
                entries += np.bincount(where, values[code >= 0], len(entries))
            if volume is None:  # Boyle: (p + p_atm)(V + V_connected) stays
                total, absolute = enclosed + self._connected, pressure + material.ATMOSPHERE
                law, by_volume, by_pressure = absolute * total - self.gas, absolute, total
            else:
                law, by_volume, by_pressure = enclosed - volume, 1.0, 0.0
            if max(np.abs(residual[free]).max(), abs(law / by_volume)) < self.tolerance:
                return State(x, pressure, state.held, state.grip)
            solve = linalg.splu(
                sparse.csc_matrix((entries, *self._where), (len(free), len(free))),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
            step, more = solve.solve(np.stack([-residual[free], swell[free]], axis=1)).T
            slope = by_volume * (swell[free] @ more) + by_pressure
            rise = -(law + by_volume * (swell[free] @ step)) / slope
            move = np.zeros(size)
            move[free] = step + rise * more
            scale = min(1.0, _STEP_LIMIT / max(np.abs(move).max(), 1e-12))
            x, pressure = x + scale * move.reshape(-1, 3), pressure + scale * rise
        raise ArithmeticError(f"Newton found no equilibrium in {self.iterations} steps")

    def _pattern(self) -> None:
        """Find where the entries of triangles belong in the matrix of all that is free."""
        self._number = np.full(3 * len(self.mesh.node), -1)
        self._number[self._free] = np.arange(len(self._free))
        code = self._code(self._rows, self._columns)
        self._codes, where = np.unique(code[code >= 0], return_inverse=True)
        entry = np.flatnonzero(code >= 0)
        shape = (len(self._codes), len(code))
        self._gather = sparse.csr_matrix((np.ones(len(entry)), (where.ravel(), entry)), shape)
        column, row = np.divmod(self._codes, len(self._free))
        self._where = row, np.searchsorted(column, np.arange(len(self._free) + 1))

    def _code(self, rows: Index, columns: Index) -> Index:
        """Return numbers that sort entries by column and row; -1 where one is clamped."""
        row, column = self._number[rows], self._number[columns]
        return np.where((row < 0) | (column < 0), -1, column * len(self._free) + row)

    def _push(self, x: Array, state: State, centre: Array) -> tuple[Array, Index, Index, Array]:
        """Return the force of the fingers, (nodes * 3,), and rows, columns, values of stiffness."""
        force, block = np.zeros(x.size), np.zeros((len(x), 3, 3))
        near = self.mesh.free & ~state.held.any(axis=0)
        for at, held, grip in zip(centre, state.held, state.grip, strict=True):
            push, rise = _push(x - at, self.mesh.share, near, held, grip)
            force, block = force + push, block + rise
        dofs = 3 * np.arange(len(x))[:, None, None] + np.arange(3)
        rows, columns = np.broadcast_arrays(np.swapaxes(dofs, 1, 2), dofs)
        return force, rows.ravel(), columns.ravel(), block.ravel()

    def _elastic(self, x: Array) -> tuple[float, Array, Array]:
        """Energy, its gradient (nodes * 3,), its second derivative (triangles, 9, 9)."""
        mesh, slope, eye = self.mesh, self.mesh.slope, np.eye(2)
        stretch = np.einsum("tai,taj->tij", x[mesh.triangle], slope)  # F, (triangles, 3, 2)
        right = np.einsum("tki,tkj->tij", stretch, stretch)  # C = F^T F
        inverse, squash = np.linalg.inv(right), 1.0 / np.linalg.det(right)
        trace = np.trace(right, axis1=1, axis2=2)
        energy = 0.5 * float((mesh.area * (trace + squash - 3.0)).sum())
        second = eye - inverse * squash[:, None, None]  # second Piola-Kirchhoff
        pull = np.einsum("tij,tjk,tak,t->tai", stretch, second, slope, mesh.area, optimize=True)
        force = np.zeros_like(x)
        np.add.at(force, mesh.triangle, pull)
        along = np.einsum("tij,taj->tai", inverse, slope)
        spread = np.einsum("tij,taj->tai", stretch, along)
        both = np.einsum("tai,tbi->tab", slope, along)
        plane = np.einsum("tij,tjk,tlk->til", stretch, inverse, stretch, optimize=True)
        tangent = np.einsum("tik,tab->taibk", plane, both)
        tangent += np.einsum("tbi,tak->taibk", spread, spread)
        tangent += 2.0 * np.einsum("tai,tbk->taibk", spread, spread)
        tangent *= squash[:, None, None, None, None]
        initial = np.einsum("tai,tij,tbj->tab", slope, second, slope, optimize=True)
        tangent += np.einsum("tab,ik->taibk", initial, np.eye(3))
        tangent *= mesh.area[:, None, None, None, None]
        return energy, force.ravel(), tangent.reshape(-1, 9, 9)

    def _volume(self, x: Array) -> tuple[float, Array, Array]:
        """Enclosed volume, its gradient (nodes * 3,), its second derivative (triangles, 9, 9)."""
        triangle = self.mesh.triangle
        corner = x[triangle]
        gradient = np.zeros_like(x)
        bend = np.zeros((len(triangle), 3, 3, 3, 3))
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            np.add.at(gradient, triangle[:, i], np.cross(corner[:, j], corner[:, k]) / 6.0)
            turn = np.cross(np.eye(3), corner[:, k, None, :]) / 6.0  # row a: e_a x corner
            bend[:, i, :, j, :] = np.swapaxes(turn, 1, 2)
            bend[:, j, :, i, :] = turn
        volume = float((gradient * x).sum()) / 3.0
        return volume, gradient.ravel(), bend.reshape(-1, 9, 9)


def _push(arm: Array, share: Array, near: Mask, held: Mask, grip: Array) -> tuple[Array, Array]:
    """Return the force of radial springs, (nodes * 3,), and their stiffness, (nodes, 3, 3)."""
    length = np.linalg.norm(arm, axis=1)
    gap = length - FINGER
    normal = arm / length[:, None]
    radial = normal[:, :, None] * normal[:, None, :]
    spring = material.PULP * share[:, None]
    on = near & (gap < 0.0)
    force, block = np.zeros_like(arm), np.zeros((len(arm), 3, 3))
    force[on] = (spring * gap[:, None] * normal)[on]
    block[on] = radial[on] + (gap / length)[on, None, None] * (np.eye(3) - radial[on])
    force[held] = (spring * (arm - grip))[held]
    block[held] = np.eye(3)
    return force.ravel(), block * spring[:, :, None]


def _caught(before: Array, after: Array) -> tuple[Mask, Array]:
    """Return which nodes a fingertip touches after a step, and where each touched it first."""
    above, below = (np.linalg.norm(arm, axis=1) - FINGER for arm in (before, after))
    when = np.clip(above / np.maximum(above - below, 1e-12), 0.0, 1.0)[:, None]
    first = before + when * (after - before)
    first *= FINGER / np.linalg.norm(first, axis=1, keepdims=True)
    return below < 0.0, first
