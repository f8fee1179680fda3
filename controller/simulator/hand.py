"""A simulated hand: each user's own style, each session's mood, each event's accidents.

A performance is one gesture (or one distractor) as finger paths on the mechanics grid. The
hand knows nothing of sensors and networks.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

MECHANICS_HZ: Final = 50.0
SLOTS: Final = 6  # fingers a performance may use
GESTURES: Final = ("press", "pinch", "twist_cw", "twist_ccw")
DISTRACTORS: Final = ("brush", "rest")  # contacts that are no gestures
ONSET_SHARE: Final = 0.4  # of the plateau depth: where a gesture truly begins
# A pointer's twist: the thumb where the pointer is, three fingers across from it. A grip with
# equal angles would look the same turned either way round (docs/simulator.md).
POINTER_GRIP_DEG: Final = (0.0, 147.0, 180.0, 213.0)
_RELEASED_MM: Final = 0.05  # shallower than this no finger touches


@dataclass(frozen=True, slots=True)
class Style:
    """How somebody touches; lengths in mm, angles in radians, times in seconds."""

    press_depth: float
    press_hold: float
    finger_radius: float
    pinch_open: float
    pinch_closed: float
    pinch_depth: float
    pinch_close: float
    pinch_yaw: float
    twist_fingers: int
    twist_grip: float
    twist_angle: float
    twist_time: float
    twist_depth: float
    twist_yaw: float
    pre_rotation: float
    fan: float
    tremor: float
    tremor_hz: float
    left_handed: bool
    aim: float
    pointer: bool = False


@dataclass(frozen=True, slots=True)
class Performance:
    """Finger paths of one event, sampled at `MECHANICS_HZ`.

    Attributes:
        label: Gesture or distractor.
        place: Where it was meant to be, (x, y) in grid units.
        point: Hand points, complex mm from the dome's centre, (steps, SLOTS).
        depth_mm: Indentation, (steps, SLOTS).
        radius_mm: Finger radii, (SLOTS,).
        onset_s: True onset from the start of the paths.
        release_s: When the last finger leaves.
    """

    label: str
    place: tuple[float, float]
    point: Complex
    depth_mm: Array
    radius_mm: Array
    onset_s: float
    release_s: float


def draw_style(rng: np.random.Generator) -> Style:
    """Draw a user."""
    return Style(
        press_depth=rng.uniform(6.5, 12.0),
        press_hold=0.45 * np.exp(rng.normal(0.0, 0.15)),
        finger_radius=rng.uniform(6.0, 8.5),
        pinch_open=rng.uniform(15.0, 20.0),
        pinch_closed=rng.uniform(6.0, 10.0),
        pinch_depth=rng.uniform(5.0, 9.0),
        pinch_close=rng.uniform(0.3, 0.6),
        pinch_yaw=np.radians(rng.uniform(-40.0, 40.0)),
        twist_fingers=int(rng.integers(3, 6)),
        twist_grip=rng.uniform(15.0, 21.0),
        twist_angle=np.radians(rng.uniform(35.0, 65.0)),
        twist_time=rng.uniform(0.55, 0.95),
        twist_depth=rng.uniform(4.0, 8.0),
        twist_yaw=np.radians(rng.uniform(-30.0, 30.0)),
        pre_rotation=np.radians(max(0.0, rng.normal(12.0, 7.0))),
        fan=np.radians(rng.uniform(24.0, 36.0)),
        tremor=rng.uniform(0.1, 0.35),
        tremor_hz=rng.uniform(8.0, 11.0),
        left_handed=bool(rng.random() < 0.15),
        aim=rng.uniform(1.0, 2.0),
    )


def draw_mood(style: Style, rng: np.random.Generator) -> Style:
    """Vary a user's style for one session."""
    firmness = np.exp(rng.normal(0.0, 0.08))
    tempo = np.exp(rng.normal(0.0, 0.08))
    yaw = np.radians(rng.normal(0.0, 8.0))
    return replace(
        style,
        press_depth=style.press_depth * firmness,
        pinch_depth=style.pinch_depth * firmness,
        twist_depth=style.twist_depth * firmness,
        press_hold=style.press_hold * tempo,
        pinch_close=style.pinch_close * tempo,
        twist_time=style.twist_time * tempo,
        pinch_yaw=style.pinch_yaw + yaw,
        twist_yaw=style.twist_yaw + yaw,
    )


