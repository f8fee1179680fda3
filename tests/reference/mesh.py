"""Triangles on the clamped disc, how much of each lies under every taxel, and linear solutions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from controller.shared.aliases import Array, Index


@dataclass(frozen=True)
class Mesh:
    """A triangulated unit disc."""

    node: Array  # reference positions, (nodes, 2)
    triangle: Index  # corners, counterclockwise, (triangles, 3)
    slope: Array  # gradients of the corners' shape functions, (triangles, 3, 2)
    area: Array  # reference areas, (triangles,)
    share: Array  # reference area that belongs to each node, (nodes,)
    free: NDArray[np.bool_]  # nodes that are not clamped, (nodes,)


def disc(rings: int, focus: complex = 0j, grading: float = 1.0) -> Mesh:
    """Mesh the unit disc by 6 k nodes on the k-th circle, their middle at `focus`, graded there."""
    nodes, triangles = [np.zeros(1, dtype=np.complex128)], []
    for k in range(1, rings + 1):
        angle = np.arange(6 * k) * np.pi / (3 * k)
        nodes.append((k / rings) ** grading * np.exp(1j * angle))
        inner, outer = _first(k - 1), _first(k)
        for sector in range(6):
            for j in range(k):
                low = inner + (sector * (k - 1) + j) % max(6 * (k - 1), 1)
                high = outer + sector * k + j
                following = outer + (sector * k + j + 1) % (6 * k)
                triangles.append((low, high, following))
                if j < k - 1:
                    beside = inner + (sector * (k - 1) + j + 1) % (6 * (k - 1))
                    triangles.append((low, following, beside))
    even = np.concatenate(nodes)
    flat = (even + focus) / (1.0 + np.conj(focus) * even)
    node, triangle = np.stack([flat.real, flat.imag], axis=1), np.array(triangles)
    corner = node[triangle]
    edges = np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=2)
    inverse = np.linalg.inv(edges)
    slope = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    area = 0.5 * np.linalg.det(edges)
    share = np.zeros(len(node))
    np.add.at(share, triangle, area[:, None] / 3)
    return Mesh(node, triangle, slope, area, share, np.abs(flat) < 1 - 1e-9)


def _first(ring: int) -> int:
    return 3 * ring * (ring - 1) + 1 if ring else 0


def taxels(mesh: Mesh, pitch: float = 10 / 38, side: float = 5 / 38) -> sparse.csr_matrix:
    """Return the share of each taxel's area in each triangle, (25, triangles); lengths in radii."""
    parts = 8  # each triangle is judged by the centres of parts^2 smaller ones
    i, j = np.meshgrid(np.arange(parts), np.arange(parts), indexing="ij")
    up, down = i + j < parts, i + j < parts - 1
    first = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / parts
    second = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / parts
    weight = np.stack([1 - first - second, first, second])
    points = np.einsum("cs,tcx->tsx", weight, mesh.node[mesh.triangle])
    column = np.rint(points[..., 0] / pitch)
    row = -np.rint(points[..., 1] / pitch)  # row 0 is the top
    under = np.maximum(
        np.abs(points[..., 0] - column * pitch), np.abs(points[..., 1] + row * pitch)
    )
    inside = (under < side / 2) & (np.abs(column) <= 2) & (np.abs(row) <= 2)
    triangle, sample = np.nonzero(inside)
    taxel = ((row + 2) * 5 + column + 2)[triangle, sample].astype(int)
    shape = (25, len(mesh.area))
    cover = sparse.csr_matrix((mesh.area[triangle] / parts**2, (taxel, triangle)), shape=shape)
    return sparse.csr_matrix(sparse.diags(1 / np.asarray(cover.sum(axis=1)).ravel()) @ cover)


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
    """Solve the clamped sheet in plane stress, force per area, area strain; u (nodes, 2)."""
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
