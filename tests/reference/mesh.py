"""Triangles on the clamped disc, and how much of each lies under every taxel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
Index = NDArray[np.int64]


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
    """Mesh the unit disc with 6 k nodes on the k-th of `rings` circles.

    A conformal map takes their middle to `focus`; a grading above 1 crowds them there.
    """
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
    """Return the share of every taxel's area that each triangle fills, (25, triangles).

    Two taxels are `pitch` apart and each is `side` wide, in radii.
    """
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
