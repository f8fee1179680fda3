"""Classification of changes of the skin: a touch, or one of the causes of drift.

The causes are pressure or temperature (all taxels), an electrode (one row or column), the film (one
taxel), and a finger that was part of the baseline and has left. A finger lowers the capacitance of
few taxels by much; no drift does that.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.ma
from numpy.typing import NDArray

from controller.shared.aliases import Change

Shape = Literal["touch", "lifted", "common", "electrode", "film", "scattered"]

# Third moment of the change by the 3/2 power of the second. Steady touches of 24 simulated sessions
# of both presets have -2.3 ... -1.0 (99 of 100 below -1.04); the same touches taken for rest and
# then lifted, 1.05 and more. Random drift lies between.
LIFTED: Final = 0.7
# Correlation of neighbours, as the dome spreads a touch: the same touches have .42 and more (99 of
# 100 above .58), independent taxels below .35 (99 of 100).
_SMOOTH: Final = 0.4
# Remaining share of the change without its cause. Of touches, the share off their median is 0.18
# and more (1 of 100 less), off the median and the strongest electrode 0.12, off the median and the
# strongest taxel 0.16.
_COMMON: Final = 0.15
_ELECTRODE: Final = 0.08
_FILM: Final = 0.1
_ROUNDS: Final = 4  # of the median polish; it has converged by then


def mean_of(values: NDArray[np.floating]) -> float:
    """Return `values.mean()` of an array of any shape, in a third of the time for a small one."""
    return float(np.add.reduce(values, axis=None) / values.size)


def tone(change: NDArray[np.floating]) -> float:
    """Return the skewness of a change of any shape: < 0: few taxels fall far, > 0: few rise far."""
    square = np.square(change)
    power = mean_of(square)
    return mean_of(square * change) / power**1.5 if power > 0.0 else 0.0


def unevenness(change: Change) -> float:
    """Return the share of a change, (rows, columns), not common to all taxels: 0 ... 1 and more."""
    size = float(np.abs(change).sum())
    return float(np.abs(change - np.median(change)).sum()) / size if size > 0.0 else 0.0


def smoothness(change: Change) -> float:
    """Return the correlation of neighbours in a change, (rows, columns): about 0 to 1."""
    power = float(np.square(change).sum())
    across, down = change[:, 1:] * change[:, :-1], change[1:] * change[:-1]
    pairs = across.size + down.size
    if not pairs or power == 0.0:
        return 0.0
    return float(across.sum() + down.sum()) / pairs / (power / change.size)


def shape(change: Change) -> Shape:
    """Return the class of a steady change.

    Args:
        change: z - 1, (rows, columns), averaged over enough frames to cancel noise.
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
    """Decomposition of a baseline drift: ln C' / C = common + row + column + film, taxel by taxel.

    Attributes:
        common: Of all taxels: pressure or temperature.
        rows: Of each row's electrode, (rows,), 0 for most.
        columns: Of each column's, (columns,).
        film: Of each taxel by itself, (rows, columns).
    """

    common: float
    rows: NDArray[np.float64]
    columns: NDArray[np.float64]
    film: Change


def causes(before: NDArray[np.floating], now: NDArray[np.floating]) -> DriftCauses:
    """Return the causes of a drift of the baseline, by a median polish, robust to single lines.

    Args:
        before: Earlier baseline, (rows, columns), any unit, above zero.
        now: Present baseline, same shape and unit.
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
