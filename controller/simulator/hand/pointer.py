"""A pointer in place of a hand: rigid, exact fingers, drawn alike by host/ui/pointer_input.py.

The shipped networks play with a mouse as well as with a hand, so a part of their training
sessions is touched like this.
"""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from controller.shared.aliases import Array, Complex
from controller.simulator.dome.lowpass import Lowpass
from controller.simulator.hand.gesture import Paths, min_jerk

Act = Callable[[complex, np.random.Generator, float, bool], Paths]

# The thumb is where the pointer is, three fingers are across from it. A grip with equal angles
# would look the same turned either way round (docs/simulator.md).
GRIP_DEG: Final = (0.0, 147.0, 180.0, 213.0)
SINK_MM_S: Final = 150.0  # people's quick taps go 6 to 9 mm deep in 0.04 to 0.1 s
FOLLOW_S: Final = 0.03  # a finger lags the pointer by this much
_RADIUS_MM: Final = 7.0


def _press(centre: complex, rng: np.random.Generator, step_hz: float, quick: bool) -> Paths:
    dwell_s = float(np.exp(rng.uniform(*np.log((0.05, 0.3))))) if quick else rng.uniform(0.3, 1.4)
    depth = click(dwell_s, rng.uniform(8.0, 10.0), step_hz, 1)
    slide = 0.0 if quick else complex(*rng.normal(0.0, 1.0, 2))
    points = centre + slide * np.linspace(0.0, 1.0, len(depth))[:, None]
    return points.astype(np.complex128), depth, np.full(1, _RADIUS_MM)


def _pinch(centre: complex, rng: np.random.Generator, step_hz: float, quick: bool) -> Paths:
    close_s = rng.uniform(0.1, 0.2 if quick else 0.65)
    dwell_s = rng.uniform(0.2, 0.5) if quick else 0.1 + close_s + rng.uniform(0.0, 0.6)
    depth = click(dwell_s, rng.uniform(6.0, 8.0), step_hz, 2)
    share = _share(len(depth), 0.0, close_s, step_hz, rng)
    reach = rng.uniform(15.0, 19.0) + (rng.uniform(6.0, 8.0) - 17.0) * share
    angle = rng.choice([0.0, np.pi / 2, rng.uniform(0.0, np.pi)])
    points = centre + reach[:, None] * np.exp(1j * (angle + np.array([0.0, np.pi])))
    return _followed(points, step_hz), depth, np.full(2, _RADIUS_MM)


def _twist(direction: float) -> Act:
    """Four fingers turn about the dome's middle; direction +1 is counterclockwise."""

    def act(_: complex, rng: np.random.Generator, step_hz: float, quick: bool) -> Paths:
        before_s = rng.uniform(0.0, 0.06 if quick else 0.15)
        turn_s = rng.uniform(0.25, 0.6) if quick else rng.uniform(0.3, 1.1)
        dwell_s = before_s + turn_s + (0.0 if quick else rng.uniform(0.0, 0.3))
        depth = click(dwell_s, rng.uniform(6.0, 8.0), step_hz, 4)
        share = _share(len(depth), before_s, turn_s, step_hz, rng)
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


def click(dwell_s: float, depth_mm: float, step_hz: float, fingers: int) -> Array:
    """Return the depth of each finger, (steps, fingers), mm, while a button is down, and after."""
    deepest = min(depth_mm, SINK_MM_S * dwell_s)
    time = np.arange(math.ceil((dwell_s + deepest / SINK_MM_S) * step_hz) + 1) / step_hz
    depth = np.minimum(SINK_MM_S * time, deepest - SINK_MM_S * (time - dwell_s))
    return np.repeat(np.clip(depth, 0.0, deepest)[:, None], fingers, axis=1)


def _share(
    steps: int, begin_s: float, length_s: float, step_hz: float, rng: np.random.Generator
) -> Array:
    """Return the share of a movement at each step, (steps,): half are even, half are smooth."""
    linear = (np.arange(steps) / step_hz - begin_s) / length_s
    return np.clip(linear, 0.0, 1.0) if rng.random() < 0.5 else min_jerk(linear)


def _followed(points: Complex, step_hz: float) -> Complex:
    """Return fingers, (steps, fingers), that lag the pointer a little."""
    keep = np.exp(-1.0 / (FOLLOW_S * step_hz))
    parts = [
        Lowpass(keep, part[0].copy()).advance((1.0 - keep) * part)
        for part in (points.real, points.imag)
    ]
    return np.asarray(parts[0] + 1j * parts[1], dtype=np.complex128)
