"""Label repair: estimate a labeller's delay, and move the edges of labels to the touches.

A person presses the label button (or a key, or follows a cue) too late, lets go too late, forgets.
A label begins where the sensor's response first rises and ends where it last falls. Frames too
close to such an edge could be either, and are masked.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.quality.labels import spans
from controller.recordings.quality.taxels import Response, respond
from controller.recordings.recording import UNKNOWN, Recording
from models.data.examples import Column, Labels, column, run_starts
from models.results.training import Lateness

# Shares of a gesture's strength: above the first it is made, at the others it has begun and ended.
# On simulated gestures of both presets the second is EARLY_S after the truth (40 % of the depth),
# the third at the truth (the last finger leaves).
MADE: Final = 0.3
BEGUN: Final = 0.25
ENDED: Final = 0.35
EARLY_S: Final = 0.04
AMBIGUOUS_S: Final = 0.05  # from an edge: closer than this a frame may be either
NOISY: Final = 0.15  # noise over strength, from which on it may be twice as far
REACH_S: Final = 1.0  # a label may be so far off its touch; farther, it is meant
WEAK: Final = 0.1  # of what its label usually shows, or its clearest touch: less is no touch
FAINT: Final = 0.35  # noise over strength: more is none either; presses on paper-snr have 0.3
SMOOTH_S: Final = 0.1  # of the response: a tenth of a second is a frame of the paper's orb
ROUNDS: Final = 2  # until what a gesture looks like agrees with when it is made


@dataclass(frozen=True, slots=True)
class Found:
    """Frames of the gesture that a label names."""

    first: int  # its first frame
    end: int  # the frame after its last
    begin_s: float  # when it begins, seconds of the recording
    end_s: float  # when it ends
    strength: float  # its response: norm of the mean image, z - 1
    noise: float  # deviation of the response without a touch, relative


@dataclass(frozen=True, slots=True)
class _Label:
    """One label as it was given, and the gesture that it names."""

    name: int  # class
    first: int  # its first frame
    end: int  # the frame after its last
    found: Found | None = None  # the gesture; None: there is no response


def repair(recording: Recording, labeller: Labels) -> tuple[Column, Lateness]:
    """Return labels (n,) moved to where the touches were, -1 if unclear, and how late they were.

    Edges move by at most `REACH_S`; what lies inside a label stays, however many touches it has.
    Labels are as given if no touch is felt under any, or if each frame has a gesture.
    """
    given = column(recording, labeller)
    response, t = respond(recording), recording.t
    breaks = np.diff(recording.sequence, prepend=recording.sequence[0]) > 1
    used = np.where(recording.excluded, 0, given).astype(np.int16)
    labels = [_Label(*span) for span in spans(used, breaks)]
    labels = _search(t, response, labels, (0.0, 0.0))
    begins, ends = _lags(t, labels)
    if begins:  # now that it is known how late labels are, look where they should have been
        lags = float(np.median(begins)), float(np.median(ends))
        labels = _search(t, response, labels, lags)
        begins, ends = _lags(t, labels)
    late = Lateness(
        _median(begins),
        _median(ends),
        len(begins),
        unfelt=len(labels) - len(begins),
        named=int((used > 0).sum()),
    )
    if (labels and not begins) or bool((given > 0).all()):
        return given, late
    label = np.where(given > 0, 0, given).astype(np.int16)  # as if nothing had touched it
    unclear = np.zeros(len(t), dtype=np.bool_)
    for one in labels:
        if (found := one.found) is None:
            label[one.first : one.end] = UNKNOWN  # without a response it could be anything
            continue
        label[(t >= found.begin_s) & (t < found.end_s)] = one.name
        unclear_s = AMBIGUOUS_S * (2.0 if found.noise > NOISY else 1.0)
        for edge_s in (found.begin_s, found.end_s):
            unclear |= np.abs(t - edge_s) < unclear_s
    late = replace(late, changed=int(((used > 0) & (label != given)).sum()))
    label[unclear] = UNKNOWN
    return label, late


def examples(label: NDArray[np.integer], labels: tuple[str, ...]) -> dict[str, int]:
    """Return how often each gesture was made, from labels (n,); unknown frames do not part it."""
    known = label[label != UNKNOWN].astype(np.int64)
    count = np.bincount(known[run_starts(known, known)], minlength=len(labels))
    return {name: int(count[i]) for i, name in enumerate(labels) if i}


def _search(
    t: NDArray[np.float64], response: Response, labels: list[_Label], lags: tuple[float, float]
) -> list[_Label]:
    """Return labels with their gestures; without those far weaker than the label's usually are.

    Times are of each frame, (n,); `lags` is the usual lateness of begins and ends, seconds.
    """
    change = _smooth(response.change.reshape(len(t), -1).astype(np.float64), t)
    idle = change[response.idle]
    begin = [t[one.first] - lags[0] for one in labels]
    end = [max(t[one.end - 1] - lags[1], b) for one, b in zip(labels, begin, strict=True)]
    made = []
    for i, one in enumerate(labels):
        # No farther than half way to the labels before and after it.
        low_s = max(begin[i] - REACH_S, (end[i - 1] + begin[i]) / 2 if i else -np.inf)
        final = i + 1 == len(labels)
        high_s = min(end[i] + REACH_S, np.inf if final else (end[i] + begin[i + 1]) / 2)
        low, high = np.searchsorted(t, (low_s, high_s)).tolist()
        first, last = (np.searchsorted(t, (begin[i] - 1e-9, end[i] + 1e-9)) - low).tolist()
        found = _found(t[low:high], change[low:high], (first, last), idle)
        if found is not None:
            found = replace(found, first=low + found.first, end=low + found.end)
        made.append(replace(one, found=found))
    strengths: dict[int, list[float]] = {}
    for one in made:
        if one.found is not None:
            strengths.setdefault(one.name, []).append(one.found.strength)
    least = {name: WEAK * float(np.median(values)) for name, values in strengths.items()}
    weak = [one.found is not None and one.found.strength < least[one.name] for one in made]
    return [replace(one, found=None) if out else one for one, out in zip(made, weak, strict=True)]


def _smooth(change: NDArray[np.float64], t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return changes, (n, taxels), averaged over an odd number of frames, by times (n,)."""
    side = int(SMOOTH_S / 2.0 / float(np.median(np.diff(t)))) if len(t) > 1 else 0
    padded = np.pad(change, ((side + 1, side), (0, 0)), mode="edge")
    total = np.cumsum(padded, axis=0)
    return (total[2 * side + 1 :] - total[: -2 * side - 1]) / (2 * side + 1)


