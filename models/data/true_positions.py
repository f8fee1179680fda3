"""True positions of touches: from a simulation, or from the cue that asked for the place."""

import re
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.vocabulary import Vocabulary
from controller.recordings.recording import Recording

_PLACE: Final = re.compile(r"go (\S+) at (-?[0-9.]+),(-?[0-9.]+)")  # a cue's mark


def places(
    recording: Recording, label: NDArray[np.integer], vocabulary: Vocabulary
) -> NDArray[np.float32]:
    """Return where the touches are whose place is learned, grid units, NaN elsewhere, (n, 2).

    A simulation knows; else it is where the cue asked for it.
    """
    located = [vocabulary.labels.index(name) for name in vocabulary.located]
    if recording.truth is not None:
        where = recording.truth.touch.astype(np.float32)
        return np.where(np.isin(label, located)[:, None], where, np.float32(np.nan))
    place = np.full((len(label), 2), np.nan, dtype=np.float32)
    cued = [
        (mark.t_s, match) for mark in recording.marks
        if mark.kind == "cue" and (match := _PLACE.fullmatch(mark.text))
    ]  # fmt: skip
    for number, (begin_s, match) in enumerate(cued):
        if match[1] not in vocabulary.located:
            continue
        # The touch may last into the rest that follows, but not into what is asked next.
        end_s = cued[number + 1][0] if number + 1 < len(cued) else np.inf
        inside = (recording.t >= begin_s) & (recording.t < end_s)
        own = inside & (label == vocabulary.labels.index(match[1]))
        place[own] = (float(match[2]), float(match[3]))
    return place
