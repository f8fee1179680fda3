"""A ghost hand: fingers that show a gesture as the mouse makes it, and their drawing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import pygame

from controller.shared.protocol.messages import Contact
from host.ui import sprites
from host.ui.pointer_input import TURN_DEG, DomeArea, PointerInput
from tetris.kit.theme import Colour

PERIOD_S: Final = 2.2  # from one showing of a gesture to the next
_LEAD_S: Final = 0.6  # before the fingers are down
_SINK_S: Final = 0.15  # in which they come down, and rise: what lands more slowly is a rest
_RIM: Final = 0.9  # of the dome's radius, where the drag of a twist goes
_HAND: Final = (0.30, 0.75)  # right and down: where a hand comes from, as a part of the direction
_LENGTH: Final = 5.0  # of a finger, in its own radii
_STEPS: Final = 24  # circles that a finger is made of
_OPAQUE: Final = 150  # of its tip, 0 to 255; its other end is transparent
_FIRM_MM: Final = 7.0  # depth at which the ring is tight
_WIDE: Final = 2.4  # radii of the ring of a finger that does not touch yet
_FILL: Final = (255, 240, 232)


@dataclass(frozen=True, slots=True)
class Stroke:
    """What the pointer does for a gesture."""

    hold_s: float  # how long the button is down
    pinch: bool = False  # whether it is the right button
    arc_deg: tuple[float, float] | None = None  # ends of a drag round the rim; None: a press
    deeper_s: float | None = None  # of a light touch, when it presses deeper; None: a usual one
    pace: float = 1.0  # of the fingers' closing, as a share of the mouse's: it can be followed


STROKES: Final = {
    "press": Stroke(0.6),
    "touch": Stroke(1.2, deeper_s=math.inf),
    "deeper": Stroke(1.0, deeper_s=0.5),
    "pinch": Stroke(0.8, pinch=True, pace=0.25),
    "twist_cw": Stroke(0.8, arc_deg=(130.0, 50.0)),
    "twist_ccw": Stroke(0.8, arc_deg=(50.0, 130.0)),
}
"""By the labels of the gestures that ship, and touches of Aim; others are shown by no ghost."""


def contacts(
    label: str, place: tuple[float, float], time_s: float, pad: DomeArea
) -> tuple[Contact, ...]:
    """Return the fingers of a gesture that is shown over and over, at a time since the beginning.

    `place` is where a press or a pinch is made, grid units. Without fingers: in the pause between
    two showings, and for a gesture that has no stroke. Fingers that come or go have less depth.
    """
    stroke, at_s = STROKES.get(label), time_s % PERIOD_S - _LEAD_S
    if stroke is None or not -_SINK_S <= at_s < stroke.hold_s + _SINK_S:
        return ()
    now_s = min(max(at_s, 0.0), stroke.hold_s)
    depth = 1.0 - abs(at_s - now_s) / _SINK_S
    pointer = PointerInput(pad, light=stroke.deeper_s is not None)
    if stroke.arc_deg is not None:
        first, last = stroke.arc_deg
        pointer.press(*_on_rim(pad, first - math.copysign(2 * TURN_DEG, last - first)), 0.0)
        pointer.move(*_on_rim(pad, first))  # the hand has come down
        share = now_s / stroke.hold_s
        eased = share * share * (3 - 2 * share)  # hands start and stop gently
        pointer.move(*_on_rim(pad, first + (last - first) * eased))
    else:
        pointer.press(*place, 0.0, pinch=stroke.pinch)
        if stroke.deeper_s is not None:
            pointer.deepen(stroke.deeper_s)
    fingers = pointer.contacts(now_s * stroke.pace)
    return tuple(replace(finger, depth_mm=depth * finger.depth_mm) for finger in fingers)


def _on_rim(pad: DomeArea, degrees: float) -> tuple[float, float]:
    """Return a point of the rim, grid units; degrees run counterclockwise from the right."""
    reach, (x, y) = _RIM * pad.radius, pad.centre
    return x + reach * math.cos(math.radians(degrees)), y + reach * math.sin(math.radians(degrees))


def draw(
    surface: pygame.Surface,
    fingers: Sequence[tuple[Contact, tuple[float, float], float]],
    tint: Colour,
) -> None:
    """Draw translucent fingers, each with its tip's place and radius in pixels; rings in a tint."""
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
