"""Dead taxels: thresholds, detection, and interpolation from their neighbours.

The skin is smooth, so a taxel is estimated from its neighbours by Gaussian-process regression with
a length of `SMOOTH` taxels; each set of dead taxels has its matrix of weights. The 5 of 25 taxels
of an electrode with an open lead are estimated in the same way.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.drift import mean_of
from controller.shared.aliases import Change, Mask
from controller.shared.taxel_measures import DEAD_TAXELS_SHARE, responses

# Least error on simulated touches among lengths of 1 to 2 taxels and floors of 0 to 1: 45 % of the
# change for single taxels, 35 % for inner electrodes, 55 % at the rim.
SMOOTH: Final = 1.3  # taxels
FLOOR: Final = 0.3  # of the variance is common to all taxels: the dome moves as a whole
NOISE: Final = 0.2  # of the variance

ALIVE: Final = 0.3  # least response of a sound taxel
MODEL: Final = 0.12  # standard deviation of a response, of what the fit says, without noise
SURE: Final = 3.0  # standard deviations between a dead taxel's mean response and `ALIVE`
MOST_SURE: Final = 2.9  # the same after one touch: it is never enough
OPPOSITE: Final = -0.1  # least response of a dead taxel; below, the touch has another form
DOUBT: Final = 1.5  # standard deviations of a response below `OPPOSITE` that are noise
NOISE_FRAMES: Final = 100.0  # in the estimate of the noise
LOW_PASS_S: Final = 0.15  # time constant of the change in which a touch is found
TOUCHED: Final = 5.0  # least size of a touch, standard deviations of the noise
LIGHT: Final = 0.05  # least size of a touch, z
TOUCH_S: Final = (0.1, 2.0)  # a shorter touch is noise; the rest of a longer one adds no evidence
GAP_S: Final = 0.15  # after a touch; what follows sooner belongs to it


class TaxelInterpolator:
    """Estimates of dead taxels from the others."""

    def __init__(self, rows: int, columns: int) -> None:
        """Prepare for a grid."""
        self._shape = (rows, columns)
        grid = np.indices(self._shape).reshape(2, -1).T
        square = np.square(grid[:, None] - grid[None]).sum(axis=2)
        self._kernel = np.exp(-square / (2.0 * SMOOTH**2)) + FLOOR
        self._known: dict[bytes, NDArray[np.float64]] = {}
        # The weights of `_solve` for each taxel alone, by one inverse (Rasmussen and Williams,
        # Gaussian Processes for Machine Learning, equation 5.12), before the first frame.
        inverse = np.linalg.inv(self._kernel + NOISE * np.eye(rows * columns))
        self._others = -inverse / np.diag(inverse)[:, None]
        np.fill_diagonal(self._others, 0.0)

    def fill(self, change: Change, broken: Mask) -> Change:
        """Return the change, (rows, columns), with estimates of broken taxels; 0 if all are."""
        if broken.all():
            return np.zeros_like(change)
        filled = change.copy()
        filled[broken] = self._weights(broken) @ change[~broken]
        return filled

    def around(self, change: Change) -> Change:
        """Return the estimate of every taxel, (rows, columns), from all others."""
        return np.asarray((self._others @ change.ravel()).reshape(self._shape))

    def _weights(self, broken: Mask) -> NDArray[np.float64]:
        """Return the weights of the other taxels, (broken, others)."""
        key = broken.tobytes()
        if key not in self._known:
            if len(self._known) > 64:  # a loose contact makes many masks; they are cheap to compute
                self._known.clear()
            self._known[key] = self._solve(broken.ravel())
        return self._known[key]

    def _solve(self, broken: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the estimate of broken taxels, a flat mask, as weights, (broken, others)."""
        among = self._kernel[np.ix_(~broken, ~broken)]
        across = self._kernel[np.ix_(~broken, broken)]
        return np.asarray(np.linalg.solve(among + NOISE * np.eye(len(among)), across).T)


