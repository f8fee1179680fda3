"""Picture of the dome: a lit balloon, and the heat map of the taxels on it.

The balloon is drawn once per size, in NumPy, with soft edges. The field is drawn for every
picture: a small image is looked up in one table of colours and scaled up, which costs less than
a millisecond.
"""

from functools import lru_cache
from typing import Any, Final

import numpy as np
import pygame
from numpy.typing import NDArray

from tetris.kit.theme import DARK, Colour

Array = NDArray[np.floating[Any]]

_LARGEST: Final = 320  # radius in pixels that is drawn; a larger dome is scaled up
PADDING: Final = 0.16  # of the radius, round the dome, for its base and shadow
FIELD: Final = 96  # pixels along a side of the small image of the field
FULL_SCALE: Final = 0.45  # |z - 1| at which the colours are full: a deep pinch, simulated
HEAT_LEVELS: Final = 255
SHADE_LEVELS: Final = 127
RELIEF: Final = 0.9  # how strongly a dent catches the light

_LIGHT = np.array([-0.46, 0.58, 0.67], np.float32)  # from the upper left, y up, z to the player
_SKIN = np.array([255, 132, 88], np.float32)
_GLOW = np.array([255, 98, 52], np.float32)  # light that has gone through the rubber
_DEEP = np.array([92, 22, 26], np.float32)
_SKIRT: Final = (0.62, 0.25, 0.0)  # of the outer taxel's value, 1, 2, 3 steps outside it
_MASKS: Final = (0xFF0000, 0xFF00, 0xFF, 0xFF000000)  # of 0xAARRGGBB
# z - 1 from most negative to most positive: the dent is cold, the bulge hot.
_RAMP: Final = (
    (-1.00, (226, 252, 255, 250)),
    (-0.62, (96, 222, 255, 242)),
    (-0.34, (40, 152, 240, 226)),
    (-0.20, (40, 96, 204, 150)),
    (-0.08, (60, 60, 160, 0)),
    (0.05, (255, 170, 60, 0)),
    (0.15, (255, 176, 60, 120)),
    (0.36, (255, 205, 84, 214)),
    (0.66, (255, 236, 160, 242)),
    (1.00, (255, 255, 244, 252)),
)


def _smooth(edge_low: float, edge_high: float, value: Array) -> Array:
    """Return the smooth step of values of any shape, 0 below the low edge, 1 above the high one."""
    t = np.clip((value - edge_low) / (edge_high - edge_low), 0.0, 1.0)
    return np.asarray(t * t * (3 - 2 * t), np.float32)


