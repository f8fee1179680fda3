"""Classification of changes of the skin: a touch, or one of the causes of drift.

They are air or warmth (all taxels alike), an electrode (one row or column), the film (one taxel);
and a finger that was taken into rest and has left. A finger squeezes the skin under it, so it takes
capacitance from few taxels and much; nothing that drifts does that.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.ma
from numpy.typing import NDArray

Change = NDArray[np.float64]  # z - 1, (rows, columns)
Shape = Literal["touch", "lifted", "common", "electrode", "film", "scattered"]

# Third moment of the change by the 3/2 power of the second. Steady touches of 24 simulated sessions
# of both presets have -2.3 ... -1.0 (99 of 100 below -1.04); the same touches taken for rest and
# then lifted, 1.05 and more. What drifts at random lies between.
LIFTED: Final = 0.7
TOUCHED: Final = -LIFTED
# How alike neighbours are: the dome carries a touch along. The same touches have .42 and more (99
# of 100 above .58), taxels that change each by itself below .35 (99 of 100).
_SMOOTH: Final = 0.4
# What is left of the change, as a share of it, once its cause is taken away. Of all touches, what
# lies off their middle value is 0.18 of them and more (1 of 100 less), off the middle value and the
# strongest electrode 0.12, off the middle value and the strongest taxel 0.16.
_COMMON: Final = 0.15
_ELECTRODE: Final = 0.08
_FILM: Final = 0.1
_ROUNDS: Final = 4  # of the median polish: more change nothing


def tone(change: NDArray[np.floating]) -> float:
    """Return how lopsided a change of any shape is: < 0: few lose much, > 0: few gain much."""
    square = np.square(change)
    power = float(square.mean())
    return float((square * change).mean()) / power**1.5 if power > 0.0 else 0.0


def unevenness(change: Change) -> float:
    """Return which share of a change, (rows, columns), is not common to all, 0 ... 1 and beyond."""
    size = float(np.abs(change).sum())
    return float(np.abs(change - np.median(change)).sum()) / size if size > 0.0 else 0.0


def smoothness(change: Change) -> float:
    """Return how alike neighbours in a change, (rows, columns), are: from about 0 to 1."""
    power = float(np.square(change).sum())
    across, down = change[:, 1:] * change[:, :-1], change[1:] * change[:-1]
    pairs = across.size + down.size
    if not pairs or power == 0.0:
        return 0.0
    return float(across.sum() + down.sum()) / pairs / (power / change.size)


def shape(change: Change) -> Shape:
    """Return what a steady change looks like.

    Args:
        change: z - 1, (rows, columns), averaged over so many frames that noise does not matter.
    """
    size = np.abs(change).sum()
    off = np.abs(change - np.median(change))
    left = off.sum()
    if left < _COMMON * size:
        return "common"
    if left - off.max() < _FILM * size:
        return "film"
    if left - max(off.sum(axis=0).max(), off.sum(axis=1).max()) < _ELECTRODE * size:
        return "electrode"
    lopsided = tone(change)
    if abs(lopsided) < LIFTED or smoothness(change) < _SMOOTH:
        return "scattered"
    return "touch" if lopsided < 0.0 else "lifted"


@dataclass(frozen=True, slots=True)
class DriftCauses:
    """A drift of rest taken apart: ln C' / C = common + row + column + film, taxel by taxel.

    Attributes:
        common: Of all taxels: air or temperature.
        rows: Of each row's electrode, (rows,), 0 for most.
        columns: Of each column's, (columns,).
        film: Of each taxel by itself, (rows, columns).
    """

    common: float
    rows: NDArray[np.float64]
    columns: NDArray[np.float64]
    film: Change


def causes(before: NDArray[np.floating], now: NDArray[np.floating]) -> DriftCauses:
    """Return why rest has drifted, by a median polish: one bad line or taxel pulls no other along.

    Args:
        before: Rest as it was, (rows, columns), any unit, above zero.
        now: Rest as it is, same shape and unit.
    """
    film = np.log(now.astype(np.float64)) - np.log(before.astype(np.float64))
    rows, columns = np.zeros(film.shape[0]), np.zeros(film.shape[1])
    common = float(np.median(film))
    film = film - common
    for _ in range(_ROUNDS):
        for part, axis in ((rows, 1), (columns, 0)):
            middles = np.median(film, axis=axis)
            part += middles
            film = film - np.expand_dims(middles, axis)
            middle = float(np.median(part))
            part -= middle
            common += middle
    return DriftCauses(common, rows, columns, film)
