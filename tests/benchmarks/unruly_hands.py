"""Hands of the benchmark of unruly hands: touches between what rests and what presses.

Each kind of touch is drawn by code of its own, not by the simulated hand's gesture files. Its
strength, 0 to 1, goes from almost nothing to the greatest that its docstring names.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from controller.shared.aliases import Array, Complex
from controller.simulator.hand.gesture import min_jerk

PLACE_MM: Final = 20.0  # half of the side of the square in which presses lie
REACH_MM: Final = 33.0  # fingers beyond it are on the rim

Rng = np.random.Generator


@dataclass(frozen=True, slots=True)
class Finger:
    """One contact: a path between keys, minimum jerk from each to the next.

    Attributes:
        t_s: Time of each key.
        depth_mm: Indentation at each key; 0 at the first and the last.
        point: Where it is at each key, complex mm from the dome's centre; on the rim if beyond.
        radius_mm: Radius of the contact.
        tremble: Relative amplitude of a 6 Hz oscillation of the depth.
    """

    t_s: Sequence[float]
    depth_mm: Sequence[float]
    point: Sequence[complex]
    radius_mm: float
    tremble: float = 0.0

    def track(self, time_s: Array) -> tuple[Complex, Array]:
        """Return point and depth at each time, (steps,) each."""
        point = np.full(len(time_s), self.point[0], dtype=np.complex128)
        depth = np.zeros(len(time_s))
        for i in range(1, len(self.t_s)):
            span_s = max(self.t_s[i] - self.t_s[i - 1], 1e-3)
            share = min_jerk((time_s - self.t_s[i - 1]) / span_s)
            point += share * (self.point[i] - self.point[i - 1])
            depth += share * (self.depth_mm[i] - self.depth_mm[i - 1])
        point *= np.minimum(1.0, REACH_MM / np.maximum(np.abs(point), 1.0))
        depth *= 1.0 + self.tremble * np.sin(2 * np.pi * 6.0 * (time_s - self.t_s[0]))
        return point, np.maximum(depth, 0.0)


@dataclass(frozen=True, slots=True)
class Expected:
    """A gesture that shall answer a touch.

    Attributes:
        label: The gesture.
        at_s: When its first finger lands, from the touch's begin; it is answered later.
        point: Where, complex mm from the dome's centre; None: its place does not matter.
    """

    label: str
    at_s: float = 0.0
    point: complex | None = None


@dataclass(frozen=True, slots=True)
class Touch:
    """The contacts of one touch.

    Attributes:
        fingers: One a contact.
        expected: Gestures that shall answer it, in order.
        optional: Gestures that may answer it before these, all of them or none.
    """

    fingers: Sequence[Finger]
    expected: Sequence[Expected] = ()
    optional: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Person:
    """What the touches of one person share."""

    depth_mm: float  # of a press
    radius_mm: float  # of a fingertip
    land_s: float  # from the first contact to full depth

    @classmethod
    def draw(cls, rng: Rng) -> "Person":
        """Draw a person."""
        return cls(rng.uniform(6.5, 12.0), rng.uniform(5.0, 9.0), rng.uniform(0.08, 0.16))

    def press(
        self, rng: Rng, at_s: float, point: complex, depth_mm: float, hold_s: float
    ) -> Finger:
        """Return a finger that presses at a point."""
        down_s = self.land_s * float(np.exp(rng.normal(0.0, 0.15)))
        times = np.cumsum([at_s, down_s, hold_s, down_s]).tolist()
        return Finger(times, (0.0, depth_mm, depth_mm, 0.0), [point] * 4, self.radius_mm)


Draw = Callable[[Person, Rng, float], Touch]


def _place(rng: Rng, most_mm: float = PLACE_MM) -> complex:
    return complex(*rng.uniform(-most_mm, most_mm, 2))


def _way(rng: Rng) -> complex:
    return complex(np.exp(1j * rng.uniform(0.0, 2 * np.pi)))


def _press(person: Person, rng: Rng, depth_mm: float, hold_s: float, tremble: float = 0.0) -> Touch:
    point = _place(rng)
    finger = replace(person.press(rng, 0.0, point, depth_mm, hold_s), tremble=tremble)
    return Touch([finger], (Expected("press", 0.0, point),))


def slide(person: Person, rng: Rng, strength: float) -> Touch:
    """A press that slides up to 25 mm before it lifts; it counts where it began."""
    begin = _place(rng, 15.0)
    away = 25.0 * strength * _way(rng)
    if abs(begin + away) > 28.0:
        away = -away * min(1.0, 13.0 / abs(away)) if abs(begin - away) > 28.0 else -away
    depth, down_s = person.depth_mm, person.land_s
    wait_s = max(0.0, rng.uniform(-0.15, 0.15))
    times = np.cumsum([0.0, down_s, wait_s, rng.uniform(0.2, 0.6), down_s])
    points = [begin, begin, begin, begin + away, begin + away]
    finger = Finger(times.tolist(), (0.0, depth, depth, depth, 0.0), points, person.radius_mm)
    return Touch([finger], (Expected("press", 0.0, begin),))


def spread_fingers(person: Person, rng: Rng, strength: float) -> Touch:
    """Two fingers that land together and part by up to 28 mm: a pinch backwards."""
    middle, way = _place(rng, 5.0), _way(rng)
    first, last = rng.uniform(6.0, 9.0), rng.uniform(9.0, 11.0) + 9.0 * strength
    times = np.cumsum([0.0, person.land_s, rng.uniform(0.25, 0.5), 0.15, person.land_s]).tolist()
    fingers = []
    for side in (way, -way):
        depth = 0.7 * person.depth_mm * float(np.exp(rng.normal(0.0, 0.1)))
        near, far = middle + first * side, middle + last * side
        points = [near, near, far, far, far]
        fingers.append(Finger(times, (0, depth, depth, depth, 0), points, 0.9 * person.radius_mm))
    return Touch(fingers)


def resting_hand(person: Person, rng: Rng, strength: float) -> Touch:
    """Two to five fingers and perhaps a palm that lie on the dome, about 6 mm deep, for seconds."""
    middle, yaw = _place(rng, 8.0), _way(rng)
    stay_s, fingers = rng.uniform(1.5, 4.0), []
    for number in range(int(rng.integers(2, 6))):
        slow_s = rng.uniform(0.4, 0.9)
        times = np.cumsum([rng.uniform(0.0, 0.2), slow_s, stay_s, slow_s]).tolist()
        depth = max(0.3, 6.0 * strength * float(np.exp(rng.normal(0.0, 0.2))))
        angle = np.exp(1j * np.radians(-50.0 + 28.0 * number))
        point = middle + rng.uniform(14.0, 20.0) * yaw * angle
        fingers.append(Finger(times, (0, depth, depth, 0), [point] * 4, person.radius_mm))
    if rng.random() < 0.5:
        times = np.cumsum([rng.uniform(0.1, 0.4), 0.6, stay_s, 0.6]).tolist()
        depth = 5.0 * strength + 0.3
        point = middle - rng.uniform(8.0, 14.0) * yaw
        fingers.append(Finger(times, (0, depth, depth, 0), [point] * 4, rng.uniform(14.0, 20.0)))
    return Touch(fingers)


def bump(person: Person, rng: Rng, strength: float) -> Touch:
    """An elbow or a palm, 14 to 25 mm wide, that hits the dome, up to 10 mm deep."""
    point, depth = _place(rng), 0.5 + 9.5 * strength
    down_s = rng.uniform(0.05, 0.15)
    times = np.cumsum([0.0, down_s, rng.uniform(0.0, 0.2), down_s]).tolist()
    return Touch([Finger(times, (0, depth, depth, 0), [point] * 4, rng.uniform(14.0, 25.0))])


def resting_thumb(person: Person, rng: Rng, strength: float) -> Touch:
    """A thumb that lies flat, up to 6 mm deep, while a finger presses twice elsewhere."""
    thumb, depth = _place(rng, 16.0), 0.5 + 5.5 * strength
    finger = thumb
    while abs(finger - thumb) < 18.0:
        finger = _place(rng)
    slow_s = rng.uniform(0.4, 0.8)
    times = np.cumsum([0.0, slow_s, 2.6, slow_s]).tolist()
    lying = Finger(times, (0, depth, depth, 0), [thumb] * 4, rng.uniform(9.0, 12.0))
    presses = [
        person.press(rng, slow_s + at_s, finger, person.depth_mm, rng.uniform(0.15, 0.4))
        for at_s in (0.6, 1.6)
    ]
    expected = [Expected("press", press.t_s[0], finger) for press in presses]
    return Touch([lying, *presses], expected, optional=("press",))


def _twist(
    person: Person, rng: Rng, middle: complex, wind_deg: float, turn_deg: float
) -> tuple[list[Finger], str]:
    """Return the fingers of a twist, wound up in contact before it turns, and its gesture."""
    sign, yaw = float(rng.choice([-1.0, 1.0])), _way(rng)
    wind_s = rng.uniform(0.1, 0.25) if wind_deg else 0.0
    times = np.cumsum([0.0, person.land_s, wind_s, rng.uniform(0.3, 0.7), 0.1, person.land_s])
    angles = np.radians(sign * np.array([0.0, 0.0, -wind_deg, *[turn_deg - wind_deg] * 3]))
    fingers = []
    count = int(rng.integers(2, 5))
    for stand in (180.0, *(30.0 * (np.arange(count) - (count - 1) / 2))):
        depth = 0.65 * person.depth_mm * float(np.exp(rng.normal(0.0, 0.12)))
        arm = rng.uniform(15.0, 21.0) * yaw * np.exp(1j * np.radians(stand + rng.normal(0.0, 5.0)))
        points = [middle + arm * np.exp(1j * angle) for angle in angles]
        depths = (0, depth, depth, depth, depth, 0)
        fingers.append(Finger(times.tolist(), depths, points, 0.9 * person.radius_mm))
    return fingers, "twist_ccw" if sign > 0 else "twist_cw"


def wind_up(person: Person, rng: Rng, strength: float) -> Touch:
    """A twist that first turns back, in contact, by up to 30 degrees."""
    turn_deg = rng.uniform(45.0, 70.0) + 15.0 * strength
    fingers, label = _twist(person, rng, _place(rng, 3.0), 30.0 * strength, turn_deg)
    return Touch(fingers, (Expected(label),))


def off_middle(person: Person, rng: Rng, strength: float) -> Touch:
    """A twist up to 14 mm from the dome's middle."""
    middle = 14.0 * strength * _way(rng)
    fingers, label = _twist(person, rng, middle, 0.0, rng.uniform(40.0, 70.0))
    return Touch(fingers, (Expected(label),))