class ResponseMonitor:
    """Detection of taxels that do not respond to touches on them, during play.

    Touches are segmented by a low-pass of the change, so that noise neither hides nor splits them.
    Its state is `evidence` and `counts`; `restore` continues exactly with them.

    Attributes:
        evidence: Sum of the present touch's changes; of each taxel's touches, the sum of its
            responses and of 1, both over their variance; the low-pass of the change, and the
            latest change, (5, rows, columns).
        counts: Frames of the present touch, those in the sum and all; its greatest size, z; noise
            of a taxel's change, a variance; frames seen; frames since the last touch, (6,).
        dead: Dead taxels, (rows, columns); None: none, or so many that it is another fault.
    """

    def __init__(self, rows: int, columns: int, rate_hz: float) -> None:
        """Begin without evidence."""
        self.evidence = np.zeros((5, rows, columns))
        self.counts = np.zeros(6)
        self.dead: Mask | None = None
        self._shortest, self._longest = (max(1, round(t_s * rate_hz)) for t_s in TOUCH_S)
        self._pace = min(1.0, 1.0 / (LOW_PASS_S * rate_hz))
        self._gap = max(1, round(GAP_S * rate_hz))
        patch = min(rows, 2) * min(columns, 2)
        self._least = TOUCHED * np.sqrt(self._pace / (2.0 - self._pace) / patch)

    def restore(self, evidence: NDArray[np.float64], counts: NDArray[np.float64]) -> None:
        """Continue with evidence, (5, rows, columns), and counts, (6,), of another monitor."""
        if len(evidence) == len(self.evidence):  # older versions segmented touches otherwise
            self.evidence, self.counts = evidence.copy(), counts.copy()
        self._judge()

    def learn(self, change: Change, interpolator: TaxelInterpolator) -> None:
        """Take the next frame's change, (rows, columns), as it was read."""
        touch, _, _, level, last = self.evidence
        self.counts[4] += 1.0
        noise = mean_of(np.square(change - last)) / 2.0
        self.counts[3] += (noise - self.counts[3]) / min(self.counts[4], NOISE_FRAMES)
        last[:] = change
        level += self._pace * (change - level)
        size = _size(level)
        if size > max(LIGHT, self._least * np.sqrt(self.counts[3]), self.counts[2] / 2.0):
            self.counts[1:3] = self.counts[1] + 1.0, max(size, self.counts[2])
            self.counts[5] = 0.0
            if self.counts[1] <= self._longest:
                touch += change
                self.counts[0] += 1.0
            return
        self.counts[5] += 1.0
        if self.counts[5] < self._gap:
            return
        if self.counts[0] >= self._shortest:
            self._weigh(interpolator)
            self._judge()
        touch[:], self.counts[:3] = 0.0, 0.0

    def _weigh(self, interpolator: TaxelInterpolator) -> None:
        """Add the responses to the touch that has ended; one that contradicts begins anew."""
        touch, noise = self.evidence[0] / self.counts[0], self.counts[3] / self.counts[0]
        whole = touch if self.dead is None else interpolator.fill(touch, self.dead)
        along, weight = self.evidence[1:3]
        for taxel, expected, response in responses(touch, whole, interpolator.around(whole), noise):
            precision = 1.0 / (MODEL**2 + noise / expected**2)
            if response < OPPOSITE - DOUBT / np.sqrt(precision):
                continue
            if (along[taxel] < ALIVE * weight[taxel]) != (response < ALIVE):
                along[taxel] = weight[taxel] = 0.0
            least = ALIVE - MOST_SURE / np.sqrt(precision)
            along[taxel] += precision * max(response, least)
            weight[taxel] += precision

    def _judge(self) -> None:
        along, weight = self.evidence[1:3]
        dead = along + SURE * np.sqrt(weight) < ALIVE * weight
        self.dead = dead if 0.0 < float(dead.mean()) <= DEAD_TAXELS_SHARE else None


def _size(change: Change) -> float:
    """Return the greatest mean change of 2×2 taxels, of fewer on a single row or column."""
    for _ in range(2):
        change = change.T if len(change) < 2 else (change[1:] + change[:-1]).T / 2.0
    return max(float(change.max()), -float(change.min()))