def _found(
    t: NDArray[np.float64],
    change: NDArray[np.float64],
    inner: tuple[int, int],
    idle: NDArray[np.float64],
) -> Found | None:
    """Return the gesture of a label, from its first touch to its last; None if none is felt.

    Args:
        t: Times of the frames around the label, (n,), seconds.
        change: Change of each taxel, (n, taxels).
        inner: The label's first frame and the one after its last, as thought.
        idle: Change while nothing touches, (m, taxels).
    """
    low, high = max(0, inner[0]), min(len(t), inner[1])
    if high <= low:
        return None
    if (found := _touch(t, change, (low, high), idle)) is None:
        return None
    # What stays of a touch begins where the touch ends, and is weaker than its end.
    apart, beside = WEAK * found.strength, ENDED * found.strength
    place = found.end
    while more := _touch(t[place:], change[place:], (0, high - place), idle, further=True):
        if more.strength > (apart if more.first else beside):
            found = replace(found, end=place + more.end, end_s=more.end_s)
        place += more.end
    place = found.first
    while more := _touch(t[:place], change[:place], (low, place), idle, further=True):
        if more.strength > (apart if more.end < place else beside):
            found = replace(found, first=more.first, begin_s=more.begin_s)
        place = more.first
    if found.begin_s > (begin_s := float(t[low])) + REACH_S:
        found = replace(found, first=low, begin_s=begin_s)
    if found.end_s < (end_s := float(t[high - 1])) - REACH_S:
        found = replace(found, end=high, end_s=end_s)
    return found


def _touch(
    t: NDArray[np.float64],
    change: NDArray[np.float64],
    label: tuple[int, int],
    idle: NDArray[np.float64],
    *,
    further: bool = False,
) -> Found | None:
    """Return the clearest touch that the frames of a label show; None if there is none.

    It may lie beside the label. A `further` touch overlaps it, and has two frames: one alone may
    be noise. Other arguments are as in `_found`.
    """
    size, (first, end) = np.square(change).sum(axis=1), label
    low, high = label if further else (0, len(t))
    for _ in range(ROUNDS):
        if end - first < 1 + further:
            return None
        looks = change[first:end].mean(axis=0)
        alike = change @ looks
        if end - first > 1:  # without itself: a frame of noise is like a mean that holds it
            alike[first:end] += (alike[first:end] - size[first:end]) / (end - first - 1)
        made = np.maximum(alike[first:end], 0.0)
        if not made.any():
            return None
        level = max(float(np.square(made).sum() / made.sum()), float(np.quantile(made, 0.75)))
        share = alike / level
        first, end = (low + place for place in _most(share[low:high] - MADE))
        while first > 0 and share[first - 1] > MADE:
            first -= 1
        while end < len(t) and share[end] > MADE:
            end += 1
    clear = change[first:end][share[first:end] > MADE]
    if not len(clear):
        return None
    strength = float(np.linalg.norm(clear.mean(axis=0)))
    noise = float((idle @ looks).std()) / level if len(idle) else 0.0
    if noise > FAINT:
        return None
    begin_s = _edge(t, share, first - 1, BEGUN) - EARLY_S
    return Found(first, end, begin_s, _edge(t, share, end - 1, ENDED), strength, noise)


def _most(gain: NDArray[np.float64]) -> tuple[int, int]:
    """Return the stretch (first, end) whose sum is greatest."""
    total = np.concatenate([[0.0], np.cumsum(gain)])
    lowest = np.minimum.accumulate(total[:-1])
    end = int((total[1:] - lowest).argmax()) + 1
    return int(total[:end].argmin()), end


def _edge(t: NDArray[np.float64], share: NDArray[np.float64], frame: int, level: float) -> float:
    """Return when a share (n,) passed a level between a frame and the next or near it, seconds."""
    if not 0 <= frame < len(t) - 1:
        return float(t[0] if frame < 0 else t[-1])
    low, high = float(share[frame]), float(share[frame + 1])
    part = (level - low) / (high - low) if low != high else 0.5
    return float(t[frame] + min(1.0, max(0.0, part)) * (t[frame + 1] - t[frame]))


def _lags(t: NDArray[np.float64], labels: list[_Label]) -> tuple[list[float], list[float]]:
    """Return how late each label begins and ends, seconds; `t` is of each frame, (n,)."""
    pairs = [(one, one.found) for one in labels if one.found is not None]
    return (
        [float(t[one.first] - found.begin_s) for one, found in pairs],
        [float(t[min(one.end, len(t) - 1)] - found.end_s) for one, found in pairs],
    )


def _median(lags_s: list[float]) -> float:
    """Return the median; NaN if there are none."""
    return float(np.median(lags_s)) if lags_s else np.nan