def light(person: Person, rng: Rng, strength: float) -> Touch:
    """A press of 2 to 5 mm."""
    return _press(person, rng, 2.0 + 3.0 * strength, rng.uniform(0.15, 0.5))


def trembling(person: Person, rng: Rng, strength: float) -> Touch:
    """A press whose depth trembles at 6 Hz by up to 60 %, no deeper than 15 mm."""
    tremble = 0.6 * strength
    depth = min(person.depth_mm, 15.0 / (1.0 + tremble))
    return _press(person, rng, depth, rng.uniform(0.3, 1.0), tremble)


def press_in_pinch(person: Person, rng: Rng, strength: float) -> Touch:
    """A press, 1.1 to .1 s after a pinch has closed that is still held."""
    middle, way = _place(rng, 4.0), _way(rng)
    begin_s = 0.1 + 1.0 - strength
    times = np.cumsum([0.0, person.land_s, rng.uniform(0.25, 0.4), begin_s + 0.8, 0.12]).tolist()
    fingers = []
    for side in (way, -way):
        depth = 0.7 * person.depth_mm * float(np.exp(rng.normal(0.0, 0.1)))
        far, near = middle + rng.uniform(15.0, 18.0) * side, middle + rng.uniform(6.0, 9.0) * side
        points = [far, far, near, near, near]
        fingers.append(Finger(times, (0, depth, depth, depth, 0), points, 0.9 * person.radius_mm))
    point = middle
    while min(abs(point - middle - reach * way) for reach in (-8.0, 8.0)) < 17.0:
        point = _place(rng)
    third = person.press(rng, times[2] + begin_s, point, person.depth_mm, rng.uniform(0.15, 0.4))
    expected = Expected("pinch"), Expected("press", third.t_s[0], point)
    return Touch([*fingers, third], expected)


