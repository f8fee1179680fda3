"""Taxels that are not what they should be: dead, stuck, noisy, saturated, loose, shorted.

Rows and columns count from the top left, from 0, as in docs/simulator.md.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.sensor_health import taxel_names as names
from controller.recordings.quality.response import Response
from controller.recordings.recording import PICOFARAD, Recording

Map = NDArray[np.float64]  # one number a taxel, (rows, columns)
Mask = NDArray[np.bool_]  # (rows, columns)

# Measured on 80 simulated orbs of both presets: sound taxels answer with 0.43 and more of what
# their neighbours answer with; 39 dead ones of 40 with 0.1 to 0.4, by what their row couples in.
DEAD: Final = 0.4
# Sound taxels scatter up to 2.06 times as much as the middle one, leaky ones 2.7 times and more.
NOISY: Final = 2.3
# A loose lead couples 1 pF of 41; sound taxels read .8 to 1.25 of the middle one.
LOOSE: Final = 0.25
# Two sound taxels differ by 10 % (paper, section 3.2: 41.2 pF, standard deviation 2.9); those of
# electrodes that touch read the same sum.
SAME: Final = 0.015
MORE: Final = 1.2  # ... and so much more than all others; through the divider, 1.5 times
# A converter that clips gives its highest number again and again; others hardly ever.
CLIPPED_SHARE: Final = 0.02
CLIPPED_TAXELS: Final = 2  # one taxel alone at the top may just be the one that reads most
STUCK_SHARE: Final = 0.9  # of its readings repeat the one before
LIVELY_SHARE: Final = 0.5  # ... where so few of the middle taxel's do
# A soft dome feels a touch all over. A telephone's screen feels it under the finger: 3 % of it.
SOFT: Final = 0.2  # of the taxels feel a touch ...
STRONG: Final = 0.2  # ... by this share of what the strongest one feels
TOUCHES: Final = 30  # touched frames from which taxels can be told apart
IDLES: Final = 20  # pairs of untouched frames from which noise can be told


@dataclass(frozen=True, slots=True, eq=False)
class TaxelFinding:
    """One thing about taxels that is not as it should be.

    Attributes:
        kind: "stuck", "saturated", "loose", "short", "dead" or "noisy".
        mask: Which taxels.
        text: A sentence about them.
        useless: They say nothing of touches.
    """

    kind: str
    mask: Mask
    text: str
    useless: bool


def strange(recording: Recording, response: Response) -> tuple[Mask, list[str]]:
    """Return which taxels are of no use, and sentences about all that are not as they should be."""
    found = examine(recording.frames, recording.origin.unit, response)
    useless = np.zeros(recording.frames.shape[1:], dtype=np.bool_)
    for one in found:
        if one.useless:
            useless |= one.mask
    return useless, [one.text for one in found]


def examine(frames: NDArray[np.float32], unit: str, response: Response) -> list[TaxelFinding]:
    """Return what is not as it should be about the taxels of some frames.

    Args:
        frames: As they were read, (n, rows, columns).
        unit: Of their values.
        response: What was felt in them.
    """
    found: list[TaxelFinding] = []
    stuck = frames.min(axis=0) == frames.max(axis=0)
    if unit == PICOFARAD:
        stuck |= _repeating(frames)
    elif unjudged(response) and not stuck.all():  # counts stay the same where nothing touches
        stuck[:] = False
    if stuck.any():
        text = f"{names(stuck)}: stuck, always the same reading"
        found.append(TaxelFinding("stuck", stuck, text, True))
    clipped = _clipped(frames) & ~stuck
    if clipped.any():
        text = f"{names(clipped)}: saturated, at {frames.max():.4g} {unit}"
        found.append(TaxelFinding("saturated", clipped, text, True))
    useless = stuck | clipped
    if unit == PICOFARAD:
        level = np.median(frames, axis=0).astype(np.float64)
        loose = (level < LOOSE * np.median(level)) & ~useless
        useless |= loose
        if loose.any():
            text = (
                f"{names(loose)}: {level[loose].mean():.2g} pF where the others read "
                f"{np.median(level):.2g}; a lead is off"
            )
            found.append(TaxelFinding("loose", loose, text, True))
        for pair, mask in _short(level, useless):
            text = f"{pair}: equal readings; do they touch?"
            found.append(TaxelFinding("short", mask, text, False))
    if unjudged(response):
        return found
    share = _share(np.where(useless, np.nan, _answer(response)))
    dead = share < DEAD
    if dead.any():
        text = (
            f"{names(dead)}: dead ({100 * float(np.median(share[dead])):.0f} % of the neighbours' "
            "answer)"
        )
        found.append(TaxelFinding("dead", dead, text, True))
    noisy = _noisy(response) & ~(useless | dead)
    if noisy.any():
        text = f"{names(noisy)}: noisy; does a contact leak?"
        found.append(TaxelFinding("noisy", noisy, text, False))
    return found


def unjudged(response: Response) -> str:
    """Return why nobody can tell dead and noisy taxels from sound ones; "" if somebody can."""
    touched = response.known & response.touched
    if touched.sum() < TOUCHES or not response.idle.any():
        return "it is touched too little to tell dead taxels from sound ones"
    size = np.abs(response.change[touched])
    felt = (size > STRONG * size.max(axis=(1, 2), keepdims=True)).mean(axis=(1, 2))
    if np.median(felt) < SOFT:
        return "few taxels feel each touch, so dead ones cannot be told from untouched ones"
    return ""


def _repeating(frames: NDArray[np.float32]) -> Mask:
    """Which taxels hardly ever change while the others do."""
    if len(frames) < IDLES:
        return np.zeros(frames.shape[1:], dtype=np.bool_)
    still = (frames[1:] == frames[:-1]).mean(axis=0)
    return np.asarray((still > STUCK_SHARE) & (np.median(still) < LIVELY_SHARE))


def _clipped(frames: NDArray[np.float32]) -> Mask:
    """Which taxels rest against the highest number of all."""
    often = (frames == frames.max()).mean(axis=0) > CLIPPED_SHARE
    return np.asarray(often if often.sum() >= CLIPPED_TAXELS else np.zeros_like(often))


def _answer(response: Response) -> Map:
    """How strongly each taxel answers to touch: deviation under a touch beyond that at rest."""
    touched, idle = response.known & response.touched, response.idle
    square = np.square(response.change, dtype=np.float64)
    return np.asarray(np.sqrt(np.maximum(square[touched].mean(0) - square[idle].mean(0), 0.0)))


def _around(values: Map) -> Map:
    """Middle value of the up to eight neighbours of each taxel; NaN does not count."""
    rows, columns = values.shape
    wide = np.pad(values, 1, constant_values=np.nan)
    around = [
        wide[1 + down : 1 + down + rows, 1 + right : 1 + right + columns]
        for down in (-1, 0, 1)
        for right in (-1, 0, 1)
        if down or right
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # no neighbour at all: NaN
        return np.asarray(np.nanmedian(around, axis=0))


def _share(answer: Map) -> Map:
    """Return each answer as a share of its neighbours'; NaN where nobody can tell."""
    if np.isnan(answer).all():
        return answer
    around = _around(answer)
    felt = around > DEAD * np.nanmedian(answer)  # far from every touch nobody can tell
    return np.asarray(np.divide(answer, around, out=np.full(answer.shape, np.nan), where=felt))


