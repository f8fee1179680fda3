"""The linear clamped disc: linear finite elements, out of its plane and in it."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from .mesh import Mesh

Array = NDArray[np.float64]


def deflection(mesh: Mesh, load: Array) -> Array:
    """Solve -laplace w = load for a membrane of unit tension that is clamped, w (nodes,)."""
    entries = np.einsum("tai,tbi,t->tab", mesh.slope, mesh.slope, mesh.area)
    rows = np.repeat(mesh.triangle, 3, axis=1)
    columns = np.tile(mesh.triangle, (1, 3))
    matrix = sparse.csr_matrix((entries.ravel(), (rows.ravel(), columns.ravel())))
    free = np.flatnonzero(mesh.free)
    w = np.zeros(len(mesh.node))
    w[free] = linalg.spsolve(matrix[free][:, free].tocsc(), (mesh.share * load)[free])
    return w


def drag(mesh: Mesh, ratio: float, force: Array, swelling: Array | None = None) -> Array:
    """Solve the clamped sheet in plane stress (Young's modulus 1, thickness 1), u (nodes, 2).

    mesh: the disc; ratio: Poisson's; below zero for rubber that is stretched already; force: in its
    plane, per area, (nodes, 2); swelling: area strain that something else imposes, equal both ways,
    (triangles,): the sheet is that much too large for its place, or, as below a dent, too small.
    """
    # Strains xx, yy, 2 xy from the corners' displacements, (triangles, 3, 6).
    strain = np.zeros((len(mesh.area), 3, 6))
    strain[:, 0, 0::2] = strain[:, 2, 1::2] = mesh.slope[:, :, 0]
    strain[:, 1, 1::2] = strain[:, 2, 0::2] = mesh.slope[:, :, 1]
    law = np.array([[1.0, ratio, 0.0], [ratio, 1.0, 0.0], [0.0, 0.0, (1.0 - ratio) / 2]])
    law /= 1.0 - ratio**2
    entries = np.einsum("tia,ij,tjb,t->tab", strain, law, strain, mesh.area, optimize=True)
    dofs = (2 * mesh.triangle[:, :, None] + np.arange(2)).reshape(-1, 6)
    rows, columns = np.repeat(dofs, 6, axis=1), np.tile(dofs, (1, 6))
    matrix = sparse.csr_matrix((entries.ravel(), (rows.ravel(), columns.ravel())))
    right = (mesh.share[:, None] * force).ravel()
    if swelling is not None:
        stretched = 0.5 * swelling[:, None] * np.array([1.0, 1.0, 0.0])
        pull = np.einsum("tia,ij,tj,t->ta", strain, law, stretched, mesh.area, optimize=True)
        np.subtract.at(right, dofs, pull)
    free = np.flatnonzero(np.repeat(mesh.free, 2))
    u = np.zeros(2 * len(mesh.node))
    u[free] = linalg.spsolve(matrix[free][:, free].tocsc(), right[free])
    return u.reshape(-1, 2)


def divergence(mesh: Mesh, u: Array) -> Array:
    """Return the area strain of in-plane displacements, (triangles,)."""
    return np.asarray(np.einsum("tai,tai->t", mesh.slope, u[mesh.triangle]))