def perform(
    label: str, place: tuple[float, float], style: Style, rng: np.random.Generator
) -> Performance:
    """Carry out a gesture or a distractor at `place`, (x, y) in grid units of 10 mm.

    Raises:
        ValueError: No hand knows this label.
    """
    acts = _POINTER if style.pointer and label in _POINTER else _ACTS
    if label not in acts:
        known = ", ".join((*GESTURES, *DISTRACTORS))
        raise ValueError(f"the virtual hand cannot perform {label!r}; it knows {known}")
    aim = complex(*rng.normal(0.0, style.aim, 2))
    centre = complex(place[0] - 2.0, place[1] - 2.0) * 10.0 + aim
    point, depth, radius = acts[label](centre, style, rng)
    steps, fingers = point.shape
    time = np.arange(steps) / MECHANICS_HZ
    if not style.pointer:
        phase = rng.uniform(0.0, 2 * np.pi, (2, fingers))
        shake = 2 * np.pi * style.tremor_hz * time[:, None]
        point = point + style.tremor * (np.sin(shake + phase[0]) + 1j * np.sin(shake + phase[1]))
    points = np.zeros((steps, SLOTS), dtype=np.complex128)
    depths = np.zeros((steps, SLOTS))
    radii = np.full(SLOTS, style.finger_radius)
    points[:, :fingers], depths[:, :fingers], radii[:fingers] = point, depth, radius
    plateau = depths.max(axis=0)
    deep: NDArray[np.bool_] = (depths > ONSET_SHARE * plateau) & (plateau > 0.0)
    touching: NDArray[np.bool_] = np.any(depths > _RELEASED_MM, axis=1)
    onset = time[int(np.argmax(deep.any(axis=1)))]
    release = time[len(time) - 1 - int(np.argmax(touching[::-1]))] + 1.0 / MECHANICS_HZ
    return Performance(label, place, points, depths, radii, float(onset), float(release))


Paths = tuple[Complex, Array, Array]  # points (steps, fingers), depths alike, radii (fingers,)


def _min_jerk(share: Array) -> Array:
    """Smooth step of a movement, 0 ... 1 for shares 0 ... 1 (clipped)."""
    u = np.clip(share, 0.0, 1.0)
    return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u**2))


def _times(duration_s: float) -> Array:
    return np.arange(round(duration_s * MECHANICS_HZ) + 1) / MECHANICS_HZ


def _press_in(time: Array, start: Array, stop: Array, rise: Array, fall: Array) -> Array:
    """Depth envelopes, 0 ... 1, (steps, fingers): up at `start`, down so that it ends at `stop`."""
    up = _min_jerk((time[:, None] - start) / rise)
    down = _min_jerk((stop - time[:, None]) / fall)
    return np.minimum(up, down)


def _press(centre: complex, style: Style, rng: np.random.Generator) -> Paths:
    hold = style.press_hold * np.exp(rng.normal(0.0, 0.3))
    rise, fall = rng.uniform(0.12, 0.2), rng.uniform(0.11, 0.19)
    total = rise + hold + fall
    time = _times(total)
    one = np.ones(1)
    depth = style.press_depth * np.exp(rng.normal(0.0, 0.12))
    envelope = _press_in(time, 0 * one, total * one, rise * one, fall * one)
    slide = complex(*rng.normal(0.0, 0.6, 2)) * (time / total)
    return (centre + slide)[:, None], depth * envelope, np.array([style.finger_radius])


