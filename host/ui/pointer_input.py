"""Pointer input: mouse and touch screen to fingers on the virtual orb; no pixels, no clock.

Everything is in grid units, x to the right and y up, as the player sees the dome.
A mouse has three ways to touch:

- **press**: the left button holds one finger where the pointer is, and drags it along; the wheel,
  or the right button meanwhile, presses it deeper for a moment;
- **pinch**: the right button, or the left one in two-finger mode, anywhere, holds two opposing
  fingers about the dome's middle, as a hand does, that close in, to the end even if it is only
  clicked;
- **twist**: the left button on the rim, outside the taxels, and going round by some degrees lays
  thumb and fingers on the dome, and they turn as the pointer goes on.

So the finger of a press on the rim waits until the pointer rests, or the button is up again, and
stays for as long as the button was down. It lands where the button went down, and follows then.

The fingers of a touch screen and of a phone pass through as they are, several at once.
"""

import math
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Final

from controller.shared.protocol.messages import Contact, Contacts

PRESS_DEPTH_MM: Final = 9.0  # the middle of the simulated hands, 6.5 to 12 mm
LIGHTER_MM: Final = 4.0  # so much less: from there, deeper shows best
RIM_DEPTH_MM: Final = 13.0  # firm, as one press in twenty of those: the taxels feel it little
RIM_LEAST_S: Final = 0.12  # a shorter click there is as long
RIM_SHARES: Final = (0.53, 0.79)  # of the dome's radius, between which a press gets firmer
DEEPER_MM, DEEPER_S = 7.0, 0.25  # a deeper press: by how much, and how long with the way back
DEEPEN_S: Final = 0.08  # and the way there
ALONE_S: Final = 0.2  # so much later a second finger belongs to no gesture of two
FINGER_RADIUS_MM: Final = 7.0  # half an index finger's width
PINCH_DEPTH_MM: Final = 7.0  # gripping fingers sink in less than a pressing one
PINCH_OPEN_MM: Final = 17.0  # half the distance of the fingers when they come down
PINCH_CLOSED_MM: Final = 7.0  # and when they have closed: nearly touching
PINCH_CLOSE_S: Final = 0.1  # as quick as a click
PINCH_LEAST_S: Final = 0.15  # a shorter click is a whole pinch, too
PINCH_REACH: Final = 0.5  # grid units from the middle; 1 away, pinches are taken for presses
TWIST_DEPTH_MM: Final = 7.0
TWIST_RING_MM: Final = 18.0  # a hand's grip on the dome, 15 to 21 mm
# Where the fingers of a twist come down: a thumb below and three fingers above, as a hand does.
# Four fingers at right angles would look the same to 25 taxels whichever way they turn.
TWIST_FINGERS_DEG: Final = (270.0, 57.0, 90.0, 123.0)
TURN_DEG: Final = 8.0  # how far the pointer goes round before a press becomes a twist
TURN_SLANT: Final = 0.5  # of its way round: how far it may go in or out on it
REST_S: Final = 0.2  # after pressing a button a hand moves within this time, or rests
FOLLOW_S: Final = 0.3  # in which a finger that waited slides to the pointer
REST_DEG: Final = 0.5  # a pointer that goes round by less rests: two pixels
RIM_MARGIN: Final = 0.55  # grid units beyond the outer taxels, where the rim begins
CORNER_MARGIN: Final = 0.2  # grid units beyond the corner taxels, alike
SKIRT: Final = 1.8  # grid units from the outer taxel to the clamp: 38 mm dome, 10 mm pitch
EDGE: Final = 0.96  # of the dome's radius: a finger slides along the clamp, never over it
DEAD_CENTRE: Final = 0.3  # grid units; nearer to the centre an angle means nothing

SEND_EVERY_S: Final = 1 / 60  # a moving finger is sent at most this often
KEEP_ALIVE_S: Final = 0.1  # a resting finger is repeated, so that silence means loss
MOUSE_FINGERS: Final = 8  # contact numbers below this are the mouse's
MAX_SCREEN_FINGERS: Final = 10
MAX_CONTACTS: Final = 16  # in a message

_EPSILON_S = 1e-6  # ticks are sums of 1/60 s in floating point


