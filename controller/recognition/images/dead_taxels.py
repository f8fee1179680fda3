"""Dead taxels: detection by their missing response, and interpolation from their neighbours.

The skin is smooth, so a taxel is estimated from its neighbours by Gaussian-process regression with
a length of `SMOOTH_TAXELS`; each set of dead taxels has its matrix of weights. The 5 of 25 taxels
of an electrode with an open lead are estimated in the same way.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.drift import mean_of
from controller.shared.aliases import Change, Mask
from controller.shared.taxel_measures import DEAD_TAXELS_SHARE, touch_responses

# Least error on simulated touches among lengths of 1 to 2 taxels and floors of 0 to 1: 45 % of the
# change for single taxels, 35 % for inner electrodes, 55 % at the rim.
SMOOTH_TAXELS: Final = 1.3
COMMON_SHARE: Final = 0.3  # of the variance is common to all taxels: the dome moves as a whole
NOISE_SHARE: Final = 0.2  # of the variance

# Sequential test (CUSUM) of "responds with 0" against "responds with 1", in log-likelihood. Two
# ratios are halfway at .5; systematic errors of single places take a sound taxel down to .4. In ten
# minutes of touches on each of 18 simulated orbs, sound taxels reached 3.0 (nominal) and 11.6
# (paper-snr).
HALFWAY_RATIO: Final = 0.35
RATIO_SD: Final = 0.2  # of a sound taxel's ratio, without noise
DEAD_EVIDENCE: Final = 16.0  # log-likelihood
TOUCH_EVIDENCE: Final = 3.0  # most of one touch: a taxel is dead after six or more
OPPOSITE_RATIO: Final = -0.3  # least ratio of a dead taxel; below, the touch has another form
OPPOSITE_NOISE_RATIO: Final = 2.0  # standard deviations below it that are noise

NOISE_FRAMES: Final = 100.0  # in the estimate of the noise
LOW_PASS_S: Final = 0.15  # time constant of the change in which a touch is found
TOUCH_NOISE_RATIO: Final = 3.0  # least size of a touch, standard deviations of the noise
TOUCH_Z: Final = 0.05  # least size of a touch
TOUCH_S: Final = (0.1, 2.0)  # a shorter touch is noise; the rest of a longer one adds no evidence
GAP_S: Final = 0.15  # after a touch; what follows sooner belongs to it
REST_S: Final = 3.0  # time constant of the level between touches: the baseline waits for a pause
CALM_SHARE: Final = 0.6  # of the least size of a touch; above, a frame may be one


class TaxelInterpolator:
    """Estimates of dead taxels from the others."""

    def __init__(self, rows: int, columns: int) -> None:
        """Prepare for a grid."""
        self._shape = (rows, columns)
        grid = np.indices(self._shape).reshape(2, -1).T
        square = np.square(grid[:, None] - grid[None]).sum(axis=2)
        self._kernel = np.exp(-square / (2.0 * SMOOTH_TAXELS**2)) + COMMON_SHARE
        self._known: dict[bytes, NDArray[np.float64]] = {}
        # The weights of `_solve` for each taxel alone, by one inverse (Rasmussen and Williams,
        # Gaussian Processes for Machine Learning, equation 5.12), before the first frame.
        inverse = np.linalg.inv(self._kernel + NOISE_SHARE * np.eye(rows * columns))
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
        return np.asarray(np.linalg.solve(among + NOISE_SHARE * np.eye(len(among)), across).T)


class ResponseMonitor:
    """Detection of taxels that do not respond to touches on them, during play.

    Touches are segmented by a low-pass of the change, so that noise neither hides nor splits them.
    Its state is `evidence` and `counts`; `restore` continues exactly with them.

    Attributes:
        evidence: Sum of the present touch's changes; evidence that each taxel is dead; low-pass of
            the change; latest change; level between touches, (5, rows, columns).
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
        self._rest_pace = min(1.0, 1.0 / (REST_S * rate_hz))
        self._gap = max(1, round(GAP_S * rate_hz))
        patch = min(rows, 2) * min(columns, 2)
        self._least = TOUCH_NOISE_RATIO * np.sqrt(self._pace / (2.0 - self._pace) / patch)

    def restore(self, evidence: NDArray[np.float64], counts: NDArray[np.float64]) -> None:
        """Continue with evidence, (5, rows, columns), and counts, (6,), of another monitor."""
        self.evidence, self.counts = evidence.copy(), counts.copy()
        self._judge()

    def learn(self, change: Change, interpolator: TaxelInterpolator) -> None:
        """Take the next frame's change, (rows, columns), as it was read."""
        touch, _, level, last, rest = self.evidence
        self.counts[4] += 1.0
        noise = mean_of(np.square(change - last)) / 2.0
        self.counts[3] += (noise - self.counts[3]) / min(self.counts[4], NOISE_FRAMES)
        last[:] = change
        change = change - rest
        level += self._pace * (change - level)
        size, least = _size(level), max(TOUCH_Z, self._least * np.sqrt(self.counts[3]))
        if size > max(least, self.counts[2] / 2.0):
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
        if size < CALM_SHARE * least:
            rest += self._rest_pace * change
            level -= self._rest_pace * change

    def _weigh(self, interpolator: TaxelInterpolator) -> None:
        """Add the responses to the touch that has ended to the evidence."""
        frames = self.counts[0]
        touch, noise = self.evidence[0] / frames, self.counts[3] / frames
        noise *= 1.0 + self._rest_pace * frames / 2.0  # that of the level between touches
        whole = touch if self.dead is None else interpolator.fill(touch, self.dead)
        dead = self.evidence[1]
        for one in touch_responses(touch, whole, interpolator.around(whole), noise):
            precision = 1.0 / (RATIO_SD**2 + noise / one.expected**2)
            if one.ratio < OPPOSITE_RATIO - OPPOSITE_NOISE_RATIO / np.sqrt(precision):
                continue
            step = np.clip(precision * (HALFWAY_RATIO - one.ratio), -TOUCH_EVIDENCE, TOUCH_EVIDENCE)
            dead[one.taxel] = np.clip(dead[one.taxel] + step, 0.0, 2.0 * DEAD_EVIDENCE)

    def _judge(self) -> None:
        dead = self.evidence[1] > DEAD_EVIDENCE
        self.dead = dead if 0.0 < float(dead.mean()) <= DEAD_TAXELS_SHARE else None


def _size(change: Change) -> float:
    """Return the greatest mean change of 2×2 taxels, of fewer on a single row or column."""
    for _ in range(2):
        change = change.T if len(change) < 2 else (change[1:] + change[:-1]).T / 2.0
    return max(float(change.max()), -float(change.min()))
