"""Drawing of a ghost hand: translucent fingers on the dome, each with a soft ring at its tip."""

import math
from collections.abc import Sequence
from typing import Final

import pygame

from controller.shared.protocol.messages import Contact
from host.ui import sprites
from tetris.kit.theme import Colour

_HAND: Final = (0.30, 0.75)  # right and down: where a hand comes from, as a part of the direction
_LENGTH: Final = 5.0  # of a finger, in its own radii
_STEPS: Final = 24  # circles that a finger is made of
_OPAQUE: Final = 150  # of its tip, 0 to 255; its other end is transparent
_FIRM_MM: Final = 7.0  # depth at which the ring is tight
_WIDE: Final = 2.4  # radii of the ring of a finger that does not touch yet
_FILL: Final = (255, 240, 232)


def draw(
    surface: pygame.Surface,
    fingers: Sequence[tuple[Contact, tuple[float, float], float]],
    tint: Colour,
) -> None:
    """Draw fingers, each with its tip's place and radius in pixels; the ring in a tint."""
    if not fingers:
        return
    middle = [sum(place[axis] for _, place, _ in fingers) / len(fingers) for axis in (0, 1)]
    for contact, place, radius in fingers:
        firm = min(1.0, max(0.0, contact.depth_mm / _FIRM_MM))
        size = max(3.0, radius)
        _finger(surface, place, size, _direction(place, middle))
        wide = round(size * (_WIDE - (_WIDE - 1.25) * firm))
        alpha = sprites.in_steps(70 + 170 * firm)
        halo = sprites.ring(wide, 0.16 * size, tint, alpha, alpha // 5)
        surface.blit(halo, halo.get_rect(center=place))


def _direction(place: tuple[float, float], middle: Sequence[float]) -> tuple[float, float]:
    """Return the unit vector from a tip along its finger: away from the others, and downwards."""
    across, down = place[0] - middle[0], place[1] - middle[1]
    apart = math.hypot(across, down) or 1.0
    across, down = across / apart + _HAND[0], down / apart + _HAND[1]
    length = math.hypot(across, down) or 1.0
    return across / length, down / length


def _finger(
    surface: pygame.Surface,
    tip: tuple[float, float],
    radius: float,
    direction: tuple[float, float],
) -> None:
    reach = radius * (_LENGTH + 1.5)
    picture = pygame.Surface((round(2 * reach), round(2 * reach)), pygame.SRCALPHA)
    for step in range(_STEPS, -1, -1):  # from the hand to the tip: each covers the one before
        share = step / _STEPS
        at = [reach + part * radius * _LENGTH * share for part in direction]
        alpha = round(_OPAQUE * (1 - share) ** 1.5)
        pygame.draw.circle(picture, (*_FILL, alpha), at, radius * (0.9 + 0.25 * share))
    surface.blit(picture, picture.get_rect(center=(round(tip[0]), round(tip[1]))))
