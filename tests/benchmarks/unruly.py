"""Hands that no training drew: slides, resting hands, bumps, wind-up, trembling, lost pressure.

    python -m tests.benchmarks.unruly [--touches N] [--people N] [--seed N] [--hands A,B]
                                      [--bundle FILE] [--json]

Each row is a kind of touch, drawn by code of its own, not by the simulated hand's gesture files.
Its strength is uniform between almost nothing and the greatest that its docstring names; results
stand by thirds of it. People, orbs and seeds are of a family that no training uses. A touch is
right if the gestures that answer it until half a second after the last finger has left are the
expected ones, each once and in order. `false` is the share of touches with an unexpected answer.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.recognition.debounce import fire, smooth
from controller.shared.aliases import Array, Complex, Frames
from controller.simulator.dome.faults import Fault
from controller.simulator.hand.gesture import min_jerk
from controller.simulator.hand.performance import SLOTS
from controller.simulator.orb import PRESETS, OrbSimulator, preset
from models.evaluation.replay import Batched, network_inputs, spread

from .results import Results, command_line, say

RATE_HZ: Final = 40.0
DOMAIN: Final = 8  # a family of seeds of its own
PLACE_MM: Final = 20.0  # half of the side of the square in which presses lie
LEAD_S: Final = 3.0  # the rest image is found
PAUSE_S: Final = (0.9, 1.6)  # from one touch to the next
LATE_S: Final = 0.5  # after the last finger has left, in which an answer still belongs to a touch
PITCH_MM: Final = 10.0

Rng = np.random.Generator


@dataclass(frozen=True, slots=True)
class Finger:
    """One contact: a path between keys, minimum jerk from each to the next.

    Attributes:
        t_s: Time of each key.
        depth_mm: Indentation at each key; 0 at the first and the last.
        point: Where it is at each key, complex mm from the dome's centre.
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
        depth *= 1.0 + self.tremble * np.sin(2 * np.pi * 6.0 * (time_s - self.t_s[0]))
        return point, np.maximum(depth, 0.0)


@dataclass(frozen=True, slots=True)
class Touch:
    """The contacts of one touch, and the gestures that shall answer it, in order."""

    fingers: Sequence[Finger]
    expected: tuple[str, ...] = ()
    optional: str = ""  # a gesture that may answer once beside them, before all others

    def right(self, answers: Sequence[str]) -> bool:
        """Return whether the answers are the expected ones."""
        return tuple(answers) in (self.expected, (self.optional, *self.expected))

    def unexpected(self, answers: Sequence[str]) -> bool:
        """Return whether an answer was not expected, or came twice."""
        left = [self.optional, *self.expected] if self.optional else list(self.expected)
        for one in answers:
            if one not in left:
                return True
            left.remove(one)
        return False


@dataclass(frozen=True, slots=True)
class Person:
    """What the touches of one person share."""

    depth_mm: float  # of a press
    radius_mm: float  # of a fingertip
    land_s: float  # from the first contact to full depth

    @classmethod
    def draw(cls, rng: Rng) -> "Person":
        """Draw a person."""
        return cls(rng.uniform(6.5, 12.0), rng.uniform(6.0, 8.5), rng.uniform(0.08, 0.16))

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


def slide(person: Person, rng: Rng, strength: float) -> Touch:
    """A press that slides up to 25 mm before it lifts; it stays on the dome."""
    begin = _place(rng, 15.0)
    away = 25.0 * strength * _way(rng)
    if abs(begin + away) > 28.0:
        away = -away * min(1.0, 13.0 / abs(away)) if abs(begin - away) > 28.0 else -away
    depth, down_s = person.depth_mm, person.land_s
    wait_s = max(0.0, rng.uniform(-0.15, 0.15))
    times = np.cumsum([0.0, down_s, wait_s, rng.uniform(0.2, 0.6), down_s])
    points = [begin, begin, begin, begin + away, begin + away]
    finger = Finger(times.tolist(), (0.0, depth, depth, depth, 0.0), points, person.radius_mm)
    return Touch([finger], ("press",))


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
    """Two to five fingers and perhaps a palm that lie on the dome, up to 6 mm deep, for seconds."""
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
    return Touch([lying, *presses], ("press", "press"), optional="press")


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
    return Touch(fingers, (label,))


def off_middle(person: Person, rng: Rng, strength: float) -> Touch:
    """A twist up to 14 mm from the dome's middle."""
    middle = 14.0 * strength * _way(rng)
    fingers, label = _twist(person, rng, middle, 0.0, rng.uniform(40.0, 70.0))
    return Touch(fingers, (label,))


def light(person: Person, rng: Rng, strength: float) -> Touch:
    """A press of 2 to 5 mm."""
    depth, hold_s = 2.0 + 3.0 * strength, rng.uniform(0.15, 0.5)
    return Touch([person.press(rng, 0.0, _place(rng), depth, hold_s)], ("press",))


def trembling(person: Person, rng: Rng, strength: float) -> Touch:
    """A press whose depth trembles at 6 Hz by up to 60 %."""
    finger = person.press(rng, 0.0, _place(rng), person.depth_mm, rng.uniform(0.3, 1.0))
    return Touch([replace(finger, tremble=0.6 * strength)], ("press",))


