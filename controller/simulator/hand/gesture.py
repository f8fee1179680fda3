"""Gestures as data: the movement of the fingers in one event (docs/gestures.md).

A gesture has phases, one after the other, and tracks with a key at each boundary between two
phases: how deep, how far from the middle, at which angle. Between two keys a finger moves as
people do, smoothly (minimum jerk). Its numbers are drawn for each event:

    hold = [0.12, 0.35]                                # uniform between two limits
    depth = { of = "press_depth", scatter = 0.12 }     # a user's own, 12 % more or less
    lag = { delay = 0.04 }                             # seconds, each finger its own
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TypeVar

import numpy as np

from controller.shared import config
from controller.shared.aliases import Array, Complex
from controller.shared.config import ConfigError
from controller.shared.errors import UserError
from controller.simulator.hand.user_style import UserStyle, parameters

Paths = tuple[Complex, Array, Array]  # points, depths (steps, fingers), radii (fingers,), all mm
Value = float | Array  # one number, or one for each finger
Known = dict[str, Value]
Checked = TypeVar("Checked")

_TERMS: Final = ("of", "times", "plus", "least", "most")
_SHARE: Final = {"range": (0.0, 1.0)}


class GestureError(UserError, ValueError):
    """A gesture cannot be used; the message gives the reason, in one sentence."""


# A number, the name of a style parameter or an earlier quantity, perhaps with a minus sign before
# it, or a range to draw from.
Key = float | str
Keys = Sequence[Key]
Term = Key | tuple[float, float]


@dataclass(frozen=True, slots=True)
class Quantity:
    """One line of [vary]; what is not given changes nothing. Applied in this order."""

    of: Term = 0.0  # what it starts from
    delay: float = 0.0  # in its place, the deviation of a half-normal number, drawn for each finger
    times: Term | None = None  # factor
    plus: Term | None = None  # summand
    scatter: float = 0.0  # deviation of a log-normal factor: 0.1 is 10 % more or less
    jitter: float = 0.0  # deviation of a normal summand
    handed: bool = False  # an angle in degrees, mirrored for left hands
    least: Term | None = None  # lower limit
    most: Term | None = None  # upper limit
    each: bool = False  # whether every finger draws its own

    def draw(
        self, known: Known, fingers: int, left_handed: bool, rng: np.random.Generator
    ) -> Value:
        """Return the quantity for one event: a number, or an array (fingers,)."""
        size = fingers if self.each else None
        if self.delay:
            value: Value = np.abs(rng.normal(0.0, self.delay, fingers))
        else:
            value = term(self.of, known, rng, size)
        if self.times is not None:
            value = value * term(self.times, known, rng, size)
        if self.plus is not None:
            value = value + term(self.plus, known, rng, size)
        if self.scatter:
            value = value * np.exp(rng.normal(0.0, self.scatter, size))
        if self.jitter:
            value = value + rng.normal(0.0, self.jitter, size)
        if self.handed and left_handed:
            value = 180.0 - value
        if self.least is not None:
            value = np.maximum(value, term(self.least, known, rng, size))
        if self.most is not None:
            value = np.minimum(value, term(self.most, known, rng, size))
        return value


@dataclass(frozen=True, slots=True)
class Count:
    """The line `fingers` of [vary]: how many touch."""

    of: Term = 1.0  # a number, the two limits of evenly drawn ones, or a style parameter
    one_more: float = field(default=0.0, metadata=_SHARE)  # probability of one finger more
    off_by_one: float = field(default=0.0, metadata=_SHARE)  # probability of one more or fewer
    least: int = 1  # lower limit
    most: int = 6  # upper limit

    def draw(self, known: Known, rng: np.random.Generator) -> int:
        """Return how many fingers touch in one event."""
        if isinstance(self.of, tuple):
            count = int(rng.integers(int(self.of[0]), int(self.of[1]) + 1))
        else:
            count = round(float(term(self.of, known, rng, None)))
        if self.one_more and rng.random() < self.one_more:
            count += 1
        if self.off_by_one and rng.random() < self.off_by_one:
            count += int(rng.choice([-1, 1]))
        return min(max(count, self.least), self.most)


def term(what: Term, known: Known, rng: np.random.Generator, size: int | None) -> Value:
    """Return a number, a drawn one, or the value of a name."""
    return rng.uniform(*what, size) if isinstance(what, tuple) else value_of(what, known)


def value_of(what: Key, known: Known) -> Value:
    """Return a number, or the value of a name."""
    if not isinstance(what, str):
        return float(what)
    value = known[what.removeprefix("-")]
    return -value if what.startswith("-") else value


LONGEST_S: Final = 20.0  # one event


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
    radius: Key = "finger_radius"  # of the fingertips, mm
    angles: Keys = ()  # where the fingers stand, degrees; else at one place
    fan: Key | None = None  # in its place: thumb at 180, others around 0 so far apart
    line: Key = 0.0  # fingers stand in a line along the yaw, so many mm apart
    lead: Key = 0.0  # share of the first phase by which movements begin before it is over
    lag: Key = 0.0  # seconds by which a finger's movement is late
    late: Key = 0.0  # seconds by which a finger lands late
    early: Key = 0.0  # seconds by which it lifts early
    tremble: Key = 0.0  # relative amplitude of an oscillation of the depth
    tremble_hz: Key = 6.0  # its frequency
    place: str = field(default="middle", metadata={"choices": ("middle", "anywhere")})
    distractor: bool = False  # whether it is no gesture
    form_of: str = ""  # label of the gesture that this is another form of
    quick: "Gesture | None" = None  # the same in fast play; None: it has no other form

    @property
    def usual(self) -> bool:
        """Whether it is a gesture, in its usual form."""
        return not self.distractor and not self.form_of

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
        if self.tremble != 0.0:
            phase = 2 * np.pi * value_of(self.tremble_hz, known) * clock.time_s
            depth *= 1.0 + value_of(self.tremble, known) * np.sin(phase)
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


def quantity(raw: Any, names: Collection[str], where: str) -> Quantity:
    """Return the quantity of a file's value, which may refer to `names`.

    Raises:
        GestureError: It is none; the message begins with `where`.
    """
    if not isinstance(raw, dict):
        return Quantity(parse_term(raw, names, where))
    if len({"of", "delay"} & set(raw)) > 1:
        raise GestureError(f"{where} starts twice; give one of of and delay")
    terms = {
        name: parse_term(raw[name], names, f"{where} ({name})") for name in _TERMS if name in raw
    }
    return checked(Quantity, {**raw, **terms}, where)


def count(raw: Any, names: Collection[str], where: str) -> Count:
    """Return the number of fingers of a file's value; arguments and errors as of `quantity`."""
    table = raw if isinstance(raw, dict) else {"of": raw}
    of = parse_term(table.get("of", 1), names, where)
    return checked(Count, {**table, "of": of}, where)


def checked(kind: type[Checked], table: dict[str, Any], where: str) -> Checked:
    """Return the dataclass of a table.

    Raises:
        GestureError: It is none; the message begins with `where`.
    """
    try:
        return config.settings(kind, table)
    except ConfigError as error:
        raise GestureError(f"{where} {error}") from None


def parse_term(raw: Any, names: Collection[str], where: str) -> Term:
    """Return a number, a range or a name.

    Raises:
        GestureError: It is none of them, or an unknown name.
    """
    if _is_number(raw):
        return float(raw)
    if isinstance(raw, str):
        if (name := raw.removeprefix("-")) not in names:
            raise GestureError(
                f"{where} names {name!r}, which is neither a user's parameter nor a line above; "
                f"known are {', '.join(names)}"
            )
        return raw
    if isinstance(raw, list) and len(raw) == 2 and all(map(_is_number, raw)) and raw[0] <= raw[1]:
        return float(raw[0]), float(raw[1])
    raise GestureError(f"{where} is {raw!r}; write a number, a name in quotes, or [least, most]")


def _is_number(raw: Any) -> bool:
    return type(raw) in (int, float) and bool(np.isfinite(raw))