def _noisy(response: Response) -> Mask:
    """Which taxels scatter far more than the others while nothing touches."""
    idle = response.idle
    pairs = idle[1:] & idle[:-1]
    if pairs.sum() < IDLES:
        return np.zeros(response.change.shape[1:], dtype=np.bool_)
    own = response.change - np.median(response.change, axis=(1, 2), keepdims=True)
    scatter = np.diff(own, axis=0)[pairs].std(axis=0)
    middle = np.median(scatter)
    noisy = scatter > NOISY * middle if middle > 0.0 else np.zeros(scatter.shape, dtype=np.bool_)
    return np.asarray(noisy)


def _short(level: Map, known: Mask) -> Iterator[tuple[str, Mask]]:
    """Yield pairs of electrodes that read the same, taxel by taxel, and their taxels."""
    for word, lines, bad in (("rows", level, known), ("columns", level.T, known.T)):
        if min(lines.shape) < 3:
            continue
        for i in range(len(lines) - 1):
            pair = lines[i : i + 2]
            apart = np.abs(pair[0] - pair[1])
            if bad[i : i + 2].any() or not (apart < SAME * pair[1]).all():
                continue
            if np.median(pair) > MORE * np.median(np.delete(lines, [i, i + 1], axis=0)):
                mask = np.zeros_like(bad)
                mask[i : i + 2] = True
                yield f"{word} {i} and {i + 1}", mask if word == "rows" else mask.T
