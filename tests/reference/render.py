"""Draw the touched dome: its skin, its taxels in the colours of what they sense, the fingers."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap
from matplotlib.patches import Circle
from numpy.typing import NDArray

from controller.simulator.contact import FingerGroup, Skin
from controller.simulator.membrane import RADIUS_MM, Membrane

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_TILT = np.radians(52.0)  # how far the dome leans towards the viewer
_LIGHT = np.array([-0.5, 0.1, 0.86]) / np.linalg.norm([-0.5, 0.1, 0.86])
_SKIN = np.array([0.925, 0.935, 0.955])


class View:
    """The dome under one grip, seen from the front and above; mm on the page."""

    def __init__(self, membrane: Membrane, skin: Skin, grip: FingerGroup) -> None:
        self._membrane, self._skin, self._grip = membrane, skin, grip

    def space(self, z: Complex, lift: float = 0.0) -> Array:
        """Return where points of the flat disc are on the touched dome, (3, points), mm."""
        return self._place(z, lift)[:3]

    def _place(self, z: Complex, lift: float) -> Array:
        """As `space`, and as a fourth row how far the skin has sunk there, mm."""
        x, y = (axis.astype(np.float32)[:, None] for axis in (z.real, z.imag))
        load, bulge = self._grip.loads(0.0), self._skin.free_bulge(self._grip)
        inward, along_x, along_y = (
            field[:, 0].astype(np.float64)
            for field in self._skin.displacement(self._grip, load, bulge, x, y)
        )
        at = z + along_x + 1j * along_y
        distance, ray = np.minimum(np.abs(at), 1.0), np.exp(1j * np.angle(at))
        radius, height, slope = (
            np.interp(distance, self._membrane.reference, values)
            for values in (self._membrane.radius, self._membrane.height, self._membrane.slope)
        )
        out = radius + (lift - inward) * np.sin(slope)
        up = height + (lift - inward) * np.cos(slope)
        return RADIUS_MM * np.stack([out * ray.real, out * ray.imag, up, inward])

    def draw(self, axes: Axes, log_c: Array, colours: Colormap, limit: float) -> None:
        """Draw skin and taxels.

        axes: where; log_c: what every taxel senses, (25,); colours: of log_c from -limit to limit;
        limit: see there.
        """
        reach, turn = np.linspace(0.0, 1.0, 61), np.linspace(0.0, 2 * np.pi, 145)
        disc = (reach[:, None] * np.exp(1j * turn)).astype(np.complex128)
        quads, shades = self._patch(disc, 0.0)
        faces, paints, depths = [quads], [shades[:, None] * _SKIN], [_depth(quads)]
        for k, (row, column) in enumerate(np.ndindex(5, 5)):
            middle = complex(column - 2, 2 - row) * 10.0
            side = np.linspace(-2.5, 2.5, 9)
            square = (middle + side[:, None] + 1j * side).astype(np.complex128)
            quads, shades = self._patch(square / RADIUS_MM, 0.006)
            paint = np.array(colours(0.5 + 0.5 * log_c[k] / limit)[:3])
            faces.append(quads)
            paints.append(shades[:, None] * paint)
            depths.append(_depth(quads) + 3.0)
            frame = np.concatenate([side - 2.5j, 2.5 + 1j * side, -side + 2.5j, -2.5 - 1j * side])
            edge = _page(self.space((middle + frame) / RADIUS_MM, 0.006).T)
            axes.plot(*edge.T, color="#5b6b8c", lw=0.5, alpha=0.7)
        order = np.argsort(np.concatenate(depths))
        shape = np.stack([_page(quads) for quads in np.concatenate(faces)])[order]
        paint = np.clip(np.concatenate(paints), 0.0, 1.0)[order]
        axes.add_collection(PolyCollection(list(shape), facecolors=paint, edgecolors=paint, lw=0.3))
        rim = _page(self.space(np.exp(1j * turn)).T)
        axes.plot(*rim.T, color="#8c96ae", lw=1.0, zorder=0)
        axes.set(aspect="equal", xlim=(-43, 43), ylim=(-34, 45))
        axes.axis("off")

    def fingers(self, axes: Axes, z: Complex, radius_mm: float, moved: Complex, ink: str) -> None:
        """Draw fingertips where they press, and with arrows how they came to be there."""
        points = self.space(z, lift=radius_mm / RADIUS_MM)
        before = self.space(z - moved, lift=radius_mm / RADIUS_MM)
        for end, start in zip(_page(points.T), _page(before.T), strict=True):
            axes.add_patch(Circle((end[0], end[1]), radius_mm, fc="#ffffff30", ec=ink, lw=1.1))
            if np.hypot(*(end - start)) > 1.0:
                arrow = {"arrowstyle": "-|>", "color": ink, "lw": 1.4, "mutation_scale": 11}
                away = start - 1.2 * (end - start)
                axes.annotate("", tuple(end), tuple(away), arrowprops=arrow)

    def _patch(self, z: Complex, lift: float) -> tuple[Array, Array]:
        """Quads between points of a grid, (quads, 4, 3), and how light falls on them."""
        points = self._place(z.ravel(), lift).T.reshape(*z.shape, 4)
        corners = [points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]]
        quads, sunk = np.split(np.stack(corners, axis=2).reshape(-1, 4, 4), [3], axis=2)
        normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        normal *= np.sign(normal[:, 2:] + 1e-9)
        bright = np.clip(normal @ _LIGHT, 0.0, 1.0)
        shadow = 1.0 - 0.26 * np.clip(sunk.mean(axis=(1, 2)) / 8.0, 0.0, 1.0) ** 1.5
        return quads, (0.58 + 0.42 * bright + 0.08 * bright**30) * shadow


def _page(points: Array) -> Array:
    """Project points (..., 3) to the page, (..., 2)."""
    up = points[..., 1] * np.sin(_TILT) + points[..., 2] * np.cos(_TILT)
    return np.stack([points[..., 0], up], axis=-1)


def _depth(quads: Array) -> Array:
    """How near quads are to the viewer, (quads,)."""
    middle = quads.mean(axis=1)
    return np.asarray(middle[:, 2] * np.sin(_TILT) - middle[:, 1] * np.cos(_TILT))
