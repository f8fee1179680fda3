"""Debouncing of a whole recording at once, so that many settings can be compared.

`smooth` and `fire` do what `Debouncer` does frame by frame; a test compares both. By them `patient`
finds which gestures have to wait for a taught one. What touches is not known here.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.debounce import (
    BEFORE_S,
    KEPT_S,
    NULL,
    Debouncer,
    DebounceSettings,
    Means,
    Probabilities,
    landed,
    landing_frames,
)
from controller.shared.aliases import Index

# What makes an older gesture wait for a taught one
_EARLY_SHARE: Final = 0.2  # share of a gesture's streams in which the older one fires first
_NEAR_SHARE: Final = 0.97  # of the bounds: what comes so near fires on another day or orb
_WAIT_FACTOR: Final = 1.2  # of the longest time in the streams: people vary
LONGEST_S: Final = 0.6  # a command that comes later feels lost


def smooth(probabilities: Probabilities, weight: float | NDArray[np.float64]) -> Means:
    """Return the debouncer's running mean after every frame, (frames, classes).

    Args:
        probabilities: Of each frame, (frames, classes).
        weight: Of the newest ones, `DebounceSettings.weight`; of all frames, or of each, (frames,).
    """
    means = np.empty(probabilities.shape)
    weights = np.broadcast_to(weight, len(means)).tolist()
    mean = np.zeros(probabilities.shape[1])
    mean[NULL] = 1.0
    for frame, newest in enumerate(probabilities.astype(np.float64)):
        mean += weights[frame] * (newest - mean)
        means[frame] = mean
    return means


def fire(
    means: Means,
    settings: DebounceSettings,
    rate_hz: float = 10.0,
    labels: Sequence[str] = (),
    levels: NDArray[np.float64] | None = None,
    idle: float | NDArray[np.float64] = 0.0,
) -> list[tuple[int, int]]:
    """Return the frame and the class of every gesture that `Debouncer` fires.

    Args:
        means: What `smooth` returns for the settings' weights, (frames, classes).
        settings: When a gesture fires.
        rate_hz: Frames per second.
        labels: The classes, "null" first; only for settings with patient, slow or brisk ones.
        levels: Of the contact in each frame, (frames,); None: unknown.
        idle: Mean of |z - 1| while nothing touches; of all frames, or of each, (frames,).
    """
    levels = np.zeros(len(means)) if levels is None else levels
    if settings.patient:
        stage = Debouncer(labels, settings, rate_hz)
        found = []
        noise = np.broadcast_to(idle, len(means)).tolist()
        for number, (mean, level, own) in enumerate(zip(means, levels, noise, strict=True)):
            if (kind := stage.decide(mean, own, float(level), float(level))) != NULL:
                found.append((number, kind))
        return found
    gestures = means[:, NULL + 1 :]
    touched = np.concatenate([[False], 1.0 - means[:, NULL] >= settings.off, [False]])
    begins, ends = np.flatnonzero(np.diff(touched.astype(np.int8))).reshape(-1, 2).T
    if not len(begins):
        return []
    frame = np.arange(len(means))
    since = frame - begins[np.maximum(np.searchsorted(begins, frame, side="right") - 1, 0)] + 1
    early = gestures
    if settings.slow:
        early = gestures.copy()
        for label in settings.slow:
            early[since / rate_hz < settings.slow_s, labels.index(label) - NULL - 1] = 0.0
    brisk = [labels.index(label) for label in settings.brisk]
    least, _ = settings.tap(np.broadcast_to(idle, len(means)))
    needed = np.empty(gestures.shape)
    for kind, bound in enumerate(needed.T, NULL + 1):
        bound[:] = settings.bound(since / rate_hz, least, brisk=kind in brisk)
    sure = np.flatnonzero((early >= needed).any(axis=1))
    taps = _taps(means, settings, rate_hz, levels, idle, begins, ends)
    seen, kept = np.column_stack([levels, levels]), round(KEPT_S * rate_hz)
    fired: list[tuple[int, int]] = []

    def has_landed(frame: int, kind: int, *, left: bool = False) -> bool:
        within = landing_frames(settings, rate_hz, left=left) if kind in brisk else kept
        after = max(fired[-1][0] + 1 if fired else 0, frame + 1 - within)
        return settings.lifted > 1.0 or landed(seen[after : frame + 1])

    for number, (begin, end) in enumerate(zip(begins.tolist(), ends.tolist(), strict=True)):
        for at in sure[np.searchsorted(sure, begin) : np.searchsorted(sure, end)].tolist():
            likely = early[at]
            if brisk and not has_landed(at, brisk[0]):
                likely = likely.copy()
                likely[[one - NULL - 1 for one in brisk]] = 0.0
            best = int(likely.argmax())
            if likely[best] >= needed[at, best]:
                fired.append((at, NULL + 1 + best))
                break
        else:
            if taps[number] != NULL and has_landed(end, taps[number], left=True):
                fired.append((end, int(taps[number])))
    return fired


def _taps(
    means: Means,
    settings: DebounceSettings,
    rate_hz: float,
    levels: NDArray[np.float64],
    idle: float | NDArray[np.float64],
    begins: Index,
    ends: Index,
) -> Index:
    """Return the class that each touch, (touches,), is a tap of at its end, or NULL.

    Touches are from the frame `begins` to the one before `ends`; else as in `fire`.
    """
    if settings.least > 1.0:
        return np.full(len(begins), NULL)
    gestures = means[:, NULL + 1 :]
    bounds = np.column_stack([begins, ends]).ravel()
    padded = np.vstack([gestures, np.zeros(gestures.shape[1])])
    sums = np.add.reduceat(padded, bounds)[::2]
    peaks = np.maximum.reduceat(padded, bounds)[::2]
    most, touch = sums.argmax(axis=1), np.arange(len(begins))
    noise = np.broadcast_to(idle, len(means))[np.minimum(ends, len(means) - 1)]
    least, brief_s = settings.tap(noise)
    low, high, last = _touch_levels(levels, begins, ends, max(1, round(BEFORE_S * rate_hz)))
    enough = (
        (ends < len(means))
        & (peaks[touch, most] >= least)
        & (sums[touch, most] / rate_hz >= brief_s)
        & ((settings.lifted > 1.0) | (last - low <= settings.lifted * (high - low)))
    )
    return np.where(enough, NULL + 1 + most, NULL)


def _touch_levels(
    levels: NDArray[np.float64], begins: Index, ends: Index, before: int
) -> tuple[NDArray[np.float64], ...]:
    """Return levels of the contact before each touch, in it at most, and after it, (touches,).

    Touches are from the frame `begins` to the one before `ends`; `before` frames come before them.
    """
    padded = np.concatenate([np.zeros(before - 1), levels])
    lowest = np.lib.stride_tricks.sliding_window_view(padded, before).min(axis=1)
    bounds = np.column_stack([begins, ends]).ravel()
    highest = np.maximum.reduceat(np.append(levels, 0.0), bounds)[::2]
    return lowest[begins], highest, levels[np.minimum(ends, len(levels) - 1)]


def patient(
    settings: DebounceSettings,
    labels: Sequence[str],
    label: str,
    streams: Sequence[Probabilities],
    rate_hz: float,
    idle: float = 0.0,
) -> DebounceSettings:
    """Return settings with which older gestures wait for a taught one that begins like them.

    A double tap begins like a press, and a network that answers early would answer its first tap.

    Args:
        settings: As they are; what waits already goes on waiting.
        labels: All labels, "null" first; those before `label` may wait for it.
        label: The taught gesture.
        streams: Probabilities of each frame of its examples, and of variations that the network has
            not learned, (frames, classes) each.
        rate_hz: Frames per second.
        idle: Mean of |z - 1| of the examples where nothing touches.
    """
    if label in settings.eager:
        return settings
    weight, own = settings.weight(idle), labels.index(label)
    on, late = _NEAR_SHARE * settings.on, _NEAR_SHARE * settings.late
    eager = replace(settings, on=on, late=late, patient=(), awaited=(), patience_s=0.0)
    delays: dict[int, list[float]] = {}
    for stream in streams:
        means = smooth(stream, weight)
        first = next(iter(fire(means, eager, rate_hz, labels, idle=idle)), None)
        sure = np.flatnonzero(means[:, own] >= min(on, late))
        if first is not None and first[1] < own and len(sure) and sure[0] > first[0]:
            delays.setdefault(first[1], []).append(float(sure[0] - first[0]) / rate_hz)
    early = {kind: max(s) for kind, s in delays.items() if len(s) >= _EARLY_SHARE * len(streams)}
    if not early:
        return settings
    longest_s = min(LONGEST_S, _WAIT_FACTOR * max(early.values()))
    waiting = (*settings.patient, *(labels[kind] for kind in sorted(early)))
    return replace(
        settings,
        patient=tuple(dict.fromkeys(waiting)),
        awaited=tuple(dict.fromkeys((*settings.awaited, label))),
        patience_s=round(max(settings.patience_s, longest_s), 3),
    )