def _pinch(centre: complex, style: Style, rng: np.random.Generator) -> Paths:
    rise, fall = rng.uniform(0.12, 0.2), rng.uniform(0.11, 0.19)
    close = style.pinch_close * np.exp(rng.normal(0.0, 0.12))
    hold = rng.uniform(0.12, 0.35)
    total = rise + close + hold + fall
    time = _times(total)
    yaw = (np.pi - style.pinch_yaw if style.left_handed else style.pinch_yaw) + np.radians(
        rng.normal(0.0, 10.0)
    )
    begin = style.pinch_open * np.exp(rng.normal(0.0, 0.05))
    end = min(style.pinch_closed * np.exp(rng.normal(0.0, 0.08)), 0.7 * begin)
    fingers = 3 if rng.random() < 0.25 else 2
    angles = yaw + np.array([0.0, np.pi, np.pi + rng.uniform(0.35, 0.55)][:fingers])
    lag = np.abs(rng.normal(0.0, 0.04, fingers))
    share = _min_jerk((time[:, None] - 0.6 * rise - lag) / close)
    reach = begin + (end - begin) * share * rng.normal(1.0, 0.05, fingers)
    points = centre + reach * np.exp(1j * angles)
    depth = style.pinch_depth * np.exp(rng.normal(0.0, 0.1, fingers))
    land = np.abs(rng.normal(0.0, 0.03, fingers))
    lift = total - np.abs(rng.normal(0.0, 0.03, fingers))
    envelope = _press_in(time, land, lift, np.full(fingers, rise), np.full(fingers, fall))
    return points, depth * envelope, np.full(fingers, 0.9 * style.finger_radius)


def _twist(direction: float) -> Callable[[complex, Style, np.random.Generator], Paths]:
    """Several fingers grip and turn; direction +1 is counterclockwise."""

    def act(centre: complex, style: Style, rng: np.random.Generator) -> Paths:
        rise, fall = rng.uniform(0.12, 0.2), rng.uniform(0.11, 0.19)
        turn = style.twist_time * np.exp(rng.normal(0.0, 0.1))
        hold = rng.uniform(0.03, 0.2)
        total = rise + turn + hold + fall
        time = _times(total)
        count = style.twist_fingers
        if rng.random() < 0.15:
            count = int(np.clip(count + rng.choice([-1, 1]), 3, 5))
        fan = (np.arange(count - 1) - (count - 2) / 2) * style.fan
        angles = np.concatenate([[np.pi], fan]) + rng.normal(0.0, np.radians(5.0), count)
        yaw = np.pi / 2 + style.twist_yaw + np.radians(rng.normal(0.0, 10.0))
        if style.left_handed:
            yaw = np.pi - yaw
        angle = style.twist_angle * np.exp(rng.normal(0.0, 0.12)) * direction
        start = yaw + angles - style.pre_rotation * direction
        lag = np.abs(rng.normal(0.0, 0.04, count))
        share = _min_jerk((time[:, None] - 0.6 * rise - lag) / turn)
        gain = rng.normal(1.0, 0.08, count)
        grip = style.twist_grip * np.exp(rng.normal(0.0, 0.06, count))
        points = centre + grip * np.exp(1j * (start + angle * gain * share))
        depth = style.twist_depth * np.exp(rng.normal(0.0, 0.15, count))
        land = np.abs(rng.normal(0.0, 0.04, count))
        lift = total - np.abs(rng.normal(0.0, 0.04, count))
        envelope = _press_in(time, land, lift, np.full(count, rise), np.full(count, fall))
        return points, depth * envelope, np.full(count, 0.9 * style.finger_radius)

    return act


def _brush(centre: complex, style: Style, rng: np.random.Generator) -> Paths:
    total = rng.uniform(0.3, 0.9)
    time = _times(total)
    heading = np.exp(1j * rng.uniform(0.0, 2 * np.pi))
    speed = rng.uniform(20.0, 70.0)
    points = centre + heading * speed * (time - total / 2)
    edge = np.full(1, min(0.15, total / 3))
    envelope = _press_in(time, np.zeros(1), np.full(1, total), edge, edge)
    inside = np.abs(points) < 34.0
    depth = rng.uniform(0.3, 2.0) * envelope * inside[:, None]
    return points[:, None], depth, np.array([style.finger_radius])


