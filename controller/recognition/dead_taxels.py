"""Dead taxels: thresholds, detection, and interpolation from their neighbours.

The skin is smooth, so a taxel is estimated from its neighbours: the best guess for a field that is
smooth over `SMOOTH` taxels (Gaussian-process regression; a matrix for each set of broken taxels).
An electrode whose lead is off, 5 of 25 taxels, is filled in the same way.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.drift import TOUCHED, tone

Change = NDArray[np.float64]  # z - 1, (rows, columns)
Mask = NDArray[np.bool_]  # (rows, columns)

# A taxel that reads less than this share of what the others read at rest has no lead: an open one
# reads some 1 of 41 pF, a pressed one never so little.
NO_LEAD: Final = 0.2

# Of kernels 1 to 2 taxels wide with floors of 0 to 1, these err least on simulated touches: single
# taxels by 45 % of their change, inner electrodes by 35 %, those at the rim by 55 %.
SMOOTH: Final = 1.3  # taxels
FLOOR: Final = 0.3  # of the variance is common to all: the dome gives way as a whole
NOISE: Final = 0.2  # of the variance

# In 48 simulated sessions of both presets, over any 100 frames under touches, dead taxels follow
# their surroundings with -.51 to .06, leaky ones with .22 to .83, sound ones with .17 to 1.7.
DEAD: Final = 0.12
ALIVE: Final = 0.3
MEMORY: Final = 100  # touched frames over which this is judged
MOST: Final = 0.2  # of the taxels: where more seem dead, something else is wrong
TOUCH_S: Final = 2.0  # of each touch count: a long one adds no evidence
_FELT: Final = 0.1  # of what the middle taxel's surroundings feel


def without_lead(level: NDArray[np.floating]) -> Mask:
    """Return which taxels of a rest image, (rows, columns) in picofarads, have no lead."""
    return np.asarray(level < NO_LEAD * np.median(level))


def leadless(frame: NDArray[np.floating], rest: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which taxels have no lead, now or at rest.

    Args:
        frame: One scan or several, (..., rows, columns), picofarads.
        rest: The untouched sensor, (rows, columns), same unit.
    """
    return np.asarray(~(np.minimum(frame, rest) > NO_LEAD * float(rest.mean())))


class TaxelInterpolator:
    """Estimates what broken taxels would have felt."""

    def __init__(self, rows: int, columns: int) -> None:
        """Prepare for a grid."""
        self._shape = (rows, columns)
        grid = np.indices(self._shape).reshape(2, -1).T
        square = np.square(grid[:, None] - grid[None]).sum(axis=2)
        self._kernel = np.exp(-square / (2.0 * SMOOTH**2)) + FLOOR
        self._known: dict[bytes, NDArray[np.float64]] = {}
        # What `_solve` gives for each taxel alone, of one inverse (Rasmussen and Williams, Gaussian
        # Processes for Machine Learning, equation 5.12): at once, not in the step that needs it.
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
            if len(self._known) > 64:  # a loose contact makes many masks; they are cheap to redo
                self._known.clear()
            self._known[key] = self._solve(broken.ravel())
        return self._known[key]

    def _solve(self, broken: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the guess for broken taxels as weights of the others, (broken, others)."""
        among = self._kernel[np.ix_(~broken, ~broken)]
        across = self._kernel[np.ix_(~broken, broken)]
        return np.asarray(np.linalg.solve(among + NOISE * np.eye(len(among)), across).T)


class ResponseMonitor:
    """Finds taxels that do not answer to touch, while people play.

    Pure but for what it remembers, which `restore` takes, for an exact continuation elsewhere.

    Attributes:
        evidence: How much each taxel goes along with its surroundings, how much those feel, and
            whether it counts as dead, (3, rows, columns).
        counts: Touched frames that count, and frames of the present touch, (2,).
        dead: Taxels that do not answer; None: none, or so many that something else is wrong.
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

    def learn(self, change: Change, filler: TaxelInterpolator, *, quiet: bool) -> None:
        """Take the next frame's change, (rows, columns), as it was read."""
        if quiet:
            self.counts[1] = 0.0
            return
        self.counts[1] += 1.0
        if self.counts[1] > self._longest or tone(change) > TOUCHED:
            return
        whole = change if self.dead is None else filler.fill(change, self.dead)
        around = filler.around(whole)
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
        self.dead = dead if 0.0 < dead.mean() <= MOST else None


def response_slope(along: NDArray[np.float64], felt: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how each taxel follows its surroundings under touch; below `DEAD` it is dead.

    Args:
        along: Sum of its change times that of its surroundings, (rows, columns).
        felt: Sum of the squared change of its surroundings, (rows, columns).

    Returns:
        Slope of the regression, (rows, columns); NaN far from every touch.
    """
    near = felt > _FELT * float(np.median(felt))
    return np.divide(along, felt, out=np.full_like(felt, np.nan), where=near)
