"""From counts to picofarads: the divider of a row, inverted exactly; pure.

While column i stands at the supply and row j floats, the taxel C_ij divides against all else on the
row: its neighbours, whose columns are grounded, and the row's own capacitance C_r. R_m bleeds the
charge away:

    share_ij = C_ij / (T_j + C_r) exp(-age / (R_m (T_j + C_r))),   T_j the sum of the row's taxels

The shares of one row sum up to T_j / (T_j + C_r), so a frame tells its own ghosting: no neighbour's
nominal value is needed, and C_r is only a scale, which cancels in z = C / C0.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.hardware.wiring import Wiring

Array = NDArray[np.float64]

LEAST_PF: Final = 0.05  # what no taxel is below: images divide by the rest
_FULLEST: Final = 0.98  # a row whose shares sum up to more is broken, not large
_ROUNDS: Final = 3  # of the bleeding, each 100 times closer than the last


def picofarads(wiring: Wiring, counts: Array, age_s: Array, dark: Array, full: int) -> Array:
    """Return what capacitances gave these counts, pF, (rows, columns).

    Args:
        wiring: The circuit, and each taxel's gain.
        counts: A frame, (rows, columns).
        age_s: When each was read, seconds since its column's rise, same shape.
        dark: What each row reads while no column is raised, counts, (rows,).
        full: Counts of full scale, which is the supply.
    """
    row_pf, bleed_mohm = wiring.circuit.row_pf, wiring.circuit.bleed_mohm
    share = (counts - dark[:, None]) / (full * wiring.circuit.reach)
    kept = share
    for _ in range(_ROUNDS):
        total_pf = row_pf / (1.0 - np.clip(kept.sum(axis=1, keepdims=True), 0.0, _FULLEST))
        kept = share * np.exp(age_s / (bleed_mohm * total_pf * 1e-6))
    total_pf = row_pf / (1.0 - np.clip(kept.sum(axis=1, keepdims=True), 0.0, _FULLEST))
    gain = np.array(wiring.gain) if wiring.gain else 1.0
    return np.asarray(np.maximum(kept * total_pf * gain, LEAST_PF))