def losing_air(person: Person, rng: Rng, strength: float) -> Touch:
    """A press or a twist on a dome that has lost up to a fifth of its pressure."""
    if rng.random() < 0.5:
        return _press(person, rng, person.depth_mm, rng.uniform(0.15, 0.5))
    return off_middle(person, rng, 0.2)


def short(person: Person, rng: Rng, strength: float) -> Touch:
    """A lone click with 60 to 100 ms of contact, as quick as a pointer's."""
    contact_s = 0.06 + 0.04 * strength
    depth = min(person.depth_mm, 150.0 * contact_s / 2)
    times, point = (0.0, contact_s / 2, contact_s), _place(rng)
    finger = Finger(times, (0.0, depth, 0.0), [point] * 3, 7.0)
    return Touch([finger], (Expected("press", 0.0, point),))


def lean(person: Person, rng: Rng, strength: float) -> Touch:
    """A palm or a forearm, 14 to 25 mm wide, that leans on the dome and moves, 10 mm deep."""
    point, depth, slow_s = _place(rng), 0.5 + 9.5 * strength, rng.uniform(0.4, 1.0)
    times = np.cumsum([0.0, slow_s, rng.uniform(1.0, 4.0), slow_s]).tolist()
    moved = point + rng.uniform(0.0, 6.0) * _way(rng)
    points = [point, point, moved, moved]
    return Touch([Finger(times, (0, depth, depth, 0), points, rng.uniform(14.0, 25.0))])


