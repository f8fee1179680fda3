"""Gestures as data: the movement of the fingers in one event (docs/gestures.md).

A gesture has phases, one after the other, and tracks with a key at each boundary between two
phases: how deep, how far from the middle, at which angle. Between two keys a finger moves as
people do, smoothly (minimum jerk).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.simulator.gesture_values import (
    Count,
    GestureError,
    Known,
    Name,
    Quantity,
    Value,
    value_of,
)
from controller.simulator.user_style import UserStyle, parameters

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Paths = tuple[Complex, Array, Array]  # points, depths (steps, fingers), radii (fingers,), all mm

LONGEST_S: Final = 20.0  # one event
Key = float | Name  # a number, or the name of one
Keys = Sequence[Key]
_FINGER: Final = Name("finger_radius")


@dataclass(frozen=True, slots=True)
class Gesture:
    """One gesture, or one touch that is none (a distractor)."""

    label: str
    vary: Sequence[tuple[str, Quantity | Count]]  # drawn for each event in this order
    phases: Keys  # duration of each phase, seconds
    depth: Keys  # keys of every finger's indentation, mm; begins and ends with 0
    reach: Keys = (0.0,)  # keys of its distance from the hand's middle, mm
    angle: Keys = (0.0,)  # keys of its angle there, degrees counterclockwise
    x: Keys = (0.0,)  # keys of the hand's middle, mm to the right of the place
    y: Keys = (0.0,)  # the same upward
    yaw: Key = 0.0  # direction of the whole hand, degrees
    radius: Key = _FINGER  # of the fingertips, mm
    angles: Keys = ()  # where the fingers stand, degrees; else at one place
    fan: Key | None = None  # in its place: thumb at 180, others around 0 so far apart
    line: Key = 0.0  # fingers stand in a line along the yaw, so many mm apart
    lead: Key = 0.0  # share of the first phase by which movements begin before it is over
    lag: Key = 0.0  # seconds by which a finger's movement is late
    late: Key = 0.0  # seconds by which a finger lands late
    early: Key = 0.0  # seconds by which it lifts early
    # Turns of the dome that leave it the same gesture.
    rotations: str = field(default="none", metadata={"choices": ("all", "half", "none")})
    mirror: str = "none"  # its mirror image: "self", another label, or "none" (no gesture)
    place: str = field(default="middle", metadata={"choices": ("middle", "anywhere")})
    distractor: bool = False  # whether it is no gesture

    def move(self, style: UserStyle, rng: np.random.Generator, step_hz: float) -> Paths:
        """Return what a user's fingers do in one event, relative to where it is."""
        known: Known = dict(parameters(style))
        fingers = 1
        for name, line in self.vary:
            if isinstance(line, Count):
                fingers = line.draw(known, rng)
            else:
                known[name] = line.draw(known, fingers, style.left_handed, rng)
        clock = _Clock([value_of(phase, known) for phase in self.phases], step_hz)
        landing, lifting = value_of(self.late, known), value_of(self.early, known)
        lag = value_of(self.lag, known) - value_of(self.lead, known) * clock.spans[0]

        def track(keys: Keys) -> Value:
            return clock.track(keys, known, lag, lag)

        depth = np.empty((clock.steps, fingers))
        np.maximum(clock.track(self.depth, known, landing, -lifting), 0.0, out=depth)
        points = np.empty((clock.steps, fingers), dtype=np.complex128)
        points.real, points.imag = track(self.x), track(self.y)
        if self.reach != (0.0,) or self.line:
            place = np.arange(fingers) - (fingers - 1) / 2
            reach = track(self.reach) + place * value_of(self.line, known)
            turn = value_of(self.yaw, known) + self._stand(fingers, known) + track(self.angle)
            points += reach * np.exp(1j * np.radians(turn))
        return points, depth, np.full(fingers, value_of(self.radius, known))

    def _stand(self, fingers: int, known: Known) -> Value:
        """Return the angle at which each finger stands, degrees."""
        if self.fan is not None:
            around = np.arange(fingers - 1) - (fingers - 2) / 2
            return np.concatenate([[180.0], around * value_of(self.fan, known)])
        if self.angles:
            if len(self.angles) < fingers:
                raise GestureError(f"there are {len(self.angles)} angles for {fingers} fingers")
            return np.array([value_of(angle, known) for angle in self.angles[:fingers]])
        return 0.0


class _Clock:
    """The time of one event: its steps and the boundaries of its phases."""

    def __init__(self, spans: list[Value], step_hz: float) -> None:
        self.spans = spans
        self.starts: list[Value] = []
        end: Value = 0.0
        for span in spans:
            self.starts.append(end)
            end = end + span
        self.total_s = float(np.max(end))
        if not 0.0 < self.total_s <= LONGEST_S:
            raise GestureError(
                f"its phases last {self.total_s:.3g} s; at most {LONGEST_S:g} may be"
            )
        self.steps = round(self.total_s * step_hz) + 1
        self.time_s = np.arange(self.steps)[:, None] / step_hz

    def track(self, keys: Keys, known: Known, up: Value, down: Value) -> Value:
        """Return a track at every step, (steps, fingers or 1), or the number that it always is.

        Two keys are an even motion; rises and falls are late by `up` and `down` seconds.
        """
        value = value_of(keys[0], known)
        if len(keys) == 2:
            return value + (value_of(keys[1], known) - value) * (self.time_s / self.total_s)
        for i in range(len(keys) - 1):
            if keys[i] == keys[i + 1]:
                continue
            change = value_of(keys[i + 1], known) - value_of(keys[i], known)
            late = up if up is down else np.where(np.asarray(change) > 0.0, up, down)
            begin = self.time_s - (self.starts[i] + late)
            value = value + change * min_jerk(begin / self.spans[i])
        return value


def min_jerk(share: Array) -> Array:
    """Return the smooth step of a movement, 0 ... 1, for shares 0 ... 1 (clipped), any shape."""
    u = np.minimum(np.maximum(share, 0.0), 1.0)
    return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u**2))
