"""Dead taxels: thresholds, detection, and interpolation from their neighbours.

The skin is smooth, so a taxel is estimated from its neighbours by Gaussian-process regression with
a length of `SMOOTH` taxels; each set of dead taxels has its matrix of weights. The 5 of 25 taxels
of an electrode with an open lead are estimated in the same way.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.drift import TOUCHED, mean_of, tone

Change = NDArray[np.float64]  # z - 1, (rows, columns)
Mask = NDArray[np.bool_]  # (rows, columns)

# A taxel below this share of the others' baseline has an open lead: it reads about 1 of 41 pF, and
# a pressed taxel never so little.
NO_LEAD: Final = 0.2

# Least error on simulated touches among lengths of 1 to 2 taxels and floors of 0 to 1: 45 % of the
# change for single taxels, 35 % for inner electrodes, 55 % at the rim.
SMOOTH: Final = 1.3  # taxels
FLOOR: Final = 0.3  # of the variance is common to all taxels: the dome moves as a whole
NOISE: Final = 0.2  # of the variance

# In 48 simulated sessions of both presets, over any 100 frames under touches, dead taxels follow
# their surroundings with -.51 to .06, leaky ones with .22 to .83, sound ones with .17 to 1.7.
DEAD: Final = 0.12
ALIVE: Final = 0.3
MEMORY: Final = 100  # touched frames in the running sums
MOST: Final = 0.2  # of the taxels; more than that is another fault
TOUCH_S: Final = 2.0  # of each touch are used: a longer one adds no evidence
_FELT: Final = 0.1  # of the median power of the surroundings


def without_lead(level: NDArray[np.floating]) -> Mask:
    """Return which taxels of a rest image, (rows, columns) in picofarads, have no lead."""
    return np.asarray(level < NO_LEAD * np.median(level))


def leadless(frame: NDArray[np.floating], rest: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which taxels have no lead, now or at rest.

    Args:
        frame: One scan or several, (..., rows, columns), picofarads.
        rest: The untouched sensor, (rows, columns), same unit.
    """
    return np.asarray(~(np.minimum(frame, rest) > NO_LEAD * mean_of(rest)))


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
    """Detection of taxels that do not respond to touch, during play.

    Its state is `evidence` and `counts`; `restore` continues exactly with them.

    Attributes:
        evidence: Covariance of each taxel with its surroundings, power of those, and 1 for a dead
            taxel, (3, rows, columns).
        counts: Touched frames in the sums, and frames of the present touch, (2,).
        dead: Dead taxels, (rows, columns); None: none, or so many that it is another fault.
    """

    def __init__(self, rows: int, columns: int, rate_hz: float) -> None:
        """Begin without evidence."""
        self.evidence = np.zeros((3, rows, columns))
        self.counts = np.zeros(2)
        self.dead: Mask | None = None
        self._longest = max(1, round(TOUCH_S * rate_hz))

    def restore(self, evidence: NDArray[np.float64], counts: NDArray[np.float64]) -> None:
        """Continue with evidence, (3, rows, columns), and counts, (2,), of another monitor."""
        self.evidence, self.counts = evidence.copy(), counts.copy()
        self._judge()

    def learn(self, change: Change, interpolator: TaxelInterpolator, *, quiet: bool) -> None:
        """Take the next frame's change, (rows, columns), as it was read."""
        if quiet:
            self.counts[1] = 0.0
            return
        self.counts[1] += 1.0
        if self.counts[1] > self._longest or tone(change) > TOUCHED:
            return
        whole = change if self.dead is None else interpolator.fill(change, self.dead)
        around = interpolator.around(whole)
        keep = 1.0 - 1.0 / MEMORY
        along, felt, dead = self.evidence
        along *= keep
        along += change * around
        felt *= keep
        felt += around * around
        self.counts[0] += 1.0
        if self.counts[0] >= MEMORY:
            slope = response_slope(along, felt)
            dead[slope < DEAD] = 1.0
            dead[slope > ALIVE] = 0.0
            self._judge()

    def _judge(self) -> None:
        dead = self.evidence[2] > 0.0
        self.dead = dead if 0.0 < float(dead.mean()) <= MOST else None


def response_slope(along: NDArray[np.float64], felt: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the response of each taxel relative to its surroundings; below `DEAD` it is dead.

    Args:
        along: Sum of its change times that of its surroundings, (rows, columns).
        felt: Sum of the squared change of its surroundings, (rows, columns).

    Returns:
        Slope of the regression, (rows, columns); NaN far from every touch.
    """
    near = felt > _FELT * float(np.median(felt))
    return np.divide(along, felt, out=np.full_like(felt, np.nan), where=near)
