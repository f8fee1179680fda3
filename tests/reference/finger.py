"""A spherical fingertip on radial springs, and what it does to the nodes that it touches."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from . import material

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Finger:
    """A spherical fingertip."""

    radius_mm: float = 7.0  # of the sphere
    stiffness: float = material.PULP  # of its springs; `material.PULP` or `material.RIGID`
    sticky: bool = True  # it holds the skin where it first touched it

    @property
    def radius(self) -> float:
        """In clamped radii."""
        return self.radius_mm / material.RADIUS_MM

    def push(
        self, arm: Array, share: Array, near: Mask, held: Mask, grip: Array
    ) -> tuple[Array, sparse.csr_matrix]:
        """Return the force of the springs, (nodes * 3,), and their stiffness.

        arm: from the finger's middle to every node, (nodes, 3); share: reference area of every
        node, (nodes,); near: nodes that may meet the finger without being held, (nodes,); held:
        nodes that it holds, (nodes,); grip: where, from its middle, (nodes, 3).
        """
        length = np.linalg.norm(arm, axis=1)
        gap = length - self.radius
        normal = arm / length[:, None]
        radial = normal[:, :, None] * normal[:, None, :]
        spring = self.stiffness * share[:, None]
        on = near & (gap < 0.0)
        force, block = np.zeros_like(arm), np.zeros((len(arm), 3, 3))
        force[on] = (spring * gap[:, None] * normal)[on]
        block[on] = radial[on] + (gap / length)[on, None, None] * (np.eye(3) - radial[on])
        force[held] = (spring * (arm - grip))[held]
        block[held] = np.eye(3)
        block *= spring[:, :, None]
        nodes = np.arange(len(arm) + 1)
        stiffness = sparse.bsr_matrix((block, nodes[:-1], nodes), shape=(arm.size, arm.size))
        return force.ravel(), sparse.csr_matrix(stiffness)

    def catch(self, before: Array, after: Array) -> tuple[Mask, Array]:
        """Return which nodes it touches after a step, and where each touched it first."""
        above, below = (np.linalg.norm(arm, axis=1) - self.radius for arm in (before, after))
        when = np.clip(above / np.maximum(above - below, 1e-12), 0.0, 1.0)[:, None]
        first = before + when * (after - before)
        first *= self.radius / np.linalg.norm(first, axis=1, keepdims=True)
        return (below < 0.0) & self.sticky, first
