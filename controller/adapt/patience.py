"""Which older gestures wait for a taught one that begins like them, and how long.

A double tap begins like a press: a network that answers early would answer its first tap. So the
taught network is run over the examples and variations of them. Where an older gesture fires in
these before the taught one is sure, the older one becomes patient
(`controller.recognition.debounce`), in this bundle only.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.debounce import DebounceSettings, fire, smooth

SHARE: Final = 0.2  # of a gesture's streams in which an older one fires first
NEAR: Final = 0.97  # of the bounds: what comes so near fires on another day or orb
MARGIN: Final = 1.2  # of the longest time in the examples: people vary
LONGEST_S: Final = 0.6  # a command that comes later feels lost

Stream = NDArray[np.float32]  # probabilities of an example's frames, (frames, classes)


def patient(
    settings: DebounceSettings,
    labels: Sequence[str],
    taught: dict[str, list[Stream]],
    rate_hz: float,
    idle: float = 0.0,
) -> DebounceSettings:
    """Return debounce settings with which older gestures wait for taught ones.

    Of the taught ones, those that come first in `labels` may wait for those after them.

    Args:
        settings: As they are; what waits already goes on waiting.
        labels: All labels, "null" first.
        taught: The taught network's probabilities for the examples of each new label, and for
            variations that it has not learned.
        rate_hz: Frames per second.
        idle: Mean of |z - 1| of the examples where nothing touches.
    """
    weight = settings.weight(idle)
    on, late = NEAR * settings.on, NEAR * settings.late
    eager = replace(settings, on=on, late=late, patient=(), awaited=(), patience_s=0.0)
    waiting, awaited = list(settings.patient), list(settings.awaited)
    longest_s = settings.patience_s
    for label, streams in taught.items():
        delays = [_delay(eager, weight, labels.index(label), one, rate_hz) for one in streams]
        found = [delay for delay in delays if delay is not None]
        for kind in {kind for kind, _ in found}:
            times_s = [time_s for other, time_s in found if other == kind]
            if len(times_s) < SHARE * len(streams) or kind > labels.index(label):
                continue
            waiting.append(labels[kind])
            awaited.append(label)
            longest_s = max(longest_s, min(LONGEST_S, MARGIN * max(times_s)))
    return replace(
        settings,
        patient=tuple(dict.fromkeys(waiting)),
        awaited=tuple(dict.fromkeys(awaited)),
        patience_s=round(longest_s, 3),
    )


def _delay(
    settings: DebounceSettings, weight: float, own: int, stream: Stream, rate_hz: float
) -> tuple[int, float] | None:
    """Return the class that fires before `own` is sure in an example, and how much, seconds."""
    means = smooth(stream, weight)
    first = next(iter(fire(means, settings, rate_hz)), None)
    sure = np.flatnonzero(means[:, own] >= min(settings.on, settings.late))
    if first is None or first[1] == own or not len(sure) or sure[0] <= first[0]:
        return None
    return first[1], float(sure[0] - first[0]) / rate_hz
