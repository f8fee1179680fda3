"""Measures of single taxels: leads, stuck and clipped readings, shorts, noise, response to touch.

Play, recordings, the doctor and the Lab judge taxels by these measures. Rows and columns count from
the top left, from 0. Pure: NumPy only.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared import blocks
from controller.shared.aliases import Array, Change, Frames, Mask
from controller.shared.notices import Notice, listed, notice

# A taxel below this share of the others' baseline has an open lead: it reads about 1 of 41 pF, and
# a pressed taxel never so little.
LEAD_SHARE: Final = 0.2
DEAD_TAXELS_SHARE: Final = 0.2  # most that the neighbours can stand in for; more is another fault
NAMED_TAXELS: Final = 6  # more taxels or lines than that are counted, not listed

# In 24 simulated sessions sound taxels scatter up to 1.69 times as much as the middle one, leaky
# ones 3.3 times and more.
NOISE_RATIO: Final = 2.3
NOISE_PAIRS: Final = 20  # pairs of untouched frames in a group
# Two sound taxels differ by 10 % (paper, section 3.2: 41.2 pF, standard deviation 2.9); those of
# electrodes that touch read the same sum.
SHORT_DIFFERENCE_SHARE: Final = 0.015
SHORT_LEVEL_RATIO: Final = 1.2  # to the others' level; through the divider, 1.5
# A converter that clips gives its highest number again and again; others hardly ever.
CLIPPED_FRAMES_SHARE: Final = 0.02
CLIPPED_TAXELS: Final = 2  # one taxel alone at the top may just be the one that reads most
STUCK_FRAMES_SHARE: Final = 0.9  # of its readings repeat the one before
LIVELY_FRAMES_SHARE: Final = 0.5  # ... where less of the middle taxel's do

# Slope of a recording's taxel against its surroundings, in 46 simulated sessions: dead .04 to .16,
# as a finger loads the row, leaky .46 to .83, sound from .67.
DEAD_SLOPE: Final = 0.2
SURROUNDINGS_SHARE: Final = 0.1  # least power of a taxel's surroundings, of the median one

# A touch that lay on a taxel: its place is fitted to the other taxels nearby. In 4 simulated
# sessions of each kind and both presets (presses, clicks, fingers on the rim, squeezes, pinches,
# twists, up to five fingers) sound taxels answered with .2 to 1.7 of what the fit says, in 5 of
# 4,200 cases with less; dead ones with -.3 to .21.
DENT_TAXELS: Final = 1.1  # standard deviation of a finger's dent
DENT_OFFSET: Final = 0.05  # of its height: the dome around it rises
DENT_CORRELATION: Final = 0.87  # least correlation of a touch with the dent, its noise aside
TOUCHED_TAXELS: Final = 1.1  # from the place of a touch to a taxel that it lay on
TOUCH_Z: Final = 0.1  # least mean change of the strongest taxel: what is left of a touch is less
EXPECTED_SHARE: Final = 0.55  # least expected change, of the strongest taxel's
EXPECTED_SD: Final = 3.0  # least expected change, in standard deviations of the noise
PATCH_TAXELS: Final = 3  # around the strongest spot: a dent is fitted to them
_PLACES: Final = np.linspace(-2.0, 2.0, 11)  # of a dent, from the strongest spot


def without_lead(level: NDArray[np.floating]) -> Mask:
    """Return which taxels of a rest image, (rows, columns) in picofarads, have no lead."""
    return np.asarray(level < LEAD_SHARE * np.median(level))


def leadless(frame: NDArray[np.floating], rest: NDArray[np.floating]) -> Mask:
    """Return which taxels have no lead, now or at rest.

    Args:
        frame: One scan or several, (..., rows, columns), picofarads.
        rest: The untouched sensor, (rows, columns), same unit.
    """
    mean = float(np.add.reduce(rest, axis=None) / rest.size)  # a third of the time of `rest.mean()`
    return np.asarray(~(np.minimum(frame, rest) > LEAD_SHARE * mean))


@dataclass(frozen=True, slots=True, eq=False)
class TaxelFault:
    """A fault of taxels.

    Attributes:
        kind: "stuck", "saturated", "loose", "short", "noisy" or "dead".
        mask: The taxels, (rows, columns).
        text: A notice about them, after their names.
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


