"""Windows of recordings with their classes, made by the device's own stages."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.frames import PreprocessSettings
from controller.recordings.recording import Recording as Source
from models.data import load
from models.data.examples import Source as Labelled
from models.data.examples import usable_windows
from models.data.ground_truth import labels_of
from models.data.recipe import DEFAULT
from models.evaluation.replay import network_inputs


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """n windows of a recording, their classes, and what was found to make them.

    Attributes:
        X: Images of relative capacitance, oldest first, 1.0 where untouched, (n, window, rows,
            columns), float32.
        y: Class at the end of each window, its number in `classes`, (n,).
        groups: Person of each window, else the session, (n,): splits must not part them.
        t: End of each window, seconds, (n,).
        classes: Names of the gestures, "null" first.
        sign: -1: a touch lowers the readings, 1: it raises them.
        rest: The untouched sensor as first found, (rows, columns), in the recording's unit; None
            if the sensor was never quiet.
        scale: What the difference from rest is divided by, in this unit; None: readings in pF are
            divided by rest.
    """

    X: NDArray[np.float32]
    y: NDArray[np.int64]
    groups: NDArray[np.str_]
    t: NDArray[np.float64]
    classes: tuple[str, ...]
    sign: int
    rest: NDArray[np.float32] | None
    scale: float | None


def settings_of(sources: Sequence[Source], window: int = 0) -> PreprocessSettings:
    """Return the preprocessing of a training for recordings of one kind; or ValueError."""
    origin = sources[0].origin
    return load.settings_of(sources, origin, origin.rate_hz, DEFAULT, window)


def cut(
    source: Source,
    name: str,
    settings: PreprocessSettings,
    classes: Sequence[str],
    span: slice,
    every: int = 1,
) -> Windows:
    """Return the labelled windows that end in a span of frames, every one of `every`.

    No window spans a missing frame or an excluded one. ValueError if there are no labels.
    """
    inputs, origin = network_inputs(source.frames, settings.plain), source.origin
    labelled = Labelled.of(source, names=classes, label=labels_of(source))
    first = inputs.last[0] - settings.window + 1 if len(inputs.last) else len(source.frames)
    ready = np.arange(len(source.frames)) >= first
    use, last = usable_windows(ready.tolist(), labelled, settings.window)
    ends = use[last]
    ends = ends[(ends >= span.start) & (ends < span.stop)][::every]
    return Windows(
        inputs.windows[np.searchsorted(inputs.last, ends)],
        labelled.label[ends].astype(np.int64),
        np.full(len(ends), origin.user or origin.session or name),
        source.t[ends],
        tuple(classes),
        origin.sign,
        inputs.rest,
        settings.scale if settings.normalise == "difference" else None,
    )
