"""Calibration of a bundle's position error: measured once, reported with every touch.

The error of a position grows with the noise of its image, which the device estimates
(controller/recognition/touch_position.py). Two parameters turn that into a standard deviation in
grid units: the maximum-likelihood ones of normal errors.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.touch_position import PositionSpread

FEWEST: Final = 20  # presses for an estimate
BARE: Final = PositionSpread(0.0, 1.0)  # of a bundle that is measured: it reports the blur itself
ON_SITE: Final = 0.25  # grid units from a taxel, the finger's aim being no better
_ROUNDS: Final = 20
_LEAST: Final = 1e-6  # variance: no standard deviation is below a thousandth

Values = NDArray[np.float64]  # (n,) of images, or (n, 2) of their errors


def measure(blur: Values, errors: Values) -> PositionSpread | None:
    """Return the error of positions from blur (n,) and errors (n, 2), grid units; None: too few."""
    known = np.isfinite(blur) & np.isfinite(errors).all(axis=1)
    if known.sum() < FEWEST:
        return None
    squares = np.square(errors[known]).mean(axis=1)
    causes = np.stack([np.ones(known.sum()), np.square(blur[known])], axis=1)
    share = np.array([squares.mean(), 0.0])
    for _ in range(_ROUNDS):  # scoring: precise positions weigh more
        variance = np.maximum(causes @ share, _LEAST)
        share = _least_squares(causes / variance[:, None], squares / variance)
    floor, noise = np.sqrt(np.maximum(share, 0.0)).tolist()
    return PositionSpread(round(max(floor, _LEAST**0.5), 4), round(noise, 4))


def within(sigma: Values, errors: Values) -> tuple[float, float]:
    """Return the shares of errors (n, 2) within one and two sigma (n,), grid units; NaN: none."""
    known = np.isfinite(sigma)
    if not known.any():
        return float("nan"), float("nan")
    off = np.abs(errors[known]) / sigma[known, None]
    return float((off <= 1.0).mean()), float((off <= 2.0).mean())


def between_taxels(places: Values) -> NDArray[np.bool_]:
    """Return which places (n, 2), grid units, are not within `ON_SITE` of a taxel, (n,)."""
    return np.asarray(np.abs(places - np.rint(places)).max(axis=1, initial=0.0) > ON_SITE)


def _least_squares(causes: Values, effect: Values) -> Values:
    """Return the share of each cause, (2,), none below zero; causes (n, 2), effect (n,)."""
    found, *_ = np.linalg.lstsq(causes, effect, rcond=None)
    if (found >= 0.0).all():
        return np.asarray(found)
    kept = int(found.argmax())  # of two causes one is none
    alone = np.zeros(2)
    alone[kept] = max(0.0, float(causes[:, kept] @ effect / (causes[:, kept] @ causes[:, kept])))
    return alone
