"""Pointer input: mouse and touch screen to fingers on the virtual orb; no pixels, no clock.

Everything is in grid units, x to the right and y up, as the player sees the dome.
A mouse has three ways to touch:

- **press**: the left button holds one finger where the pointer is, and drags it along;
- **pinch**: the right button, or the left one in two-finger mode, holds two opposing
  fingers round the pointer that close in while it stays down;
- **twist**: a press that starts on the rim, outside the taxels, lays thumb and fingers on the
  dome, and they turn as the pointer goes round.

The fingers of a touch screen and of a phone pass through as they are, several at once.
"""

import math
from collections.abc import Hashable
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from controller.protocol.messages import Contact, Contacts

PRESS_DEPTH_MM: Final = 9.0  # the middle of the simulated hands, 6.5 to 12 mm
FINGER_RADIUS_MM: Final = 7.0  # half an index finger's width
PINCH_DEPTH_MM: Final = 7.0  # gripping fingers sink in less than a pressing one
PINCH_OPEN_MM: Final = 17.0  # half the distance of the fingers when they come down
PINCH_CLOSED_MM: Final = 7.0  # and when they have closed: nearly touching
PINCH_CLOSE_S: Final = 0.1  # as quick as a click
PINCH_REACH: Final = 1.5  # grid units; keeps both fingers of a pinch on the dome
TWIST_DEPTH_MM: Final = 7.0
TWIST_RING_MM: Final = 18.0  # a hand's grip on the dome, 15 to 21 mm
# Where the fingers of a twist come down: a thumb below and three fingers above, as a hand does.
# Four fingers at right angles would look the same to 25 taxels whichever way they turn.
TWIST_FINGERS_DEG: Final = (270.0, 57.0, 90.0, 123.0)
RIM_MARGIN: Final = 0.55  # grid units beyond the outer taxels, where the rim begins
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
        return math.hypot(x - self.centre[0], y - self.centre[1]) <= self.radius

    def on_rim(self, x: float, y: float) -> bool:
        """Whether a point lies on the membrane outside the square of the taxels."""
        across, up = abs(x - self.centre[0]), abs(y - self.centre[1])
        outside = across > self.centre[0] + RIM_MARGIN or up > self.centre[1] + RIM_MARGIN
        return outside and self.on_dome(x, y)

    def clamp(self, x: float, y: float, reach: float) -> tuple[float, float]:
        """Return the nearest point within `reach` grid units of the centre."""
        across, up = x - self.centre[0], y - self.centre[1]
        distance = math.hypot(across, up)
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
    `phone` holds the fingers on a phone's page.
    """

    pad: DomeArea = field(default_factory=DomeArea)
    two_fingers: bool = False
    mode: Mode | None = None
    phone: tuple[Contact, ...] = ()
    _pointer: tuple[float, float] = (0.0, 0.0)
    _since_s: float = 0.0
    _angle: float = 0.0
    _screen: dict[Hashable, Contact] = field(default_factory=dict)
    _sent: tuple[Contact, ...] = ()
    _sent_s: float = -math.inf
    _key_used: bool = False

    def press(self, x: float, y: float, now_s: float, *, pinch: bool = False) -> bool:
        """Put the mouse's finger or fingers down; return whether the dome was hit."""
        if self.mode is not None or not self.pad.on_dome(x, y):
            return False
        if pinch or self.two_fingers:
            self.mode = Mode.PINCH
        else:
            self.mode = Mode.TWIST if self.pad.on_rim(x, y) else Mode.PRESS
        self._key_used = True
        self._pointer, self._since_s = (x, y), now_s
        self._angle = self._angle_of(x, y)
        return True

    def move(self, x: float, y: float) -> None:
        """Follow the pointer; it matters only while a button is down."""
        self._pointer = (x, y)
        if self.mode is Mode.TWIST and self._far_from_centre(x, y):
            self._angle = self._angle_of(x, y)

    def release(self) -> None:
        """Lift what the mouse holds down."""
        self.mode = None

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
        self._screen[finger] = self._contact(number, x, y, PRESS_DEPTH_MM)

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
        mouse: list[Contact] = []
        if self.mode is Mode.PRESS:
            mouse = [self._contact(0, *self._pointer, PRESS_DEPTH_MM)]
        elif self.mode is Mode.PINCH:
            mouse = self._pinch(now_s - self._since_s)
        elif self.mode is Mode.TWIST:
            mouse = self._twist()
        return (*mouse, *self._screen.values(), *self.phone)[:MAX_CONTACTS]

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

    def _pinch(self, held_s: float) -> list[Contact]:
        closed = min(1.0, max(0.0, held_s / PINCH_CLOSE_S))
        eased = closed * closed * (3 - 2 * closed)  # hands start and stop gently
        apart_mm = PINCH_OPEN_MM + (PINCH_CLOSED_MM - PINCH_OPEN_MM) * eased
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
            for number, angle in enumerate(angles)
        ]

    def _contact(self, number: int, x: float, y: float, depth_mm: float) -> Contact:
        x, y = self.pad.clamp(x, y, self.pad.radius * EDGE)
        return Contact(number, x, y, depth_mm, FINGER_RADIUS_MM)

    def _free_number(self) -> int:
        taken = {contact.id for contact in self._screen.values()}
        return next(n for n in range(MOUSE_FINGERS, 256) if n not in taken)

    def _angle_of(self, x: float, y: float) -> float:
        return math.atan2(y - self.pad.centre[1], x - self.pad.centre[0])

    def _far_from_centre(self, x: float, y: float) -> bool:
        return math.hypot(x - self.pad.centre[0], y - self.pad.centre[1]) > DEAD_CENTRE
