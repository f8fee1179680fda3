"""Content of the phone's page, and its messages as contacts on the virtual dome; pure.

The page sends JSON: first a string, the key of an earlier connection or "", and then lists of
fingers, each [number, x, y, radius, pressure]. Their lengths are in radii of the dome, from its
centre: x to the right, y up. A radius of 0 is unknown, and so is a pressure of 0.5.
"""

import base64
import io
import json
import math
from functools import lru_cache
from typing import Any, Final

import pygame

from controller.shared.protocol.messages import Contact
from host.ui import naming, zones
from host.ui.orb_state import OrbState
from host.ui.pointer_input import FINGER_RADIUS_MM, PRESS_DEPTH_MM, DomeArea
from tetris.kit.language import Words
from tetris.kit.theme import DARK
from tetris.window.tiles import colours

MAX_FINGERS: Final = 10
_FIRST: Final = 32  # number of a phone's first contact; those of mouse and screen are lower
_LIGHT_MM, _PER_PRESSURE_MM = 7.0, 4.0  # depth: at 0.5 that of a click on the dome
_RADII_MM: Final = (6.0, 8.5)  # of fingertips
_ZONES_PX: Final = 160  # radius of their picture
_WORDS: Final = ("connecting", "lost", "taken", "ended")
_COLOURS: Final = {mark: f"rgb{colour}" for mark, colour in colours(DARK).items()}


def value(text: str | bytes) -> Any:
    """Return the value of a message; ValueError if it is no JSON text."""
    try:
        return json.loads(text if isinstance(text, str) else "")
    except RecursionError:
        raise ValueError("a message must be no deeper than a list of fingers") from None


def contacts(text: str | bytes, pad: DomeArea) -> tuple[Contact, ...]:
    """Return the fingers of a message; ValueError unless all are numbered and on the dome."""
    fingers = value(text)
    if not isinstance(fingers, list) or len(fingers) > MAX_FINGERS:
        raise ValueError(f"a message must be a list of at most {MAX_FINGERS} fingers")
    found = tuple(_contact(finger, pad) for finger in fingers)
    if len({contact.id for contact in found}) < len(found):
        raise ValueError("two fingers have one number")
    return found


def _contact(finger: Any, pad: DomeArea) -> Contact:
    if not isinstance(finger, list) or [type(one) in (int, float) for one in finger] != [True] * 5:
        raise ValueError("a finger must be five numbers")
    number, x, y, radius, pressure = finger
    if number not in range(MAX_FINGERS) or not (0 <= radius <= 1 and 0 <= pressure <= 1):
        raise ValueError(f"number, radius or pressure of {finger} is out of range")
    if not (abs(x) <= 1 and abs(y) <= 1 and math.hypot(x, y) <= 1):
        raise ValueError(f"finger {finger} must be on the dome")
    (least, most), radius_mm = _RADII_MM, radius * pad.radius * pad.pitch_mm
    place = pad.centre[0] + x * pad.radius, pad.centre[1] + y * pad.radius
    return Contact(
        _FIRST + int(number),
        *place,
        (_LIGHT_MM + _PER_PRESSURE_MM * pressure) * pad.press_mm(*place) / PRESS_DEPTH_MM,
        min(most, max(least, radius_mm or FINGER_RADIUS_MM)),
    )


def view(orb: OrbState, words: Words, pad: DomeArea, now_s: float) -> dict[str, Any]:
    """Return what the page shows, ready for JSON."""
    rules = zones.rules_in_use(orb.gestures.values())
    touch = orb.contacts[0] if orb.contacts else None
    lit = zones.zone_at(rules, (touch.x, touch.y)) if touch else None
    status = f"orbs.link_{orb.link}"
    if orb.link == "live" and orb.welcome:
        ready = "phone.aim" if orb.columns else "phone.touch"
        ready = ready if orb.ready else "dome.calibrating"
        status = ready if orb.welcome.virtual else "phone.real"
    return {
        "words": {"language": words.name, **{key: words(f"phone.{key}") for key in _WORDS}},
        "status": words(status),
        "last": _last(orb, words, now_s),
        "commanded_s": orb.last_s,  # it vibrates at a new one
        "zones": _zones(rules, orb.columns, pad, lit),
        "board": list(orb.board),
        "colours": _COLOURS,
    }


def _last(orb: OrbState, words: Words, now_s: float) -> str:
    """Return the last command, or why a touch gave none, while it is news."""
    if last := orb.latest(now_s):
        return f"{naming.gesture(words, last.label)} → {naming.command(words, last.name)}"
    reason = orb.reason_unanswered(now_s)
    return naming.unanswered(words, reason) if reason else ""


@lru_cache(maxsize=64)
def _zones(
    rules: zones.Rules, columns: zones.Columns | None, pad: DomeArea, lit: int | None
) -> str:
    """Return the address of a picture of the zones that contains it, over the dome's square."""
    if not (rules or columns):
        return ""
    file = io.BytesIO()
    if columns:
        picture = zones.columns_picture(columns, pad, _ZONES_PX)
    else:
        picture = zones.picture(rules, pad, _ZONES_PX, lit)
    pygame.image.save(picture, file, "zones.png")
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
