"""Labels as people give them: how late they are, where the touch truly was, and what is unclear.

A person presses the label button (or a key, or follows a cue) too late, lets go too late, forgets.
The sensor felt the touch itself: where its energy rises and falls is where the label belongs.
Frames too close to such an edge could be either, and nobody learns from them.
"""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.quality.labels import spans
from controller.recordings.quality.response import Response, respond
from controller.recordings.recording import UNKNOWN, Recording
from models.data.examples import COLUMNS, Labels
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
REACH_S: Final = 1.0  # a label may be so far off its touch
WEAK: Final = 0.2  # of what its label usually shows: less is no touch
FAINT: Final = 0.35  # noise over strength: more is none either; presses on paper-snr have 0.3
UNNAMED: Final = 3  # touched frames in a row that no label names make a touch
ROUNDS: Final = 2  # until what a gesture looks like agrees with when it is made

Column = NDArray[np.int16]


@dataclass(frozen=True, slots=True)
class Found:
    """Where the gesture that a label names was made.

    Attributes:
        first: Its first frame.
        end: The frame after its last.
        begin_s: When it begins, seconds of the recording.
        end_s: When it ends.
        strength: How much the sensor shows of it: norm of the mean image, z - 1.
        noise: What noise does to it, relative.
    """

    first: int
    end: int
    begin_s: float
    end_s: float
    strength: float
    noise: float


def repair(recording: Recording, labeller: Labels) -> tuple[Column, Lateness]:
    """Return a labeller's labels moved to where the touches were, and how late they were.

    Each label's own frames say what its gesture looks like, and the frames around it that look
    so are when it was made.

    Args:
        recording: With its frames; what is noise is found out from them.
        labeller: Who said it.

    Returns:
        The label of each frame, -1 where it is unknown or unclear, (n,); and what was done.
    """
    said: Column = getattr(recording, COLUMNS[labeller])
    response, t = respond(recording), recording.t
    breaks = np.diff(recording.sequence, prepend=recording.sequence[0]) > 1
    given = spans(np.where(recording.excluded, 0, said).astype(np.int16), breaks)
    found = _felt(given, _search(t, response, given, (0.0, 0.0)))
    begins, ends = _lags(t, given, found)
    if begins:  # now that it is known how late labels are, look where they should have been
        lags = float(np.median(begins)), float(np.median(ends))
        found = _felt(given, _search(t, response, given, lags))
        begins, ends = _lags(t, given, found)
    label = np.where(said > 0, 0, said).astype(np.int16)  # as if nobody had touched it
    masked = np.zeros(len(t), dtype=np.bool_)
    named = np.zeros(len(t), dtype=np.bool_)
    for (name, first, end), one in zip(given, found, strict=True):
        named[first:end] = True
        if one is None:
            masked[first:end] = True  # nothing was felt, so nobody knows what it was
            continue
        named[one.first : one.end] = True
        label[(t >= one.begin_s) & (t < one.end_s)] = name
        unclear_s = AMBIGUOUS_S * (2.0 if one.noise > NOISY else 1.0)
        for edge_s in (one.begin_s, one.end_s):
            masked |= np.abs(t - edge_s) < unclear_s
    label[masked] = UNKNOWN
    runs = np.diff(np.flatnonzero(np.diff(response.touched & ~named, prepend=False, append=False)))
    return label, _lateness(
        recording, said, label, given, begins, ends,
        moved=sum(
            one is not None and (one.first, one.end) != (first, end)
            for (_, first, end), one in zip(given, found, strict=True)
        ),
        masked=int(masked.sum()),
        unfelt=found.count(None),
        unlabelled=int((runs[::2] >= UNNAMED).sum()),
    )  # fmt: skip


def with_labels(recording: Recording, labeller: Labels, said: Column) -> Recording:
    """Return a recording in which a labeller said something else."""
    columns: dict[str, Any] = {COLUMNS[labeller]: said}
    return replace(recording, **columns)


def examples(label: NDArray[np.integer], labels: tuple[str, ...]) -> dict[str, int]:
    """Return how often each gesture was made; frames of nobody knows what do not part it."""
    known = label[label != UNKNOWN]
    begins = np.flatnonzero(np.diff(known, prepend=0) != 0)
    count = np.bincount(known[begins].astype(np.int64), minlength=len(labels))
    return {name: int(count[i]) for i, name in enumerate(labels) if i}


def _search(
    t: NDArray[np.float64],
    response: Response,
    given: list[tuple[int, int, int]],
    lags: tuple[float, float],
) -> list[Found | None]:
    """Return where each label's gesture was made; None where nothing can be found.

    Args:
        t: Time of each frame, (n,).
        response: What the sensor felt.
        given: Label, first frame and frame after the last, in order.
        lags: How late labels usually begin and end, seconds.
    """
    change = response.change.reshape(len(t), -1).astype(np.float64)
    idle = change[response.idle]
    begin = [t[first] - lags[0] for _, first, _ in given]
    end = [max(t[e - 1] - lags[1], b) for (_, _, e), b in zip(given, begin, strict=True)]
    found: list[Found | None] = []
    for i in range(len(given)):
        # No farther than half way to the labels before and after it.
        low_s = max(begin[i] - REACH_S, (end[i - 1] + begin[i]) / 2 if i else -np.inf)
        last = i + 1 == len(given)
        high_s = min(end[i] + REACH_S, np.inf if last else (end[i] + begin[i + 1]) / 2)
        low, high = np.searchsorted(t, (low_s, high_s)).tolist()
        inner = np.searchsorted(t, (begin[i] - 1e-9, end[i] + 1e-9)) - low
        found.append(_made(t[low:high], change[low:high], inner.tolist(), idle, low))
    return found