def press_in_pinch(person: Person, rng: Rng, strength: float) -> Touch:
    """A press, .25 to 1 s after a pinch began that is still held."""
    middle, way = _place(rng, 4.0), _way(rng)
    begin_s = 0.5 + 0.75 * (1.0 - strength)
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
    return Touch([*fingers, third], ("pinch", "press"))


def losing_air(person: Person, rng: Rng, strength: float) -> Touch:
    """A press or a twist on a dome that loses a fifth of its pressure in 50 s."""
    if rng.random() < 0.5:
        hold_s = rng.uniform(0.15, 0.5)
        return Touch([person.press(rng, 0.0, _place(rng), person.depth_mm, hold_s)], ("press",))
    return off_middle(person, rng, 0.2)


def short(person: Person, rng: Rng, strength: float) -> Touch:
    """A lone click with 60 to 100 ms of contact, as quick as a pointer's."""
    contact_s = 0.06 + 0.04 * strength
    depth = min(person.depth_mm, 150.0 * contact_s / 2)
    times = (0.0, contact_s / 2, contact_s)
    return Touch([Finger(times, (0.0, depth, 0.0), [_place(rng)] * 3, 7.0)], ("press",))


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
}


@dataclass(slots=True)
class Tally:
    """Outcomes of touches of one strength."""

    touches: int = 0
    right: int = 0
    unexpected: int = 0


def session(
    hand: str, name: str, seed: int, number: int, count: int
) -> tuple[Frames, list[tuple[float, float, Touch, float]]]:
    """Return frames of one person on one orb, and begin, end, touch and strength of each touch."""
    rng = np.random.default_rng([DOMAIN, seed, number, list(HANDS).index(hand)])
    person, touches, now = Person.draw(rng), [], LEAD_S
    for _ in range(count):
        strength = rng.uniform()
        touch = HANDS[hand](person, rng, strength)
        end = now + max(finger.t_s[-1] for finger in touch.fingers)
        touches.append((now, end, touch, strength))
        now = end + rng.uniform(*PAUSE_S)
    simulator = OrbSimulator(
        np.random.SeedSequence([DOMAIN, seed, number]), RATE_HZ, model=preset(name)
    )
    if hand == "losing_air":
        simulator.electronics.switch([Fault.parse("air_leak=0.24")])
    step_hz = RATE_HZ * simulator.steps_per_frame
    steps = int(now * RATE_HZ + RATE_HZ) * simulator.steps_per_frame
    time_s = np.arange(steps) / step_hz
    point = np.zeros((steps, SLOTS), dtype=np.complex128)
    depth, radius = np.zeros((steps, SLOTS)), np.full((steps, SLOTS), 7.0)
    for begin, end, touch, _ in touches:
        part = slice(round(begin * step_hz), round(end * step_hz) + 2)
        for slot, finger in enumerate(touch.fingers):
            point[part, slot], depth[part, slot] = finger.track(time_s[part] - begin)
            radius[part, slot] = finger.radius_mm
    return simulator.advance(point, depth, radius), touches


def answered(loaded: Bundle, networks: Batched, frames: Frames) -> list[tuple[float, str]]:
    """Return time and label of each gesture that fires in frames, (n, rows, columns)."""
    inputs = network_inputs(np.asarray(frames, dtype=np.float32), loaded.preprocess)
    outputs = networks.probabilities(inputs.windows)
    _, probabilities, idle = spread(outputs, inputs, len(frames), len(loaded.labels))
    fired = fire(
        smooth(probabilities, loaded.debounce.weight(idle)),
        loaded.debounce,
        loaded.rate_hz,
        loaded.labels,
    )
    return [((frame + 1) / loaded.rate_hz, loaded.labels[kind]) for frame, kind in fired]


def measure(
    loaded: Bundle, hand: str, name: str, seed: int, people: int, count: int
) -> list[Tally]:
    """Return the tallies of the three thirds of the strength."""
    networks, thirds = Batched(loaded), [Tally() for _ in range(3)]
    for number in range(people):
        frames, touches = session(hand, name, seed, number, count)
        fired = answered(loaded, networks, frames)
        for begin, end, touch, strength in touches:
            answers = [label for time_s, label in fired if begin <= time_s < end + LATE_S]
            tally = thirds[min(2, int(3 * strength))]
            tally.touches += 1
            tally.right += touch.right(answers)
            tally.unexpected += touch.unexpected(answers)
    return thirds


def main() -> None:
    """Print, for each hand and third of its strength, the share that is right, and unexpected."""
    parser = command_line(__doc__, touches=15, people=8, seed=1, hands="", bundle=Path())
    options, results = parser.parse_args(), Results("unruly")
    path = bundles.default_path() if options.bundle == Path() else options.bundle
    loaded = bundles.read(path)
    for name in PRESETS:
        for hand in options.hands.split(",") if options.hands else HANDS:
            thirds = measure(loaded, hand, name, options.seed, options.people, options.touches)
            for third, tally in enumerate(thirds, 1):
                right, false = (
                    one / max(1, tally.touches) for one in (tally.right, tally.unexpected)
                )
                results.note(
                    f"{hand}_{third}", right, "1", preset=name, touches=tally.touches, false=false
                )
            say(f"{name}: {hand}")
    results.finish(options.json, bundle=str(path))


if __name__ == "__main__":
    main()
