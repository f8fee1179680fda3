"""Fingers drawn on the dome that show a gesture as the mouse makes it; pure functions of time."""

import math
from dataclasses import dataclass, replace
from typing import Final

from controller.shared.protocol.messages import Contact
from host.ui.pointer_input import TURN_DEG, DomeArea, PointerInput

PERIOD_S: Final = 2.2  # from one showing of a gesture to the next
_LEAD_S: Final = 0.6  # before the fingers are down
_SINK_S: Final = 0.25  # in which they come down, and rise
_RIM: Final = 0.9  # of the dome's radius, where the drag of a twist goes


@dataclass(frozen=True, slots=True)
class Stroke:
    """What the pointer does for a gesture."""

    hold_s: float  # how long the button is down
    pinch: bool = False  # whether it is the right button
    arc_deg: tuple[float, float] | None = None  # ends of a drag round the rim; None: a press
    pace: float = 1.0  # of the fingers' closing, as a share of the mouse's: it can be followed


STROKES: Final = {
    "press": Stroke(0.6),
    "pinch": Stroke(0.8, pinch=True, pace=0.25),
    "twist_cw": Stroke(0.8, arc_deg=(130.0, 50.0)),
    "twist_ccw": Stroke(0.8, arc_deg=(50.0, 130.0)),
}
"""By the labels of the gestures that ship; others are shown by no ghost."""


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
    pointer = PointerInput(pad)
    if stroke.arc_deg is not None:
        first, last = stroke.arc_deg
        pointer.press(*_on_rim(pad, first - math.copysign(2 * TURN_DEG, last - first)), 0.0)
        pointer.move(*_on_rim(pad, first))  # the hand has come down
        pointer.move(*_on_rim(pad, first + (last - first) * _eased(now_s / stroke.hold_s)))
    else:
        pointer.press(*place, 0.0, pinch=stroke.pinch)
    fingers = pointer.contacts(now_s * stroke.pace)
    return tuple(replace(finger, depth_mm=depth * finger.depth_mm) for finger in fingers)


def _on_rim(pad: DomeArea, degrees: float) -> tuple[float, float]:
    """Return a point of the rim, grid units; degrees run counterclockwise from the right."""
    reach, (x, y) = _RIM * pad.radius, pad.centre
    return x + reach * math.cos(math.radians(degrees)), y + reach * math.sin(math.radians(degrees))


def _eased(share: float) -> float:
    """Return a share of the way, 0 to 1; hands start and stop gently."""
    return share * share * (3 - 2 * share)
