"""Small pictures of the dome: with the heat map of one image, or with arrows on it."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import pygame

from controller.shared.protocol.codec import image_from_bytes
from host.ui import dome
from host.ui.pointer_input import DomeArea
from tetris.kit.theme import Colour

_REACH: Final = 0.62  # of the radius: where an arrow ends
_HEAD: Final = 0.24  # length of its head
ROTATIONS: Final = {"none": (20.0,), "half": (20.0, 200.0), "all": tuple(range(20, 380, 60))}
"""Directions of the arrows, degrees, that show under which turns a gesture is the same."""


class Base(NamedTuple):
    """The dome without anything on it: its radius, pixels, and the colours of its base."""

    radius_px: int
    plate: Colour
    line: Colour


@lru_cache(maxsize=64)
def thumbnail(image: bytes, rows: int, columns: int, base: Base) -> pygame.Surface:
    """Return the dome with an image of `quantise_image` at its full contrast.

    An image of another size is left out.
    """
    picture = dome.balloon(*base).copy()
    if len(image) == rows * columns:
        deviation = np.asarray(image_from_bytes(image), np.float32).reshape(rows, columns) - 1.0
        deviation *= dome.FULL_SCALE / max(float(np.abs(deviation).max()), 1e-3)
        field = dome.HeatMap().draw(deviation, DomeArea(rows, columns).radius, 2 * base.radius_px)
        picture.blit(field, field.get_rect(center=picture.get_rect().center))
    return picture


@lru_cache(maxsize=16)
def arrows(degrees: Sequence[float], base: Base, colour: Colour) -> pygame.Surface:
    """Return the dome with arrows from its middle in directions, degrees counter-clockwise."""
    picture = dome.balloon(*base).copy()
    start = 0.16 if len(degrees) > 1 else -_REACH
    neck, half, barb = _REACH - _HEAD, 0.05, _HEAD / 2
    back = [(neck, -barb), (neck, -half), (start, -half), (start, half), (neck, half), (neck, barb)]
    for each in degrees:
        points = [pygame.Vector2(at).rotate(-each) for at in ((_REACH, 0.0), *back)]
        middle = picture.get_rect().center
        pygame.draw.polygon(picture, colour, [base.radius_px * at + middle for at in points])
    return picture


@lru_cache(maxsize=16)
def hooks(both: bool, base: Base, colour: Colour) -> pygame.Surface:
    """Return the dome with a hook drawn on it, or with the hook and its mirror image."""
    picture = dome.balloon(*base).copy()
    x, y = picture.get_rect().center
    wide = max(2, base.radius_px // 9)
    for side in (1, -1) if both else (1,):
        start = x + side * 0.14 * base.radius_px
        corner = start, y + 0.4 * base.radius_px
        points = (
            (start, y - 0.5 * base.radius_px),
            corner,
            (start + side * 0.36 * base.radius_px, corner[1]),
        )
        pygame.draw.lines(picture, colour, False, points, wide)
    return picture
