"""From counts to picofarads: the divider of a row, inverted exactly; pure.

While column i stands at the supply and row j floats, the taxel C_ij divides against all else on the
row: its neighbours, whose columns are grounded, and the row's own capacitance C_r. R_m bleeds the
charge away:

    share_ij = C_ij / (T_j + C_r) exp(-age / (R_m (T_j + C_r))),   T_j the sum of the row's taxels

The shares of one row sum up to T_j / (T_j + C_r), so a frame tells its own ghosting: no neighbour's
nominal value is needed, and C_r is only a scale, which cancels in z = C / C0.

The price is noise: an error of a row's sum is one of all its taxels alike. So sums that change by
no more than their noise are averaged over a few frames, and those that change by more are believed
at once.
"""

from typing import Final

import numpy as np

from controller.sensors.hardware.wiring import Wiring
from controller.shared.aliases import Array

LEAST_PF: Final = 0.05  # what no taxel is below: images divide by the rest
_FULLEST: Final = 0.98  # a row whose shares sum up to more is broken, not large
_ROUNDS: Final = 3  # of the bleeding, each 100 times closer than the last
_WEIGHT: Final = 0.2  # of a new sum that differs by less than the noise
_BELIEVED: Final = 3.0  # deviations from which on a sum is believed at once
_NOISE_WEIGHT: Final = 0.05  # of a new difference in the noise


class Inversion:
    """Counts to picofarads, frame by frame."""

    def __init__(self, wiring: Wiring, full: int) -> None:
        """Prepare for a wiring; `full` are the counts of full scale, which is the supply."""
        self._row_pf, self._bleed = wiring.circuit.row_pf, wiring.circuit.bleed_mohm
        self._full = full * wiring.circuit.reach
        self._sums: _Sums | None = None

    def picofarads(self, counts: Array, age_s: Array, dark: Array) -> Array:
        """Return what capacitances gave these counts, pF, (rows, columns).

        Args:
            counts: A frame, (rows, columns).
            age_s: When each was read, seconds since its column's rise, same shape.
            dark: What each row reads while no column is raised, counts, (rows,).
        """
        share = (counts - dark[:, None]) / self._full
        kept = share
        for _ in range(_ROUNDS):
            kept = share * np.exp(age_s / (self._bleed * self._total_pf(kept.sum(axis=1)) * 1e-6))
        sums = kept.sum(axis=1)
        if self._sums is None:
            self._sums = _Sums(sums)
        total_pf = self._total_pf(self._sums.step(sums))
        return np.asarray(np.maximum(kept * total_pf, LEAST_PF))

    def _total_pf(self, sums: Array) -> Array:
        """Return everything on a row, T_j + C_r, (rows, 1), for the sums of its shares."""
        return np.asarray(self._row_pf / (1.0 - np.clip(sums, 0.0, _FULLEST))[:, None])


class _Sums:
    """The rows' sums, quieter than they come."""

    def __init__(self, first: Array) -> None:
        """Begin with the first sums, (rows,)."""
        self._mean = self._last = first
        self._noise = np.zeros_like(first)  # variance of a sum
        self._seen = 0

    def step(self, sums: Array) -> Array:
        """Return the sums to believe, (rows,)."""
        changed, self._last = (sums - self._last) ** 2 / 2.0, sums
        self._seen += 1
        if self._seen > 1:
            weight = max(_NOISE_WEIGHT, 1.0 / (self._seen - 1))
            limit = 1.0 if self._seen < 1.0 / _NOISE_WEIGHT else _BELIEVED**2 * self._noise
            self._noise = self._noise + weight * (np.minimum(changed, limit) - self._noise)
        far = (sums - self._mean) ** 2 / np.maximum(_BELIEVED**2 * self._noise, 1e-12)
        self._mean = self._mean + np.clip(far, _WEIGHT, 1.0) * (sums - self._mean)
        return self._mean
