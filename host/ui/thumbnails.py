"""Small pictures of the dome with the heat map of one image."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pygame

from controller.shared.protocol.codec import image_from_bytes
from host.ui import dome
from host.ui.pointer_input import DomeArea
from tetris.kit.theme import Colour


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