def _normals(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Return the unit normals of an inflated membrane over the unit disc, each (height, width)."""
    inside = np.minimum(x * x + y * y, 1.0)
    slope = 0.86 / np.sqrt(1.07 - inside)  # steep at the clamp, flat on top
    nx, ny = x * slope, y * slope
    length = np.sqrt(nx * nx + ny * ny + 1.0)
    return nx / length, ny / length, 1.0 / length


def _lit(x: Array, y: Array) -> Array:
    """Return the colours of the rubber at each point, (height, width, 3), 0 to 255."""
    nx, ny, nz = _normals(x, y)
    light = _LIGHT / np.linalg.norm(_LIGHT)
    facing = nx * light[0] + ny * light[1] + nz * light[2]
    wrapped = np.clip(facing * 0.68 + 0.32, 0.0, 1.0) ** 1.45
    radius = np.sqrt(x * x + y * y)
    colour = _DEEP + (_SKIN - _DEEP) * (0.10 + 0.86 * wrapped)[..., None]
    # A thin wall lets light through where it leaves on the far side, and gathers it at the rim.
    through = _smooth(0.35, 1.0, radius) * np.clip(0.55 - facing, 0.0, 1.0)
    colour += _GLOW * (0.42 * through)[..., None]
    colour *= (1.0 - 0.42 * _smooth(0.90, 1.0, radius))[..., None]
    # Highlights: a broad sheen, then the reflection of a soft box, as on a photographed balloon.
    rx, ry = 2 * nz * nx, 2 * nz * ny
    sheen = np.exp(-((rx - light[0]) ** 2 + (ry - light[1]) ** 2) / 0.20)
    colour += (46.0 * sheen)[..., None] * np.array([1.0, 0.86, 0.78], np.float32)
    u, v = (rx + 0.57) * 0.8 + (ry - 0.68) * 0.6, -(rx + 0.57) * 0.6 + (ry - 0.68) * 0.8
    box = _smooth(0.30, 0.04, np.abs(u)) * _smooth(0.17, 0.0, np.abs(v))
    colour += (104.0 * box)[..., None] * np.array([0.8, 0.95, 1.0], np.float32)
    rim = _smooth(0.86, 0.975, radius) * np.clip(-facing + 0.30, 0.0, 1.0)
    colour += (rim * 0.5)[..., None] * np.array([255, 176, 150], np.float32)
    return np.asarray(colour, np.float32)


@lru_cache(maxsize=8)
def balloon(
    radius_px: int, plate: Colour = DARK.raised, line: Colour = DARK.line
) -> pygame.Surface:
    """Return the dome on its base of two colours, with its shadow, seen from above.

    The surface is square, with the dome's centre in its middle; `PADDING` of the radius lies
    round the dome.
    """
    size = round(2 * radius_px * (1 + PADDING))
    if radius_px > _LARGEST:
        return pygame.transform.smoothscale(balloon(_LARGEST, plate, line), (size, size))
    axis = (np.arange(size, dtype=np.float32) + 0.5 - size / 2) / radius_px
    x, y = np.meshgrid(axis, -axis)
    radius = np.sqrt(x * x + y * y)
    pixel = 1.2 / radius_px
    picture = np.zeros((size, size, 4), np.float32)

    def lay(colour: Array | float, alpha: Array) -> None:
        """Lay a colour, (height, width, 3) or black, over the picture; alpha is (height, width)."""
        cover = alpha[..., None]
        picture[...] *= 1 - cover
        picture[..., :3] += colour * cover
        picture[..., 3:] += cover

    base = 1.0 + PADDING * 0.56
    dark = 1.0 - 0.6 * float(np.mean(plate)) / 255  # shadows on a light plate are lighter
    shade = np.sqrt((x - 0.02) ** 2 + (y + 0.03) ** 2)
    lay(0.0, 0.7 * dark * _smooth(base + 0.035, base - 0.10, shade))
    raised = np.array(plate, np.float32) * (1.0 + 0.30 * (y - x))[..., None]
    lay(np.minimum(raised, 255), _smooth(base + pixel, base - pixel, radius))
    ring = np.exp(-(((radius - base + 0.012) / (0.9 * pixel + 0.004)) ** 2))
    edge = np.array(line, np.float32) * (1.25 + 0.5 * (y - x))[..., None]
    lay(np.minimum(edge, 255), 0.9 * ring)
    lay(0.0, 0.75 * dark * _smooth(1.09, 0.985, radius))
    lay(_lit(x, y), _smooth(1.0 + pixel, 1.0 - pixel, radius))

    picture[..., :3] /= np.maximum(picture[..., 3:], 1e-6)  # colours were weighted by their alpha
    picture[..., 3] *= 255
    return _surface(np.rint(np.clip(picture, 0, 255)).astype(np.uint8))


@lru_cache(maxsize=4)
def rim(radius_px: int, colour: Colour) -> pygame.Surface:
    """Return a soft ring of light round the dome, on a square as large as `balloon`'s."""
    size = round(2 * radius_px * (1 + PADDING))
    axis = ((np.arange(size, dtype=np.float32) + 0.5) - size / 2) / radius_px
    away = np.hypot(axis[None, :], axis[:, None]) - 1.02
    rgba = np.empty((size, size, 4), np.uint8)
    rgba[..., :3] = colour
    rgba[..., 3] = 255 * np.exp(-((away / np.where(away > 0, 0.055, 0.03)) ** 2))
    return _surface(rgba)


def _surface(rgba: NDArray[np.uint8]) -> pygame.Surface:
    """Return the surface of pixels, (height, width, 4)."""
    height, width = rgba.shape[:2]
    surface = pygame.image.frombuffer(np.ascontiguousarray(rgba).tobytes(), (width, height), "RGBA")
    return surface.convert_alpha() if pygame.display.get_surface() else surface.copy()


@lru_cache(maxsize=1)
def _colours() -> NDArray[np.uint32]:
    """Return 0xAARRGGBB of each heat and shade, (HEAT_LEVELS * SHADE_LEVELS,), shade fastest."""
    stops = np.array([stop for stop, _ in _RAMP], np.float32)
    table = np.array([colour for _, colour in _RAMP], np.float32)
    heat = np.linspace(-1, 1, HEAT_LEVELS, dtype=np.float32)
    rgba = np.stack([np.interp(heat, stops, table[:, k]) for k in range(4)], axis=1)
    shade = np.linspace(-1, 1, SHADE_LEVELS, dtype=np.float32)
    tone = np.where(shade > 0, 255.0, 0.0)[None, :, None]
    cover = (np.abs(shade) * 0.62)[None, :, None]
    alpha = rgba[:, None, 3:] / 255.0
    total = cover + alpha * (1 - cover)
    rgb = (tone * cover + rgba[:, None, :3] * alpha * (1 - cover)) / np.maximum(total, 1e-6)
    levels = np.rint(np.clip(np.concatenate([rgb, total * 255], axis=2), 0, 255)).astype(np.uint32)
    packed = levels[..., 3] << 24 | levels[..., 0] << 16 | levels[..., 1] << 8 | levels[..., 2]
    return np.ascontiguousarray(packed.reshape(-1), np.uint32)


@lru_cache(maxsize=8)
def _weights(taxels: int, radius: float) -> tuple[Array, Array]:
    """Return cubic weights (FIELD, taxels) that spread taxels over the dome, and their slopes.

    The kernel is Mitchell and Netravali's with B = C = 1/3: smooth, hardly any overshoot.
    """

    def kernel(t: Array) -> Array:
        """Return the weights at distances, (FIELD, taxels), in taxels."""
        t = np.abs(t)
        near = (7 * t**3 - 12 * t**2 + 16 / 3) / 6
        far = (-7 / 3 * t**3 + 12 * t**2 - 20 * t + 32 / 3) / 6
        return np.asarray(np.where(t < 1, near, np.where(t < 2, far, 0.0)), np.float32)

    line = ((np.arange(FIELD, dtype=np.float32) + 0.5) / FIELD * 2 - 1) * radius
    # Between the outer taxels and the clamp nothing is felt: let the field fade out there.
    beyond = len(_SKIRT)
    skirt = np.zeros((taxels + 2 * beyond, taxels), np.float32)
    skirt[beyond:-beyond] = np.eye(taxels)
    skirt[:beyond, 0], skirt[-beyond:, -1] = _SKIRT[::-1], _SKIRT
    places = np.arange(-beyond, taxels + beyond, dtype=np.float32)
    away = line[:, None] + (taxels - 1) / 2 - places[None, :]
    step = np.float32(0.05)
    slope = (kernel(away + step) - kernel(away - step)) / (2 * step)
    return kernel(away) @ skirt, np.asarray(slope @ skirt, np.float32)


@lru_cache(maxsize=1)
def _inside() -> Array:
    """Return the opacity of the field, (FIELD, FIELD): 1 on the dome, 0 at the clamp."""
    line = (np.arange(FIELD, dtype=np.float32) + 0.5) / FIELD * 2 - 1
    x, y = np.meshgrid(line, -line)
    return _smooth(0.985, 0.72, np.sqrt(x * x + y * y))


class HeatMap:
    """The heat map of one dome: z - 1 in, a surface with transparency out."""

    def __init__(self) -> None:
        self._small = pygame.Surface((FIELD, FIELD), pygame.SRCALPHA, 32, _MASKS)

    def draw(self, deviation: Array, radius: float, side_px: int) -> pygame.Surface:
        """Return the field of z - 1, (rows, columns), over the square round the dome.

        The radius is the dome's in grid units, the side its diameter on the screen.
        """
        rows, columns = deviation.shape
        down, down_slope = _weights(rows, radius)
        along, along_slope = _weights(columns, radius)
        spread = deviation @ along.T
        inside = _inside()
        heat = (down @ spread) * inside
        # A dent is lower than its surroundings, so its slopes turn to and from the light.
        across = down @ (deviation @ along_slope.T)
        downward = down_slope @ spread
        shade = (-across * _LIGHT[0] + downward * _LIGHT[1]) * inside
        hot = np.clip((heat / FULL_SCALE + 1) * (HEAT_LEVELS // 2) + 0.5, 0, HEAT_LEVELS - 1)
        lit = np.clip(
            (shade * (RELIEF / FULL_SCALE) + 1) * (SHADE_LEVELS // 2) + 0.5, 0, SHADE_LEVELS - 1
        )
        index = hot.astype(np.intp) * SHADE_LEVELS + lit.astype(np.intp)
        pixels = _colours().take(index)
        view = pygame.surfarray.pixels2d(self._small)
        view[:] = pixels.T
        del view  # unlocks the surface
        return pygame.transform.smoothscale(self._small, (side_px, side_px))
