"""Windows of several sessions for the estimators, with their classes, events and times."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import vocabulary
from controller.recognition.images.frames import PreprocessSettings
from controller.recordings.recording import UNKNOWN, Recording
from models.data.examples import (
    Choice,
    Labels,
    Source,
    column,
    labellers,
    prepare,
    renumbered,
    run_starts,
)
from models.data.ground_truth import labels_of, true_places

GAIN: Final = 10.0  # z - 1 is about 0.1 under a touch
WINDOW_S: Final = 1.0  # paper, section 4.1
REST_S: Final = 10.0  # paper, section 4.1: C0 is the mean of the first ten seconds
SILENCE: Final = 3  # frames without a class, beyond which one event ends
LABELLERS: Final[tuple[Labels, ...]] = ("button", "key", "cue", "true")  # people's labels first

Numbers = NDArray[np.int64]  # (n,)


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Windows of several sessions."""

    # changes of the taxels, about 1 under a touch, float32 (n, images, taxels)
    x: NDArray[np.float32]
    y: Numbers  # class of each window, that of its last frame, (n,)
    session: Numbers  # session of each, (n,)
    frame: Numbers  # last frame of each, counted among the usable ones of its session, (n,)
    event: Numbers  # number of the touch, or of the pause between touches, across sessions, (n,)
    place: NDArray[np.float32]  # of the touch, grid units; NaN where unknown, (n, 2)
    labels: tuple[str, ...]  # names of the classes, "null" first
    rate_hz: float  # frames per second
    grid: tuple[int, int]  # rows and columns of taxels

    @property
    def flat(self) -> NDArray[np.float32]:
        """The windows as vectors, (n, images x taxels)."""
        return self.x.reshape(len(self.x), -1)

    def every(self, step: int) -> "Windows":
        """Return every `step`-th window."""
        return self.pick(np.arange(0, len(self.y), step))

    def pick(self, index: Numbers | NDArray[np.bool_]) -> "Windows":
        """Return some windows, by numbers or by a mask (n,)."""
        columns = ("x", "y", "session", "frame", "event", "place")
        return replace(self, **{name: getattr(self, name)[index] for name in columns})


def cut(recordings: Sequence[Recording], choice: Choice = "auto") -> Windows:
    """Cut windows from recordings of one sensor, people's labels moved to the touches."""
    names = _names(recordings)
    origin = recordings[0].origin
    images = max(1, round(WINDOW_S * origin.rate_hz))
    sources = [Source.of(one, names=names, label=labels_of(one, choice)) for one in recordings]
    sources = [
        replace(own, touch=true_places(one, own.label, vocabulary.of(names)))
        for own, one in zip(sources, recordings, strict=True)
    ]
    examples = prepare(sources, PreprocessSettings(rate_hz=origin.rate_hz, window=images))
    ends = examples.ends
    x = GAIN * (examples.windows(ends).reshape(len(ends), images, -1) - 1.0)
    y, session = examples.label[ends].astype(np.int64), examples.session[ends].astype(np.int64)
    frame = ends - np.searchsorted(examples.session, np.arange(len(sources)))[session]
    event = event_numbers(y, session, frame)
    grid = origin.rows, origin.columns
    place = examples.touch[ends]
    return Windows(x, y, session, frame, event, place, names, origin.rate_hz, grid)


def _names(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return the labels, "null" first; raise ValueError for recordings of several kinds."""
    origins = [one.origin for one in recordings]
    names = max((one.labels for one in origins), key=len)
    kinds = {f"{one.rows}×{one.columns} taxels at {one.rate_hz:g} Hz" for one in origins}
    odd = {", ".join(one.labels) for one in origins if not set(one.labels) <= set(names)}
    for several in (kinds, {", ".join(names), *odd}):
        if len(several) > 1:
            listed = " and of ".join(sorted(several))
            raise ValueError(f"recordings of {listed}; estimate from one kind")
    return tuple(names)


def event_numbers(y: Numbers, session: Numbers, frame: Numbers) -> Numbers:
    """Return the number of the touch, or of the pause, of each window, all (n,)."""
    # A single frame of unknown class separates nothing; a longer silence does.
    return np.cumsum(run_starts(frame, y, session, gap=SILENCE)) - 1


def fixed_ratio(frames: NDArray[np.float32], rate_hz: float) -> NDArray[np.float64]:
    """Return z, (n, taxels), of frames (n, rows, columns) divided by their first ten seconds."""
    rest = frames[: max(1, round(REST_S * rate_hz))].mean(axis=0)
    return np.asarray((frames / rest).reshape(len(frames), -1), dtype=np.float64)


def as_the_paper(recordings: Sequence[Recording]) -> tuple[NDArray[np.float64], Numbers]:
    """Return z, (n, taxels), and labels, (n,), as section 6 has them: all frames, labels as given.

    Labels are the button's, else the keys', else the cues', else the truth.
    """
    signals, labels = [], []
    names = _names(recordings)
    for one in recordings:
        given = column(one, next(iter(labellers(one, LABELLERS)), LABELLERS[-1]))
        label = renumbered(given, one.origin.labels, names).astype(np.int64)
        known = (label != UNKNOWN) & ~one.excluded
        signals.append(fixed_ratio(one.frames, one.origin.rate_hz)[known])
        labels.append(label[known])
    return np.concatenate(signals), np.concatenate(labels)
