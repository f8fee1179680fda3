"""Measures of single taxels: leads, stuck and clipped readings, shorts, noise, response to touch.

Play, recordings, the doctor and the lab judge taxels by these measures alone. Rows and columns
count from the top left, from 0. Pure: NumPy only.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Array, Change, Frames, Mask

# A taxel below this share of the others' baseline has an open lead: it reads about 1 of 41 pF, and
# a pressed taxel never so little.
LEAD_SHARE: Final = 0.2
# A dead taxel is estimated from its neighbours, which only a small share of taxels can be.
DEAD_TAXELS_SHARE: Final = 0.2
NAMED_TAXELS: Final = 6  # more taxels than that are counted, not listed

# Sound taxels scatter up to 2.06 times as much as the middle one, leaky ones 2.7 times and more.
NOISE_RATIO: Final = 2.3
NOISE_PAIRS: Final = 20  # least number of pairs of untouched frames
# Two sound taxels differ by 10 % (paper, section 3.2: 41.2 pF, standard deviation 2.9); those of
# electrodes that touch read the same sum.
SHORT_DIFFERENCE_SHARE: Final = 0.015
SHORT_LEVEL_RATIO: Final = 1.2  # to the others' level; through the divider, 1.5
# A converter that clips gives its highest number again and again; others hardly ever.
CLIPPED_FRAMES_SHARE: Final = 0.02
CLIPPED_TAXELS: Final = 2  # one taxel alone at the top may just be the one that reads most
STUCK_FRAMES_SHARE: Final = 0.9  # of its readings repeat the one before
LIVELY_FRAMES_SHARE: Final = 0.5  # ... where less of the middle taxel's do
STUCK_FRAMES: Final = 20  # least number that shows repetition

# The dent of a finger falls as 1 / (1 + (r / DENT_TAXELS)²). Of widths from .8 to 1.4 taxels and
# powers from .5 to 2, the least error on 406 simulated clicks on and beside the taxels: 96 % of a
# touch explained in the median, 88 % in 9 of 10.
DENT_TAXELS: Final = 1.4
PATCH_TAXELS: Final = 4  # from the strongest spot: the taxels to which a dent is fitted
_PLACES: Final = np.linspace(-2.0, 2.0, 9)  # of a dent, taxels from the strongest spot
FORM_RESIDUAL_SHARE: Final = 0.05  # of a touch; more that no dent explains, and it is no one finger
FORM_NOISE_TAXELS: Final = 8.0  # noise of the residual's noise, in taxels: 1.2 standard deviations
TOUCH_NOISE_RATIO: Final = 6.0  # least touch, standard deviations of the noise
TOUCH_Z: Final = 0.03  # least change of the strongest taxel
EXPECTED_SHARE: Final = 0.3  # of the strongest taxel's change; the error of the dent is .1


@dataclass(frozen=True, slots=True)
class TouchResponse:
    """Response of one taxel to a touch of one finger.

    Attributes:
        taxel: Row and column.
        expected: Change by the dent that fits all other taxels.
        ratio: Measured change over the expected one: about 1 if sound, 0 if dead.
    """

    taxel: tuple[int, int]
    expected: float
    ratio: float


def without_lead(level: NDArray[np.floating]) -> Mask:
    """Return which taxels of a rest image, (rows, columns) in picofarads, have no lead."""
    return np.asarray(level < LEAD_SHARE * np.median(level))


def leadless(frame: NDArray[np.floating], rest: NDArray[np.floating]) -> Mask:
    """Return which taxels have no lead, now or at rest.

    Args:
        frame: One scan or several, (..., rows, columns), picofarads.
        rest: The untouched sensor, (rows, columns), same unit.
    """
    mean = np.add.reduce(rest, axis=None) / rest.size  # a third of the time of `rest.mean()`
    return np.asarray(~(np.minimum(frame, rest) > LEAD_SHARE * mean))


@dataclass(frozen=True, slots=True, eq=False)
class TaxelFault:
    """A fault of taxels.

    Attributes:
        kind: "stuck", "saturated", "loose", "short", "noisy" or "dead".
        mask: The taxels, (rows, columns).
        text: A sentence about them, after their names.
        useless: Whether they do not respond to touch.
    """

    kind: str
    mask: Mask
    text: str
    useless: bool = True


def useless(found: Iterable[TaxelFault], shape: tuple[int, ...]) -> Mask:
    """Return the taxels that do not respond to touch, (rows, columns) = `shape`."""
    masks = [one.mask for one in found if one.useless]
    return np.asarray(np.any([np.zeros(shape, dtype=np.bool_), *masks], axis=0))


def faults(frames: Frames, change: Frames, idle: Mask) -> list[TaxelFault]:
    """Return the faults of taxels but missing responses, from picofarads.

    Args:
        frames: Readings, (n, rows, columns).
        change: z - 1 of each, (n, rows, columns).
        idle: Whether the sensor is known to be untouched, (n,).
    """
    level, shape = np.median(frames, axis=0), frames.shape[1:]
    still = stuck(frames)
    found = [
        TaxelFault("stuck", still, "stuck, always the same reading"),
        TaxelFault("saturated", clipped(frames) & ~still, f"saturated, at {frames.max():.4g} pF"),
    ]
    loose = without_lead(level) & ~useless(found, shape)
    if loose.any():
        text = f"{level[loose].mean():.2g} pF where the others read {np.median(level):.2g}"
        found.append(TaxelFault("loose", loose, f"{text}; a lead is off"))
    found += [
        TaxelFault("short", mask, "equal readings; do they touch?", useless=False)
        for mask in shorts(level, useless(found, shape))
    ]
    loud = noisy(noise(change - np.median(change, axis=(1, 2), keepdims=True), idle))
    loud &= ~useless(found, shape)
    found.append(TaxelFault("noisy", loud, "noisy; does a contact leak?", useless=False))
    return [one for one in found if one.mask.any()]


def stuck(frames: Frames) -> Mask:
    """Return the taxels that hardly change while the others do, (rows, columns)."""
    same = frames.min(axis=0) == frames.max(axis=0)
    if len(frames) >= STUCK_FRAMES:
        still = (frames[1:] == frames[:-1]).mean(axis=0)
        same |= (still > STUCK_FRAMES_SHARE) & (np.median(still) < LIVELY_FRAMES_SHARE)
    return np.asarray(same)


def clipped(frames: Frames) -> Mask:
    """Return the taxels that repeat the highest number of all, (rows, columns)."""
    often = (frames == frames.max()).mean(axis=0) > CLIPPED_FRAMES_SHARE
    return np.asarray(often & (often.sum() >= CLIPPED_TAXELS))


def shorts(level: NDArray[np.floating], useless: Mask) -> Iterator[Mask]:
    """Yield the taxels of each pair of electrodes with equal readings, (rows, columns).

    Args:
        level: Median reading, (rows, columns), picofarads.
        useless: Taxels to leave out, (rows, columns).
    """
    for lines, bad in ((level, useless), (level.T, useless.T)):
        if min(lines.shape) < 3:
            continue
        for i in range(len(lines) - 1):
            pair = lines[i : i + 2]
            apart = np.abs(pair[0] - pair[1])
            if bad[i : i + 2].any() or not (apart < SHORT_DIFFERENCE_SHARE * pair[1]).all():
                continue
            others = np.median(np.delete(lines, [i, i + 1], axis=0))
            if np.median(pair) > SHORT_LEVEL_RATIO * others:
                mask = np.zeros_like(bad)
                mask[i : i + 2] = True
                yield mask if bad is useless else mask.T


def noise(images: NDArray[np.floating], idle: Mask | None = None) -> NDArray[np.floating]:
    """Return each taxel's standard deviation about its slow change; 0 if it is unknown.

    Args:
        images: Successive ones, (n, rows, columns), of any unit.
        idle: Images to use, (n,), at least `NOISE_PAIRS` successive ones; None: all.
    """
    steps = np.diff(images, axis=0)
    if idle is not None:
        steps = steps[idle[1:] & idle[:-1]]
    if len(steps) < (1 if idle is None else NOISE_PAIRS):
        return np.zeros(images.shape[1:], images.dtype)
    return np.asarray(np.sqrt(np.mean(np.square(steps), axis=0) / 2))


def noisy(level: NDArray[np.floating], ratio: float = NOISE_RATIO, least: float = 0.0) -> Mask:
    """Return the taxels with far more noise than the middle one, (rows, columns).

    Args:
        level: Noise of each taxel, (rows, columns).
        ratio: Least multiple of the middle taxel's noise.
        least: Noise of the middle taxel, where it has less.
    """
    middle = max(float(np.median(level)), least)
    return np.asarray((level > ratio * middle) & (middle > 0.0))


def slope(changes: Array, expected: Array) -> Array:
    """Return the regression of changes on expected ones through 0, both (n, rows, columns)."""
    return np.asarray((changes * expected).sum(axis=0) / np.square(expected).sum(axis=0))


def touch_responses(
    change: Change, whole: Change, around: Change, noise: float
) -> list[TouchResponse]:
    """Return the responses of the taxels on which the touch of one finger lay.

    The dent is fitted to all taxels nearby but the judged one, so a dead one does not move it. A
    touch of another form gives no response.

    Args:
        change: Mean change under the touch, (rows, columns), z - 1; a finger lowers it.
        whole: The same with estimates of the taxels that are known to be dead.
        around: Estimate of every taxel from all others, (rows, columns).
        noise: Variance of a taxel of `change`.
    """
    peak = np.array(np.unravel_index(around.argmin(), around.shape))
    grid = np.indices(change.shape).reshape(2, -1).T - peak
    grid = grid[np.abs(grid).max(axis=1) <= PATCH_TAXELS]  # (n, 2), from the peak
    if len(grid) < 2:
        return []
    own, felt = (-one[tuple((grid + peak).T)] for one in (change, whole))
    spots = np.stack(np.meshgrid(_PLACES, _PLACES), axis=-1).reshape(-1, 2)
    square = np.square(spots[:, None] - grid[None]).sum(axis=2)
    dent = 1.0 / (1.0 + square / DENT_TAXELS**2)  # (places, n)
    # Fits to all taxels but each one in turn, (places, n).
    along = np.maximum((dent @ felt)[:, None] - dent * felt, 0.0)
    power = np.square(dent).sum(axis=1)[:, None] - np.square(dent)
    best = (np.square(along) / power).argmax(axis=0), np.arange(len(grid))
    explained = np.square(along[best]) / power[best]
    expected = along[best] / power[best] * dent[best]
    total = np.square(felt).sum() - np.square(felt)
    strongest = np.where(np.arange(len(grid)) == felt.argmax(), np.sort(felt)[-2], felt.max())
    signal = total - noise * (len(grid) - 1)
    residual = total - explained - noise * (len(grid) - 2 + FORM_NOISE_TAXELS)
    judged = (residual < FORM_RESIDUAL_SHARE * signal) & (strongest > TOUCH_Z)
    judged &= explained > TOUCH_NOISE_RATIO**2 * noise
    judged &= expected > EXPECTED_SHARE * strongest
    return [
        TouchResponse((int(row), int(column)), float(expected[i]), float(own[i] / expected[i]))
        for i in np.flatnonzero(judged)
        for row, column in [grid[i] + peak]
    ]


def taxel_names(mask: Mask) -> str:
    """Return names of the taxels of a mask, (rows, columns): lines, single taxels, or a count."""
    if mask.all():
        return "all taxels"
    for word, lines in (("row", mask), ("column", mask.T)):
        whole = lines.all(axis=1)
        if whole.any() and not lines[~whole].any():
            return f"{word}{'s' * int(whole.sum() > 1)} {_list(np.flatnonzero(whole).tolist())}"
    places = np.argwhere(mask).tolist()
    if len(places) == 1:
        return f"taxel row {places[0][0]}, column {places[0][1]}"
    if len(places) > NAMED_TAXELS:
        return f"{len(places)} of {mask.size} taxels"
    return f"taxels {_list(f'({row},{column})' for row, column in places)}"


def _list(items: Iterable[object]) -> str:
    """Return "a, b and c"."""
    *most, last = map(str, items)
    return f"{', '.join(most)} and {last}" if most else last
