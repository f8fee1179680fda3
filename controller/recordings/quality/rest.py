"""Level of the untouched sensor, where no recording says it: the one returned to most often."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Frames

SPELL_S: Final = 0.5  # time for which the sensor is still at a level
LEAST: Final = 4  # frames of it
SPELLS: Final = 600  # most spells compared, evenly spread over the recording
STILL: Final = 0.25  # share of the spells that are still
NEAR: Final = 0.06  # of the greatest differences of two levels: they are one; twice as much: two
NOISE: Final = 3.0  # times the difference within a still spell: as near
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
    motion = _size(early - late)
    usual = float(np.quantile(motion, STILL))
    still = np.flatnonzero(motion <= 2.0 * usual)
    level = spells.mean(axis=1)
    apart = np.array([_size(level - level[one]) for one in still])
    near = max(NOISE * usual, NEAR * float(np.quantile(apart, 0.99)))
    quiet = np.isin(np.arange(len(level)), still)
    visits = [_visits((row <= near) & quiet, row > 2.0 * near) for row in apart]
    best = int(np.argmax(visits))
    if visits[best] > 1:
        alike = still[apart[best, still] <= near]
        middle = np.median(level[alike], axis=0)
        chosen = alike[_size(level[alike] - middle).argmin()]
        return frames[starts[chosen] :][:length]
    size = np.abs(frames - _middle(frames))
    local = np.quantile((size > STRONG * size.max()).mean(axis=(1, 2)), 0.9) < LOCAL
    return _middle(frames) if local else frames[starts[still[0]] :][:length]


def _size(change: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the root mean square of each change, (n, taxels): few taxels count, too."""
    return np.asarray(np.sqrt(np.square(change).mean(axis=1)))


def _visits(here: NDArray[np.bool_], elsewhere: NDArray[np.bool_]) -> int:
    """Return how often the sensor came from elsewhere to be still at a level, by spells (n,)."""
    known = here[here | elsewhere]
    return int(known[:1].sum() + (known[1:] & ~known[:-1]).sum())


def _middle(frames: Frames) -> Frames:
    """Return the median of each taxel, (1, rows, columns)."""
    return np.median(frames, axis=0)[None].astype(np.float32)