class Mode(Enum):
    """Gesture of the mouse on the dome."""

    PRESS = "press"
    PINCH = "pinch"
    TWIST = "twist"


@dataclass(frozen=True, slots=True)
class DomeArea:
    """Area of the dome in grid units."""

    rows: int = 5
    columns: int = 5
    pitch_mm: float = 10.0

    @property
    def centre(self) -> tuple[float, float]:
        """The middle of the taxels, which is the top of the dome."""
        return (self.columns - 1) / 2, (self.rows - 1) / 2

    @property
    def radius(self) -> float:
        """From the centre to the clamp, grid units: 3.8 on the paper's 5×5."""
        return (max(self.rows, self.columns) - 1) / 2 + SKIRT

    def on_dome(self, x: float, y: float) -> bool:
        """Whether a point lies on the membrane."""
        return self.distance(x, y) <= self.radius

    def on_rim(self, x: float, y: float) -> bool:
        """Whether a point is outside the taxels: beyond their sides, or their corners."""
        across, up = abs(x - self.centre[0]), abs(y - self.centre[1])
        outside = across > self.centre[0] + RIM_MARGIN or up > self.centre[1] + RIM_MARGIN
        return outside or self.distance(x, y) > math.hypot(*self.centre) + CORNER_MARGIN

    def press_mm(self, x: float, y: float) -> float:
        """Return how deep a finger presses at a point."""
        first, last = RIM_SHARES
        share = min(max((self.distance(x, y) / self.radius - first) / (last - first), 0.0), 1.0)
        return PRESS_DEPTH_MM + (RIM_DEPTH_MM - PRESS_DEPTH_MM) * share

    def distance(self, x: float, y: float) -> float:
        """Return how far a point is from the centre, grid units."""
        return math.hypot(x - self.centre[0], y - self.centre[1])

    def clamp(self, x: float, y: float, reach: float) -> tuple[float, float]:
        """Return the nearest point within `reach` grid units of the centre."""
        across, up = x - self.centre[0], y - self.centre[1]
        distance = self.distance(x, y)
        if distance <= reach:
            return x, y
        return (
            self.centre[0] + across * reach / distance,
            self.centre[1] + up * reach / distance,
        )


