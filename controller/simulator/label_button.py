"""The label button beside the orb (paper, section 4.2), pressed with human timing."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.event_metric import Event

# A prototype's choices, not measured; with them the button agrees with the truth in
# about nine frames of ten.
LATE_S: Final = 0.05  # people react rather than foresee
PRESS_SD_S: Final = 0.12
RELEASE_SD_S: Final = 0.15  # letting go is less exact
MISSED: Final = 0.005  # share of gestures that are never labelled


def hold(
    events: Sequence[Event],
    labels: Sequence[str],
    time_s: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.int8]:
    """Return the index of the label that the button gives at times, all (frames,); 0: it is up."""
    missed = rng.random(len(events)) < MISSED
    error = rng.normal(LATE_S, (PRESS_SD_S, RELEASE_SD_S), (len(events), 2))
    down = np.array([event.onset_s for event in events]) + error[:, 0]
    up = np.maximum(np.array([event.release_s for event in events]) + error[:, 1], down)
    button = np.zeros(len(time_s), dtype=np.int8)
    first, last = np.searchsorted(time_s, down), np.searchsorted(time_s, up)
    for i in np.flatnonzero(~missed).tolist():
        button[first[i] : last[i]] = labels.index(events[i].kind)
    return button
