"""Arrays of people on other sensors, as strangers would record them: none is like the orb.

Touches, their times and places are known. A finger is a bump on the grid; a sensor reads it as
`change` of a level, upwards or downwards, with noise.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

NAMES: Final = ("rest", "tap", "hold")
TICK_S: Final = 0.0155  # of a computer's clock: intervals of 16 and 31 ms


@dataclass(frozen=True)
class Sensor:
    """What is measured, and how."""

    rate_hz: float = 40.0
    rows: int = 6
    columns: int = 4
    level: float = 0.0  # counts untouched
    change: float = 300.0  # counts of a firm finger; negative: they fall
    noise: float = 2.0  # counts
    finger: float = 1.2  # taxels, standard deviation of the bump
    hold_s: float = 1.0  # of a touch
    pause_s: float = 1.5  # between touches, and before the first one
    touches: int = 16
    begins_touched: bool = False  # the recording starts in the first touch
    stray: float = 1.0  # how far from the middle touches go, share of the grid


def recorded(sensor: Sensor, seed: int) -> dict[str, NDArray[Any]]:
    """Frames (n, rows, columns), true times `t`, `label` by NAMES and `place`, x and y, (n, 2)."""
    rng = np.random.default_rng(seed)
    turn_s = sensor.pause_s + sensor.hold_s
    n = round(sensor.rate_hz * (turn_s * sensor.touches + sensor.pause_s))
    true_s = np.arange(n) / sensor.rate_hz
    label, place = np.zeros(n, dtype=np.int8), np.full((n, 2), np.nan)
    depth = np.zeros(n)
    y, x = np.mgrid[sensor.rows - 1 : -1 : -1, : sensor.columns]
    shape = np.zeros((n, sensor.rows, sensor.columns))
    for number in range(sensor.touches):
        begin_s = sensor.pause_s + turn_s * number
        here = (true_s >= begin_s) & (true_s < begin_s + sensor.hold_s)
        middle = np.array([sensor.columns - 1, sensor.rows - 1]) / 2
        at = middle * (1 + sensor.stray * rng.uniform(-0.8, 0.8, 2))
        label[here] = 1 + number % 2
        place[here] = at
        ease = np.minimum(true_s - begin_s, begin_s + sensor.hold_s - true_s)[here] / 0.15
        depth[here] = rng.uniform(0.7, 1.0) * np.clip(ease, 0.0, 1.0) ** 0.5
        bump = np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / (2 * sensor.finger**2))
        # A tap is round, a hold is a flat hand.
        shape[here] = bump if number % 2 == 0 else 0.5 + 0.5 * bump
    frames = sensor.level + sensor.change * depth[:, None, None] * shape
    frames += rng.normal(0.0, sensor.noise, frames.shape)
    kept = slice(int((label > 0).argmax()) if sensor.begins_touched else 0, None)
    counts = np.rint(frames[kept]).astype(np.int32)
    return {"frames": counts, "t": true_s[kept], "label": label[kept], "place": place[kept]}


def ticks(true_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Times by a computer whose clock ticks every 16 ms: so intervals are of one tick or more."""
    return np.ceil(true_s / TICK_S) * TICK_S


def bursts(true_s: NDArray[np.float64], of: int = 4) -> NDArray[np.float64]:
    """Times of frames that arrive together, a millisecond apart, as over USB or radio."""
    number = np.arange(len(true_s))
    last = np.minimum((number // of + 1) * of - 1, len(true_s) - 1)
    return true_s[last] + 0.001 * (number % of)