def _rest(centre: complex, style: Style, rng: np.random.Generator) -> Paths:
    fingers = int(rng.integers(1, 4))
    total = rng.uniform(0.6, 3.0)
    time = _times(total)
    heading = np.exp(1j * rng.uniform(0.0, 2 * np.pi))
    spread = (np.arange(fingers) - (fingers - 1) / 2) * 16.0
    drift = complex(*rng.normal(0.0, 1.0, 2)) * (time / total)
    points = centre + heading * spread + drift[:, None]
    slow = rng.uniform(0.15, 0.35, fingers)
    envelope = _press_in(time, np.zeros(fingers), np.full(fingers, total), slow, slow)
    depth = rng.uniform(0.3, 2.2, fingers) * envelope
    depth *= np.abs(points) < 34.0
    return points, depth, np.full(fingers, style.finger_radius)


# A pointer on a screen in place of a hand: rigid, exact fingers (host/touch.py draws the same).


def _pointer_press(centre: complex, style: Style, rng: np.random.Generator) -> Paths:
    hold = rng.uniform(0.3, 1.2)
    total = 0.3 + hold
    time = _times(total)
    slide = complex(*rng.normal(0.0, 1.0, 2)) * (time / total)
    edge = np.full(1, 0.12)
    envelope = _press_in(time, np.zeros(1), np.full(1, total), edge, edge)
    point = np.asarray((centre + slide)[:, None], dtype=np.complex128)
    return point, rng.uniform(8.0, 10.0) * envelope, np.full(1, 7.0)


def _pointer_pinch(centre: complex, style: Style, rng: np.random.Generator) -> Paths:
    close, hold = rng.uniform(0.4, 0.65), rng.uniform(0.0, 0.6)
    total = 0.24 + close + hold
    time = _times(total)
    linear = np.clip((time - 0.08) / close, 0.0, 1.0)
    share = linear if rng.random() < 0.5 else _min_jerk(linear)
    reach = rng.uniform(15.0, 19.0) + (rng.uniform(6.0, 8.0) - 17.0) * share
    angle = rng.choice([0.0, np.pi / 2, rng.uniform(0.0, np.pi)])
    points = centre + reach[:, None] * np.exp(1j * (angle + np.array([0.0, np.pi])))
    edge = np.full(2, 0.12)
    envelope = _press_in(time, np.zeros(2), np.full(2, total), edge, edge)
    return points, rng.uniform(6.0, 8.0) * envelope, np.full(2, 7.0)


def _pointer_twist(direction: float) -> Callable[[complex, Style, np.random.Generator], Paths]:
    def act(centre: complex, style: Style, rng: np.random.Generator) -> Paths:
        before, turn, hold = rng.uniform(0.0, 0.15), rng.uniform(0.4, 1.1), rng.uniform(0.0, 0.3)
        total = 0.24 + before + turn + hold
        time = _times(total)
        linear = np.clip((time - 0.08 - before) / turn, 0.0, 1.0)
        share = linear if rng.random() < 0.5 else _min_jerk(linear)
        angle = np.radians(rng.uniform(35.0, 120.0)) * direction
        grip = rng.uniform(0.0, 2 * np.pi) + np.radians(POINTER_GRIP_DEG)
        points = rng.uniform(16.0, 20.0) * np.exp(1j * (grip + angle * share[:, None]))
        edge = np.full(4, 0.12)
        envelope = _press_in(time, np.zeros(4), np.full(4, total), edge, edge)
        return points, rng.uniform(6.0, 8.0) * envelope, np.full(4, 7.0)

    return act


Act = Callable[[complex, Style, np.random.Generator], Paths]
_ACTS: Final[dict[str, Act]] = {
    "press": _press,
    "pinch": _pinch,
    "twist_cw": _twist(-1.0),
    "twist_ccw": _twist(1.0),
    "brush": _brush,
    "rest": _rest,
}
_POINTER: Final[dict[str, Act]] = {
    "press": _pointer_press,
    "pinch": _pointer_pinch,
    "twist_cw": _pointer_twist(-1.0),
    "twist_ccw": _pointer_twist(1.0),
}