def two_at_once(person: Person, rng: Rng, strength: float) -> Touch:
    """Two fingers that press left and right, up to .1 s apart: both in order, or nothing."""
    way, apart_mm = np.exp(1j * rng.uniform(-0.5, 0.5)), rng.uniform(20.0, 30.0)
    middle, side = _place(rng, 4.0), float(rng.choice([-1.0, 1.0]))
    fingers, hold_s = [], rng.uniform(0.15, 0.4)
    for at_s, where in ((0.0, side), (0.1 * strength, -side)):
        depth = min(15.0, person.depth_mm * float(np.exp(rng.normal(0.0, 0.1))))
        point = middle + where * way * apart_mm / 2
        fingers.append(person.press(rng, at_s, point, depth, hold_s))
    return Touch(fingers, optional=("press", "press"))


def quick_finger(person: Person, rng: Rng, strength: float) -> Touch:
    """A finger that lands quickly, up to 10 mm deep, and stays up to 3 s: a press, if anything."""
    point, depth = _place(rng), 0.5 + 9.5 * strength
    times = np.cumsum([0.0, rng.uniform(0.05, 0.25), rng.uniform(0.05, 3.0), 0.15]).tolist()
    finger = Finger(times, (0, depth, depth, 0), [point] * 4, rng.uniform(5.0, 9.0))
    return Touch([finger], (Expected("press", 0.0, point),))


HANDS: Final[dict[str, Draw]] = {
    "slide": slide,
    "spread": spread_fingers,
    "rest": resting_hand,
    "bump": bump,
    "thumb": resting_thumb,
    "wind_up": wind_up,
    "off_middle": off_middle,
    "light": light,
    "trembling": trembling,
    "press_in_pinch": press_in_pinch,
    "losing_air": losing_air,
    "short": short,
    "lean": lean,
    "two_at_once": two_at_once,
    "quick_finger": quick_finger,
}