def faults(frames: Frames, unit: str, still: Mask, change: Frames, idle: Mask) -> list[TaxelFault]:
    """Return the faults of taxels but missing responses to touch.

    Args:
        frames: Readings, (n, rows, columns).
        unit: Of the readings; leads and shorts show in picofarads alone.
        still: Taxels whose reading never changes, (rows, columns).
        change: Change of each from rest, (n, rows, columns).
        idle: Whether the sensor is known to be untouched, (n,).
    """
    level, shape = blocks.median(frames).astype(np.float64), frames.shape[1:]
    top = max(frames[part].max() for part in blocks.blocks(frames))
    at_top = sum((frames[part] == top).sum(axis=0) for part in blocks.blocks(frames))
    often = at_top / len(frames) > CLIPPED_FRAMES_SHARE
    clipped = often & (often.sum() >= CLIPPED_TAXELS)
    found = [
        TaxelFault("stuck", still, notice("stuck")),
        TaxelFault("saturated", clipped & ~still, notice("saturated", top, unit)),
    ]
    if unit == "pF":
        loose = without_lead(level) & ~useless(found, shape)
        low = np.mean(level, where=loose) if loose.any() else 0.0
        found.append(TaxelFault("loose", loose, notice("loose", low, np.median(level))))
        found += [
            TaxelFault("short", mask, notice("equal_readings"), useless=False)
            for mask in _shorts(level, useless(found, shape))
        ]
    loud = noisy(idle_noise(change, idle)) & ~useless(found, shape)
    found.append(TaxelFault("noisy", loud, notice("noisy"), useless=False))
    return [one for one in found if one.mask.any()]


def constant(frames: Frames) -> Mask:
    """Return the taxels whose reading never changes, (rows, columns)."""
    unlike = [(frames[part] != frames[0]).any(axis=0) for part in blocks.blocks(frames)]
    return np.asarray(~np.any(unlike, axis=0))


def stuck(frames: Frames) -> Mask:
    """Return the taxels that hardly change while the others do, (rows, columns)."""
    if len(frames) < NOISE_PAIRS:
        return constant(frames)
    parts = blocks.blocks(frames, before=1)
    alike = [(frames[part][1:] == frames[part][:-1]).sum(axis=0) for part in parts]
    same = np.sum(alike, axis=0) / (len(frames) - 1)
    seldom = (same > STUCK_FRAMES_SHARE) & (np.median(same) < LIVELY_FRAMES_SHARE)
    return np.asarray(constant(frames) | seldom)


def _shorts(level: Array, useless: Mask) -> Iterator[Mask]:
    """Yield the taxels of each pair of electrodes with equal readings, (rows, columns)."""
    for lines, bad, columns in ((level, useless, False), (level.T, useless.T, True)):
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
                yield mask.T if columns else mask


