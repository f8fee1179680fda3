"""Level of the untouched sensor, where no recording says it: the one returned to most often."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Frames = NDArray[np.float32]  # (n, rows, columns)

SPELL_S: Final = 0.5  # time for which the sensor is still at a level
LEAST: Final = 4  # frames of it
SPELLS: Final = 600  # most spells compared, evenly spread over the recording
STILL: Final = 0.25  # share of the spells that are still
NEAR: Final = 0.25  # of the greatest differences of two levels: they are one; twice as much: two
LOCAL: Final = 0.2  # share of the taxels that a local touch moves
STRONG: Final = 0.2  # of the greatest change of any taxel: it is moved


def rest_frames(frames: Frames, rate_hz: float) -> Frames:
    """Return still frames of the untouched sensor, (m, rows, columns), out of (n, rows, columns).

    Touches go to many levels, and come back to one. If no level recurs, the median of each taxel is
    taken where touches are local, else the first still spell, as the device does.
    """
    length = max(LEAST, round(SPELL_S * rate_hz))
    if len(frames) < 3 * length:
        return _middle(frames)
    starts = np.unique(np.linspace(0, len(frames) - length, SPELLS).astype(np.int64))
    spells = np.stack([frames[first : first + length].reshape(length, -1) for first in starts])
    early, late = spells[:, : length // 2].mean(axis=1), spells[:, length // 2 :].mean(axis=1)
    motion = np.abs(early - late).mean(axis=1)
    still = np.flatnonzero(motion <= 2.0 * np.quantile(motion, STILL))
    level = spells.mean(axis=1)
    apart = np.array([np.abs(level - level[one]).mean(axis=1) for one in still])
    near = NEAR * float(np.quantile(apart, 0.99))
    visits = [_visits(row, near) for row in apart]
    best = int(np.argmax(visits))
    if visits[best] > 1:
        alike = still[apart[best, still] <= near]
        middle = np.median(level[alike], axis=0)
        chosen = alike[np.abs(level[alike] - middle).mean(axis=1).argmin()]
        return frames[starts[chosen] :][:length]
    size = np.abs(frames - _middle(frames))
    local = np.quantile((size > STRONG * size.max()).mean(axis=(1, 2)), 0.9) < LOCAL
    return _middle(frames) if local else frames[starts[still[0]] :][:length]


def _visits(apart: NDArray[np.floating], near: float) -> int:
    """Return how often spells, (n,) away from a level, came to it from well elsewhere."""
    known = apart[(apart <= near) | (apart > 2.0 * near)] <= near
    return int(known[:1].sum() + (known[1:] & ~known[:-1]).sum())


def _middle(frames: Frames) -> Frames:
    """Return the median of each taxel, (1, rows, columns)."""
    return np.median(frames, axis=0)[None].astype(np.float32)
