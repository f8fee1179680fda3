"""Touch strength: how deeply a person presses, relative to the hands a bundle was trained with.

The deviation z - 1 of a window is divided by it before the gesture network, so that a light or a
heavy hand looks like a usual one. It is found from presses: their mean deviation over the taxels,
relative to that of the bundle's presses. The mean is nearly proportional to the depth, and its
noise is a fifth of a taxel's on 25 taxels.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from controller.shared.aliases import Array, Images

LEAST: Final = 0.25  # a press of 2 mm; amplified further, noise would be taken for touches
MOST: Final = 2.5
USUAL: Final = (0.8, 1.25)  # hands that differ so little count as 1: the training varies as much
PRESSES: Final = 5  # from which it is found
DECIMALS: Final = 2

_PRECISION: Final = 0.004  # standard deviation to which noise is averaged, mean z - 1
_LONGEST_S: Final = 0.25  # of the average: presses last as long
_FELT: Final = 0.018  # mean |z - 1| of a touch: a press of 2 mm has 0.02
_SURE: Final = 4.0  # standard deviations of noise by which it exceeds rest
_OF_DIFFERENCES: Final = 0.6745 * math.sqrt(2.0)  # median of |difference| of normal deviates
_PAUSE_S: Final = 0.3  # without a touch, after which a press is over
_WHOLE: Final = 0.5  # of the greatest press: a weaker one is noise
_SHARE: Final = 0.3  # of the greatest deviation so far: below, the membrane springs back


def scaled(images: Images, strength: float) -> Images:
    """Return z images (..., rows, columns) as a hand of strength 1 makes them."""
    if strength == 1.0:
        return images
    return np.asarray(1.0 + (images - 1.0) / np.float32(strength), dtype=np.float32)


def press_deviations(means: Sequence[float] | Array, rate_hz: float) -> list[float]:
    """Return the greatest deviation of each press that is over, mean |z - 1|.

    Noise is averaged, the longer the stronger it is.

    Args:
        means: Mean of z - 1 over the taxels, frame by frame, (frames,); it begins untouched.
        rate_hz: Frames per second.
    """
    values = np.asarray(means, dtype=np.float64)  # at rest most of the time
    pause = max(1, round(_PAUSE_S * rate_hz))
    if len(values) <= pause:
        return []
    values = values - np.median(values)
    longest = max(1, round(_LONGEST_S * rate_hz))
    noise = float(np.median(np.abs(np.diff(values)))) / _OF_DIFFERENCES
    count = min(longest, max(1, math.ceil((noise / _PRECISION) ** 2)))
    mean = np.abs(np.convolve(values, np.full(count, 1.0 / count), "valid"))
    bound = max(_FELT, _SURE * noise / math.sqrt(count))
    found: list[float] = []
    greatest, ended = 0.0, pause  # of the press under way; frames since the last touched one
    for value in mean.tolist():
        if value > max(bound, _SHARE * max([greatest, *found[-1:]])):
            greatest, ended = max(greatest, value), 0
        else:
            ended += 1
        if greatest and ended >= pause:
            found.append(greatest)
            greatest = 0.0
    return [one for one in found if one >= _WHOLE * max(found)]


def of_presses(deviations: Sequence[float], usual: float) -> float:
    """Return the strength of a person, LEAST to MOST; 1 if it is nearly that.

    Args:
        deviations: Of some presses, as `press_deviations` returns them; one at least.
        usual: That of a press of the training, above 0.
    """
    share = float(np.median(deviations)) / usual
    if USUAL[0] <= share <= USUAL[1]:
        return 1.0
    return round(min(max(share, LEAST), MOST), DECIMALS)