def noise(images: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return each taxel's standard deviation about its slow change, (rows, columns).

    Half the mean squared difference of successive images, (n, rows, columns), so that a drift
    counts little; in their unit, 0 of fewer than two.
    """
    if len(images) < 2:
        return np.zeros(images.shape[1:], images.dtype)
    squares = np.square(np.diff(images, axis=0)).mean(axis=0, dtype=np.float64)
    return np.asarray(np.sqrt(squares / 2), dtype=images.dtype)


def idle_noise(change: Frames, idle: Mask) -> Array:
    """Return each taxel's noise without what all taxels have in common, (rows, columns).

    The median of groups of `NOISE_PAIRS` pairs of images: a touch too light to tell from rest is
    in few of them.

    Args:
        change: Change from rest, (n, rows, columns), of any unit.
        idle: Whether the sensor is known to be untouched, (n,).

    Returns:
        A standard deviation in the unit of `change`; 0 of fewer pairs than a group has.
    """
    shape = change.shape[1:]
    groups, left = [np.zeros((0, *shape))], np.zeros((0, *shape), change.dtype)
    for part in blocks.blocks(change, before=1):
        own = change[part] - np.median(change[part], axis=(1, 2), keepdims=True)
        pairs = idle[part][1:] & idle[part][:-1]
        steps = np.concatenate([left, np.diff(own, axis=0)[pairs]])
        whole = len(steps) // NOISE_PAIRS * NOISE_PAIRS
        squares = np.square(steps[:whole]).reshape(-1, NOISE_PAIRS, *shape)
        groups.append(squares.mean(axis=1, dtype=np.float64))
        left = steps[whole:]  # for a group with the next block
    level = np.concatenate(groups)
    return np.sqrt(np.median(level, axis=0) / 2) if len(level) else np.zeros(shape)


def noisy(level: NDArray[np.floating], ratio: float = NOISE_RATIO, least: float = 0.0) -> Mask:
    """Return the taxels with far more noise than the middle one, (rows, columns).

    Args:
        level: Noise of each taxel, (rows, columns).
        ratio: Least multiple of the middle taxel's noise.
        least: Noise of the middle taxel, where it has less.
    """
    middle = max(float(np.median(level)), least)
    return np.asarray((level > ratio * middle) & (middle > 0.0))


def response_slope(touches: Iterable[tuple[Array, Array]]) -> Array:
    """Return the slope of each taxel against its expected changes; below `DEAD_SLOPE` it is dead.

    Args:
        touches: Changes that were measured under touch, and those expected from the taxels around
            or from a model of the dome, both (n, rows, columns), block by block.

    Returns:
        Slope of the regression through 0, (rows, columns); NaN far from every touch.
    """
    sums = [
        ((change * expected).sum(axis=0), np.square(expected).sum(axis=0))
        for change, expected in touches
    ]
    along, power = np.sum(sums, axis=0)
    near = power > SURROUNDINGS_SHARE * float(np.median(power))
    return np.asarray(np.divide(along, power, out=np.full_like(power, np.nan), where=near))


def responses(
    change: Change, whole: Change, around: Change, noise: float
) -> list[tuple[tuple[int, int], float, float]]:
    """Return the taxels on which a touch lay: row and column, expected change, and response.

    The dent of one finger is fitted to all taxels nearby but the one that is judged, so a dead one
    does not move it. A touch of another form gives nothing.

    Args:
        change: Mean change under the touch, (rows, columns).
        whole: The same with estimates of the taxels that are known to be dead.
        around: Estimate of every taxel from all others, (rows, columns).
        noise: Variance of a taxel of `change`.
    """
    peak = np.unravel_index(np.abs(around).argmax(), around.shape)
    grid = np.indices(change.shape).reshape(2, -1).T - np.array(peak)
    grid = grid[np.abs(grid).max(axis=1) <= PATCH_TAXELS]  # (n, 2), from the peak
    spots = np.stack(np.meshgrid(_PLACES, _PLACES), axis=-1).reshape(-1, 2)  # (places, 2)
    square = np.square(spots[:, None] - grid[None]).sum(axis=2)
    dent = np.exp(-square / (2.0 * DENT_TAXELS**2)) - DENT_OFFSET  # (places, n)
    own, felt = (np.sign(around[peak]) * one[tuple((grid + peak).T)] for one in (change, whole))
    if felt.max() < TOUCH_Z:
        return []
    found: list[tuple[tuple[int, int], float, float]] = []
    for i in np.flatnonzero(np.square(grid).sum(axis=1) <= (2.0 * TOUCHED_TAXELS) ** 2).tolist():
        others = np.arange(len(grid)) != i
        along, power = dent[:, others] @ felt[others], np.square(dent[:, others]).sum(axis=1)
        best = int((along / np.sqrt(power)).argmax())
        total = float(np.square(felt[others]).sum())
        explained = along[best] ** 2 / power[best]
        expected = along[best] / power[best] * dent[best, i]
        least = max(EXPECTED_SD * np.sqrt(noise), EXPECTED_SHARE * felt[others].max())
        clear = expected > least and square[best, i] <= TOUCHED_TAXELS**2
        if clear and explained - noise >= DENT_CORRELATION**2 * (total - noise * others.sum()):
            place = (int(grid[i, 0] + peak[0]), int(grid[i, 1] + peak[1]))
            found.append((place, float(expected), float(own[i] / expected)))
    return found


def taxel_names(mask: Mask) -> Notice:
    """Return names of the taxels of a mask, (rows, columns): lines, single taxels, or a count."""
    if mask.all():
        return notice("all_taxels")
    for word, lines in (("row", mask), ("column", mask.T)):
        whole = lines.all(axis=1)
        if 0 < whole.sum() <= NAMED_TAXELS and not lines[~whole].any():
            numbers = np.flatnonzero(whole).tolist()
            return notice(f"{word}s", listed(numbers)) if numbers[1:] else notice(word, *numbers)
    places = np.argwhere(mask).tolist()
    if len(places) == 1:
        return notice("taxel", *places[0])
    if len(places) > NAMED_TAXELS:
        return notice("some_taxels", len(places), mask.size)
    return notice("taxels", listed(f"({row},{column})" for row, column in places))