@dataclass
class PointerInput:
    """Fingers on the dome, and when to send them to the device.

    Positions are in grid units, times in seconds of any clock that never turns back.
    `two_fingers` makes the left button pinch; see `hold_two` for the key that switches it.
    `phone` holds the fingers on a phone's page. `light`: a single finger leaves room to be pressed
    deeper, by a second one, too.
    """

    pad: DomeArea = field(default_factory=DomeArea)
    two_fingers: bool = False
    mode: Mode | None = None
    phone: tuple[Contact, ...] = ()
    light: bool = False
    _pointer: tuple[float, float] = (0.0, 0.0)
    _began: tuple[float, float] = (0.0, 0.0)
    _since_s: float = 0.0
    _up: bool = False  # the button is up
    _down_s: float = 0.0  # when the fingers came down; infinite: they wait
    _until_s: float = math.inf  # when they are lifted
    _deeper_s: float = -math.inf  # since when the finger is pressed deeper
    _alone: tuple[int, float] = (-1, 0.0)  # a single finger, and since when
    _second_s: float = math.inf  # since when a second one is beside it
    _rim: bool = False  # the pointer has not left the rim since the press
    _angle: float = 0.0
    _round: float = 0.0  # how far the pointer has gone round, radians
    _rest: tuple[float, float] = (0.0, 0.0)  # since when the pointer rests, and the angle there
    _screen: dict[Hashable, Contact] = field(default_factory=dict)
    _sent: tuple[Contact, ...] = ()
    _sent_s: float = -math.inf
    _key_used: bool = False

    def press(self, x: float, y: float, now_s: float, *, pinch: bool = False) -> bool:
        """Put the mouse's finger or fingers down; return whether the dome was hit."""
        if (self.mode is not None and not self._up) or not self.pad.on_dome(x, y):
            return False
        self.mode = Mode.PINCH if pinch or self.two_fingers else Mode.PRESS
        self._key_used, self._up, self._deeper_s = True, False, -math.inf
        self._alone = (-1, 0.0)
        self._began = self._pointer = x, y
        self._angle, self._round = self._angle_of(x, y), 0.0
        self._rim = self.mode is Mode.PRESS and self.pad.on_rim(x, y)
        self._since_s, self._rest = now_s, (now_s, 0.0)
        self._down_s, self._until_s = math.inf if self._rim else now_s, math.inf
        return True

    def move(self, x: float, y: float) -> None:
        """Follow the pointer; it matters only while a button is down."""
        if self._up:
            return
        self._pointer = (x, y)
        self._rim = self._rim and self.pad.distance(x, y) > max(self.pad.centre)
        if self.pad.distance(x, y) > DEAD_CENTRE:
            angle = self._angle_of(x, y)
            self._round += math.remainder(angle - self._angle, math.tau)
            self._angle = angle
        if self._rim and self.mode is Mode.PRESS and abs(self._round) >= math.radians(TURN_DEG):
            self._rim = self._goes_round()
            self.mode = Mode.TWIST if self._rim else Mode.PRESS

    def release(self) -> None:
        """Lift what the mouse holds down, as soon as it has been down for long enough."""
        self._up = True

    def deepen(self, now_s: float) -> None:
        """Press the mouse's finger deeper, for a moment."""
        if now_s >= self._deeper_s + DEEPER_S:
            self._deeper_s = now_s

    def hold_two(self, down: bool) -> None:
        """Take the two-finger key: a tap switches the mode, a hold lends it for one touch."""
        if down:
            self.two_fingers, self._key_used = not self.two_fingers, False
        elif self._key_used:
            self.two_fingers = False

    def finger(self, finger: Hashable, x: float, y: float, *, down: bool = False) -> None:
        """Put one finger of a touch screen down, or move it; it slides along the dome's edge."""
        known = self._screen.get(finger)
        room = len(self._screen) < MAX_SCREEN_FINGERS
        if known is None and not (down and room and self.pad.on_dome(x, y)):
            return
        number = known.id if known else self._free_number()
        self._screen[finger] = self._contact(number, x, y, self.pad.press_mm(x, y))

    def finger_up(self, finger: Hashable) -> None:
        """Lift one finger of a touch screen."""
        self._screen.pop(finger, None)

    def lift_all(self) -> None:
        """Lift everything, as when the window loses the focus."""
        self.mode = None
        self.two_fingers = False
        self.phone = ()
        self._screen.clear()

    def contacts(self, now_s: float) -> tuple[Contact, ...]:
        """Return every finger that is on the dome at a time, the mouse's first."""
        self._follow_button(now_s)
        mouse: list[Contact] = []
        if self.mode is Mode.PRESS and now_s >= self._down_s:
            place = self._finger(now_s)
            mouse = [self._contact(0, *place, self.pad.press_mm(*place) + self._deeper_mm(now_s))]
        elif self.mode is Mode.PINCH:
            mouse = self._pinch(now_s - self._since_s)
        elif self.mode is Mode.TWIST:
            mouse = self._twist()
        found = (*mouse, *self._screen.values(), *self.phone)[:MAX_CONTACTS]
        return self._lighter(found, now_s) if self.light else found

    def update(self, now_s: float) -> Contacts | None:
        """Return what is to be sent now, if anything: changes at 60 Hz, repeats at 10 Hz."""
        contacts = self.contacts(now_s)
        waited_s = now_s - self._sent_s + _EPSILON_S
        lifted = not contacts and bool(self._sent)
        moved = contacts != self._sent and waited_s >= SEND_EVERY_S
        stale = bool(contacts) and waited_s >= KEEP_ALIVE_S
        if not (lifted or moved or stale):
            return None
        self._sent, self._sent_s = contacts, now_s
        return Contacts(contacts)

    def _lighter(self, found: tuple[Contact, ...], now_s: float) -> tuple[Contact, ...]:
        """Return a single finger less deep, and deeper again while a second one is beside it."""
        one = next((contact for contact in found if contact.id == self._alone[0]), None)
        if len(found) == 1:
            self._alone = self._alone if one else (found[0].id, now_s)
            self._second_s, one = math.inf, found[0]
        elif one and len(found) == 2:
            self._second_s = min(self._second_s, now_s)
        if one is None or len(found) > 2 or self._second_s < self._alone[1] + ALONE_S:
            self._alone = (-1, 0.0)
            return found
        deeper_mm = DEEPER_MM * _eased(max(0.0, now_s - self._second_s) / DEEPEN_S)
        return (replace(one, depth_mm=one.depth_mm - LIGHTER_MM + deeper_mm),)

    def _follow_button(self, now_s: float) -> None:
        """Put the finger of a press on the rim down once it is one, and lift what is over."""
        rest_s, rest = self._rest
        if abs(self._round - rest) > math.radians(REST_DEG):
            self._rest = rest_s, rest = now_s, self._round
        if self._down_s == math.inf and (
            self._up or not self._rim or now_s - rest_s >= REST_S - _EPSILON_S
        ):
            self._down_s = now_s
        if self._up and self._until_s == math.inf:
            self._until_s = now_s
            if self.mode is Mode.PRESS:
                least_s = RIM_LEAST_S if self._down_s > self._since_s else 0.0
                self._until_s = self._down_s + max(now_s - self._since_s, least_s)
                self._until_s = max(self._until_s, self._deeper_s + DEEPER_S)
            elif self.mode is Mode.PINCH:
                self._until_s = max(now_s, self._since_s + PINCH_LEAST_S)
        if now_s >= self._until_s - _EPSILON_S:
            self.mode = None

    def _finger(self, now_s: float) -> tuple[float, float]:
        """Return where the finger of a press is: where it landed, then where the pointer is."""
        if self._down_s == self._since_s:
            return self._pointer
        (x, y), (to_x, to_y) = self._began, self._pointer
        share = _eased((now_s - self._down_s) / FOLLOW_S)
        return x + share * (to_x - x), y + share * (to_y - y)

    def _deeper_mm(self, now_s: float) -> float:
        """Return how much deeper than a press the finger is."""
        passed_s = max(0.0, now_s - self._deeper_s)
        return DEEPER_MM * _eased(min(passed_s, DEEPER_S - passed_s) / DEEPEN_S)

    def _pinch(self, held_s: float) -> list[Contact]:
        closed = _eased(held_s / PINCH_CLOSE_S)
        apart_mm = PINCH_OPEN_MM + (PINCH_CLOSED_MM - PINCH_OPEN_MM) * closed
        x, y = self.pad.clamp(*self._pointer, PINCH_REACH)
        apart = apart_mm / self.pad.pitch_mm
        return [
            self._contact(number, x + side * apart, y, PINCH_DEPTH_MM)
            for number, side in enumerate((-1, 1))
        ]

    def _twist(self) -> list[Contact]:
        ring = TWIST_RING_MM / self.pad.pitch_mm
        x, y = self.pad.centre
        angles = [math.radians(degrees) + self._angle for degrees in TWIST_FINGERS_DEG]
        return [
            self._contact(
                number, x + ring * math.cos(angle), y + ring * math.sin(angle), TWIST_DEPTH_MM
            )
            for number, angle in enumerate(angles, 1)  # the finger of the press is another
        ]

    def _contact(self, number: int, x: float, y: float, depth_mm: float) -> Contact:
        x, y = self.pad.clamp(x, y, self.pad.radius * EDGE)
        return Contact(number, x, y, depth_mm, FINGER_RADIUS_MM)

    def _free_number(self) -> int:
        taken = {contact.id for contact in self._screen.values()}
        return next(n for n in range(MOUSE_FINGERS, 256) if n not in taken)

    def _angle_of(self, x: float, y: float) -> float:
        return math.atan2(y - self.pad.centre[1], x - self.pad.centre[0])

    def _goes_round(self) -> bool:
        """Whether the pointer has gone round rather than in or out."""
        begun = self.pad.distance(*self._began)
        strayed = abs(self.pad.distance(*self._pointer) - begun)
        return strayed <= TURN_SLANT * abs(self._round) * begun


def _eased(share: float) -> float:
    """Return the share of a way after a share of its time: hands start and stop gently."""
    share = min(1.0, max(0.0, share))
    return share * share * (3 - 2 * share)
