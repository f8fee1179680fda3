"""The phone's page: its fingers as contacts, and what it shows of the orb; pure."""

from typing import Final

from controller.protocol.messages import Contact
from host.phone.messages import Finger, View, Zone
from host.ui import naming, zones
from host.ui.orb_state import OrbState
from host.ui.pointer_input import FINGER_RADIUS_MM, DomeArea
from tetris.window.language import Words

_FIRST: Final = 32  # contact numbers of a phone's fingers; those of mouse and screen are lower
_LIGHT_MM: Final = 7.0  # depth without any pressure; 0.5 gives that of a click on the dome
_PER_PRESSURE_MM: Final = 4.0
_RADIUS_MM: Final = (6.0, 8.5)  # of fingertips
_PAGE_WORDS: Final = ("connecting", "lost", "taken", "ended")


def contacts(fingers: tuple[Finger, ...], pad: DomeArea) -> tuple[Contact, ...]:
    """Return a phone's fingers as contacts on the virtual dome."""
    return tuple(_contact(finger, pad) for finger in fingers)


def _contact(finger: Finger, pad: DomeArea) -> Contact:
    least, most = _RADIUS_MM
    radius_mm = finger.radius * pad.radius * pad.pitch_mm
    x, y = pad.centre
    return Contact(
        _FIRST + finger.number,
        x + finger.x * pad.radius,
        y + finger.y * pad.radius,
        _LIGHT_MM + _PER_PRESSURE_MM * finger.pressure,
        min(most, max(least, radius_mm)) if radius_mm else FINGER_RADIUS_MM,
    )


def view(orb: OrbState, words: Words, pad: DomeArea, now_s: float) -> View:
    """Return the page's content."""
    shown = {name: words(f"phone.{name}") for name in _PAGE_WORDS}
    commanded_s = orb.history[-1].time_s if orb.history else 0.0
    rules = zones.rules_in_use(orb.gestures.values())
    return View(
        {"language": words.name, **shown},
        _status(orb, words),
        _last(orb, words, now_s),
        commanded_s,
        _zones(rules, words, pad),
    )


def _status(orb: OrbState, words: Words) -> str:
    if orb.link != "live":
        return words(f"orbs.link_{orb.link}")
    if orb.welcome is not None and not orb.welcome.virtual:
        return words("phone.real")
    return words("phone.touch" if orb.ready else "dome.calibrating")


def _last(orb: OrbState, words: Words, now_s: float) -> str:
    """Return the last gesture and its command, or why a touch gave none, while it is news."""
    if last := orb.latest(now_s):
        return f"{naming.gesture(words, last.label)} → {naming.command(words, last.command)}"
    reason = orb.reason_unanswered(now_s)
    return naming.unanswered(words, reason) if reason else ""


def _zones(rules: zones.Rules, words: Words, pad: DomeArea) -> tuple[Zone, ...]:
    """Return the rules' rectangles in radii of the dome, cut off at its square."""

    def along(value: float, middle: float) -> float:
        return max(-1.0, min(1.0, (value - middle) / pad.radius))

    x, y = pad.centre
    return tuple(
        Zone(
            *(along(rule.right_of, x), along(rule.left_of, x)),
            *(along(rule.above, y), along(rule.below, y)),
            "" if rule.command in zones.NONE else naming.command(words, rule.command),
            at,
        )
        for rule, at in zip(rules, zones.places(rules, pad), strict=True)
        if at is not None
    )