def _made(
    t: NDArray[np.float64],
    change: NDArray[np.float64],
    inner: list[int],
    idle: NDArray[np.float64],
    offset: int,
) -> Found | None:
    """Return where in some frames a gesture is made.

    Args:
        t: Times, (n,).
        change: How far each taxel is from rest, (n, taxels).
        inner: First frame, and frame after the last, in which it is thought to be made.
        idle: Frames in which nothing touches, (m, taxels).
        offset: Number of the first frame.
    """
    first, end = max(0, inner[0]), min(len(t), inner[1])
    for _ in range(ROUNDS):
        if end <= first:
            return None
        looks = change[first:end].mean(axis=0)
        alike = change @ looks
        level = float(np.quantile(alike[first:end], 0.75))
        if level <= 0.0:
            return None
        share = alike / level
        first, end = _most(share - MADE)
    strength = float(np.linalg.norm(change[first:end].mean(axis=0)))
    noise = float((idle @ looks).std()) / level if len(idle) else 0.0
    if noise > FAINT:
        return None
    begin_s = _edge(t, share, first - 1, BEGUN) - EARLY_S
    end_s = _edge(t, share, end - 1, ENDED)
    return Found(offset + first, offset + end, begin_s, end_s, strength, noise)


def _most(gain: NDArray[np.float64]) -> tuple[int, int]:
    """Return the stretch (first, end) whose sum is greatest."""
    total = np.concatenate([[0.0], np.cumsum(gain)])
    lowest = np.minimum.accumulate(total[:-1])
    end = int((total[1:] - lowest).argmax()) + 1
    return int(total[:end].argmin()), end


def _edge(t: NDArray[np.float64], share: NDArray[np.float64], frame: int, level: float) -> float:
    """Return when a share passed a level between a frame and the next, or near there, seconds."""
    if not 0 <= frame < len(t) - 1:
        return float(t[0] if frame < 0 else t[-1])
    low, high = float(share[frame]), float(share[frame + 1])
    part = (level - low) / (high - low) if low != high else 0.5
    return float(t[frame] + min(1.0, max(0.0, part)) * (t[frame + 1] - t[frame]))


def _felt(given: list[tuple[int, int, int]], found: list[Found | None]) -> list[Found | None]:
    """Return what was found, without what is far weaker than its label usually is."""
    usual = {
        name: np.median([
            one.strength for (n, _, _), one in zip(given, found, strict=True) if n == name and one
        ] or [0.0])
        for name, _, _ in given
    }  # fmt: skip
    return [
        one if one is not None and one.strength >= WEAK * usual[name] else None
        for (name, _, _), one in zip(given, found, strict=True)
    ]


def _lags(
    t: NDArray[np.float64], given: list[tuple[int, int, int]], found: list[Found | None]
) -> tuple[list[float], list[float]]:
    """Return how late each label begins and ends, seconds."""
    pairs = [(first, end, one) for (_, first, end), one in zip(given, found, strict=True) if one]
    return (
        [float(t[first] - one.begin_s) for first, _, one in pairs],
        [float(t[min(end, len(t) - 1)] - one.end_s) for _, end, one in pairs],
    )


def _lateness(
    recording: Recording,
    said: Column,
    repaired: Column,
    given: list[tuple[int, int, int]],
    begins: list[float],
    ends: list[float],
    **counts: int,
) -> Lateness:
    """Return what is known about a labeller, beside the truth where that is known."""
    begin_s, begin_spread_s = _middle(begins)
    end_s, end_spread_s = _middle(ends)
    plain = Lateness(begin_s, begin_spread_s, end_s, end_spread_s, len(begins), **counts)
    if recording.truth is None:
        return plain
    true = recording.label
    used = ~recording.excluded & (true != UNKNOWN)
    before, after = used & (said != UNKNOWN), used & (repaired != UNKNOWN)
    names, t = recording.origin.labels, recording.t
    late_begin, late_end = [], []
    for name, first, end in given:
        over = [
            e for e in recording.truth.events
            if e.kind == names[name] and e.onset_s < t[end - 1] and e.release_s > t[first]
        ]  # fmt: skip
        if len(over) == 1:
            late_begin.append(t[first] - over[0].onset_s)
            late_end.append(t[min(end, len(t) - 1)] - over[0].release_s)
    return Lateness(
        begin_s, begin_spread_s, end_s, end_spread_s, len(begins), **counts,
        true_begin_s=_middle(late_begin)[0],
        true_end_s=_middle(late_end)[0],
        wrong=float((said != true)[before].mean()) if before.any() else np.nan,
        wrong_after=float((repaired != true)[after].mean()) if after.any() else np.nan,
    )  # fmt: skip


def _middle(lags_s: list[float]) -> tuple[float, float]:
    """Return the median and the range of the middle half."""
    if not lags_s:
        return np.nan, np.nan
    early, median, late = np.quantile(lags_s, (0.25, 0.5, 0.75)).tolist()
    return median, late - early
