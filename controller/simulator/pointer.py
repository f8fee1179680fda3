"""A pointer in place of a hand: rigid, exact fingers, drawn alike by host/ui/pointer_input.py.

The shipped networks play with a mouse as well as with a hand, so a part of their training
sessions is touched like this.
"""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.simulator.gesture import Paths, min_jerk
from controller.simulator.lowpass import Lowpass

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Act = Callable[[complex, np.random.Generator, float, bool], Paths]

# The thumb is where the pointer is, three fingers are across from it. A grip with equal angles
# would look the same turned either way round (docs/simulator.md).
GRIP_DEG: Final = (0.0, 147.0, 180.0, 213.0)
_EDGE_S: Final = 0.12  # a finger sinks in and rises
_SINK_MM_S: Final = 75.0  # as fast as in virtual_orb.py, and as late
_FOLLOW_S: Final = 0.03
_RADIUS_MM: Final = 7.0


def _press(centre: complex, rng: np.random.Generator, step_hz: float, quick: bool) -> Paths:
    if quick:
        depth = click(float(np.exp(rng.uniform(*np.log((0.05, 0.3))))), 9.0, step_hz, 1)
        return np.full(depth.shape, centre, dtype=np.complex128), depth, np.full(1, _RADIUS_MM)
    total = 0.3 + rng.uniform(0.3, 1.2)
    time = _times(total, step_hz)
    slide = complex(*rng.normal(0.0, 1.0, 2)) * (time / total)
    point = np.asarray((centre + slide)[:, None], dtype=np.complex128)
    return point, rng.uniform(8.0, 10.0) * _down_and_up(time, total, 1), np.full(1, _RADIUS_MM)


def _pinch(centre: complex, rng: np.random.Generator, step_hz: float, quick: bool) -> Paths:
    if quick:
        depth = click(rng.uniform(0.2, 0.5), 7.0, step_hz, 2)
        time, begin, close = np.arange(len(depth)) / step_hz, 0.0, rng.uniform(0.1, 0.2)
    else:
        begin, close, hold = 0.08, rng.uniform(0.1, 0.65), rng.uniform(0.0, 0.6)
        total = 0.24 + close + hold
        time = _times(total, step_hz)
        depth = rng.uniform(6.0, 8.0) * _down_and_up(time, total, 2)
    share = _share((time - begin) / close, rng)
    reach = rng.uniform(15.0, 19.0) + (rng.uniform(6.0, 8.0) - 17.0) * share
    angle = rng.choice([0.0, np.pi / 2, rng.uniform(0.0, np.pi)])
    points = centre + reach[:, None] * np.exp(1j * (angle + np.array([0.0, np.pi])))
    return _followed(points, step_hz), depth, np.full(2, _RADIUS_MM)


def _twist(direction: float) -> Act:
    """Four fingers turn about the dome's middle; direction +1 is counterclockwise."""

    def act(_: complex, rng: np.random.Generator, step_hz: float, quick: bool) -> Paths:
        before, hold = rng.uniform(0.0, 0.15), rng.uniform(0.0, 0.3)
        if quick:
            dwell = rng.uniform(0.25, 0.6)
            depth = click(dwell, 7.0, step_hz, 4)
            before *= 0.4
            time, turn = np.arange(len(depth)) / step_hz, dwell - before
        else:
            before, turn = before + 0.08, rng.uniform(0.3, 1.1)
            total = 0.16 + before + turn + hold
            time = _times(total, step_hz)
            depth = rng.uniform(6.0, 8.0) * _down_and_up(time, total, 4)
        share = _share((time - before) / turn, rng)
        angle = np.radians(rng.uniform(35.0, 120.0)) * direction
        grip = rng.uniform(0.0, 2 * np.pi) + np.radians(GRIP_DEG)
        points = rng.uniform(16.0, 20.0) * np.exp(1j * (grip + angle * share[:, None]))
        return _followed(points, step_hz), depth, np.full(4, _RADIUS_MM)

    return act


ACTS: Final[dict[str, Act]] = {
    "press": _press,
    "pinch": _pinch,
    "twist_cw": _twist(-1.0),
    "twist_ccw": _twist(1.0),
}


def _times(total_s: float, step_hz: float) -> Array:
    """Return the time of each step, (steps,), seconds."""
    return np.arange(round(total_s * step_hz) + 1) / step_hz


def _share(linear: Array, rng: np.random.Generator) -> Array:
    """Return the share of a movement at each step, (steps,): half are even, half are smooth."""
    even = np.clip(linear, 0.0, 1.0)
    return even if rng.random() < 0.5 else min_jerk(even)


def click(dwell_s: float, depth_mm: float, step_hz: float, fingers: int) -> Array:
    """Return the depth of each finger, (steps, fingers), mm, as a click of the mouse moves it."""
    deepest = min(depth_mm, _SINK_MM_S * dwell_s)
    time = _times(dwell_s + deepest / _SINK_MM_S, step_hz)
    depth = np.minimum(_SINK_MM_S * time, deepest - _SINK_MM_S * (time - dwell_s))
    return np.repeat(np.clip(depth, 0.0, deepest)[:, None], fingers, axis=1)


def _followed(points: Complex, step_hz: float) -> Complex:
    """Return fingers, (steps, fingers), that lag the pointer a little."""
    keep = np.exp(-1.0 / (_FOLLOW_S * step_hz))
    parts = [
        Lowpass(keep, part[0].copy()).advance((1.0 - keep) * part)
        for part in (points.real, points.imag)
    ]
    return np.asarray(parts[0] + 1j * parts[1], dtype=np.complex128)


def _down_and_up(time: Array, total_s: float, fingers: int) -> Array:
    """Return the depth of each finger, (steps, fingers), as a share of its greatest."""
    depth = np.minimum(min_jerk(time / _EDGE_S), min_jerk((total_s - time) / _EDGE_S))
    return np.repeat(depth[:, None], fingers, axis=1)
