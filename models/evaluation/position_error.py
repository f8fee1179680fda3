"""Calibration of a bundle's position error: measured once, reported with every touch.

A place is the less sure the noisier the image is that it was told from, and how noisy that is the
device knows (controller/recognition/touch_position.py). Two figures make a deviation in grid units
of it; they are those under which the errors that were measured are most likely, were they normal
ones.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.touch_position import PositionSpread

FEWEST: Final = 20  # presses that tell anything
BARE: Final = PositionSpread(0.0, 1.0)  # of a bundle that is measured: it tells the blur itself
_ROUNDS: Final = 20
_LEAST: Final = 1e-6  # variance: no place is surer than a thousandth

Values = NDArray[np.float64]


def measure(blur: Values, errors: Values) -> PositionSpread | None:
    """Return how far off places are; None: there are too few of them to tell.

    Args:
        blur: `TouchImage.blur` of each image, (n,).
        errors: How far off its place was, grid units, (n, 2).
    """
    known = np.isfinite(blur) & np.isfinite(errors).all(axis=1)
    if known.sum() < FEWEST:
        return None
    squares = np.square(errors[known]).mean(axis=1)
    causes = np.stack([np.ones(known.sum()), np.square(blur[known])], axis=1)
    share = np.array([squares.mean(), 0.0])
    for _ in range(_ROUNDS):  # scoring: what is surer counts more
        variance = np.maximum(causes @ share, _LEAST)
        share = _least_squares(causes / variance[:, None], squares / variance)
    floor, noise = np.sqrt(np.maximum(share, 0.0)).tolist()
    return PositionSpread(round(max(floor, _LEAST**0.5), 4), round(noise, 4))


def within(sigma: Values, errors: Values) -> tuple[float, float]:
    """Return the shares of errors within one and two deviations, over both axes; NaN: none.

    Args:
        sigma: What was told of each place, grid units, (n,).
        errors: How far off it was, (n, 2).
    """
    known = np.isfinite(sigma)
    if not known.any():
        return float("nan"), float("nan")
    off = np.abs(errors[known]) / sigma[known, None]
    return float((off <= 1.0).mean()), float((off <= 2.0).mean())


def _least_squares(causes: Values, effect: Values) -> Values:
    """Return what each cause contributes, none of them negatively."""
    found, *_ = np.linalg.lstsq(causes, effect, rcond=None)
    if (found >= 0.0).all():
        return np.asarray(found)
    kept = int(found.argmax())  # of two causes one is none
    alone = np.zeros(2)
    alone[kept] = max(0.0, float(causes[:, kept] @ effect / (causes[:, kept] @ causes[:, kept])))
    return alone
