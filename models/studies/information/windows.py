"""Windows for the estimators, of several sessions, with their classes, events and times."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import vocabulary
from controller.recognition.preprocess import PreprocessSettings
from controller.recordings.recording import UNKNOWN, Recording
from models.data.examples import COLUMNS, Choice, Labels, Source, prepare
from models.data.ground_truth import labels_of, true_places

GAIN: Final = 10.0  # z - 1 is about 0.1 under a touch
REST_S: Final = 10.0  # paper, section 4.1: C0 is the mean of the first ten seconds
SAID: Final[tuple[Labels, ...]] = ("button", "key", "cue", "true")  # people's labels first


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """Windows of several sessions.

    Attributes:
        x: Changes of the taxels, about 1 under a touch, float32 (n, images, taxels).
        y: Class of each window, that of its last frame, (n,).
        session: Its session, (n,).
        frame: Its last frame, counted among those that its session can use, (n,).
        event: Which touch, or which pause between touches, it is of; all sessions' differ, (n,).
        place: Where the touch is, grid units; NaN where nobody knows, (n, 2).
        labels: Names of the classes, "null" first.
        rate_hz: Frames per second.
        grid: Rows and columns of taxels.
    """

    x: NDArray[np.float32]
    y: NDArray[np.int64]
    session: NDArray[np.int64]
    frame: NDArray[np.int64]
    event: NDArray[np.int64]
    place: NDArray[np.float32]
    labels: tuple[str, ...]
    rate_hz: float
    grid: tuple[int, int]

    def every(self, step: int) -> "Taken":
        """Return every so manieth window."""
        return self.pick(np.arange(0, len(self.y), step))

    def pick(self, index: NDArray[np.int64] | NDArray[np.bool_]) -> "Taken":
        """Return some windows."""
        columns = ("x", "y", "session", "frame", "event", "place")
        return replace(self, **{name: getattr(self, name)[index] for name in columns})

    def touched(self) -> "Taken":
        """Return the windows of gestures only."""
        return self.pick(self.y > 0)


def take(
    recordings: Sequence[Recording],
    *,
    choice: Choice = "auto",
    window_s: float = 1.0,
    rest: str = "followed",
) -> Taken:
    """Cut windows from recordings of one sensor.

    Args:
        recordings: A session each.
        choice: Whose labels count; people's are moved to the touches.
        window_s: Length of a window: the paper's second.
        rest: "followed", as the device does; "first": the mean of the first ten seconds, for ever,
            as in the paper.

    Raises:
        ValueError: They are of several kinds, have no labels, or are too short.
    """
    origin = recordings[0].origin
    names = max((one.origin.labels for one in recordings), key=len)
    rows, columns, rate = origin.rows, origin.columns, origin.rate_hz
    for one in recordings:
        other = one.origin
        if (other.rows, other.columns, other.rate_hz) != (rows, columns, rate):
            raise ValueError(
                f"recordings of {rows}×{columns} taxels at {rate:g} Hz and of {other.rows}×"
                f"{other.columns} at {other.rate_hz:g} Hz; estimate from one kind"
            )
        if not set(other.labels) <= set(names):
            raise ValueError(
                f"recordings with the labels {', '.join(names)} and {', '.join(other.labels)}; "
                "estimate from one kind"
            )
    images = max(1, round(window_s * rate))
    settings = PreprocessSettings(rate_hz=rate, window=images)
    sources = []
    for one in recordings:
        number = np.array([*(names.index(name) for name in one.origin.labels), UNKNOWN])
        label = number[labels_of(one, choice)]
        place = true_places(one, label, vocabulary.of(names))
        sources.append(Source(one.frames, label, place, one.sequence, one.excluded))
    if rest == "first":
        return _fixed(sources, images, names, rate)
    examples = prepare(sources, settings)
    ends = examples.ends
    begins = np.searchsorted(examples.session, np.arange(len(sources)))
    x = GAIN * (examples.windows(ends).reshape(len(ends), images, -1) - 1.0)
    session = examples.session[ends].astype(np.int64)
    frame = ends - begins[session]
    y = examples.label[ends]
    of, place = events(y, session, frame), examples.touch[ends]
    return Taken(x, y, session, frame, of, place, tuple(names), rate, (rows, columns))


def _fixed(sources: Sequence[Source], images: int, names: Sequence[str], rate_hz: float) -> Taken:
    """Return windows of z = C / C0 with C0 from the first seconds, known classes only."""
    parts: dict[str, list[NDArray[Any]]] = {
        name: [] for name in ("x", "y", "session", "frame", "place")
    }
    for number, source in enumerate(sources):
        first = round(REST_S * rate_hz)
        z = GAIN * (source.frames / source.frames[:first].mean(axis=0) - 1.0)
        ends = np.flatnonzero(source.label != UNKNOWN)
        ends = ends[ends >= first + images - 1]
        index = ends[:, None] + np.arange(1 - images, 1)
        parts["x"].append(z.reshape(len(z), -1)[index].astype(np.float32))
        parts["y"].append(source.label[ends].astype(np.int64))
        parts["session"].append(np.full(len(ends), number, dtype=np.int64))
        parts["frame"].append(ends.astype(np.int64))
        parts["place"].append(source.touch[ends])
    x, y, session, frame, place = (np.concatenate(parts[name]) for name in parts)
    rows, columns = sources[0].frames.shape[1:]
    of = events(y, session, frame)
    return Taken(x, y, session, frame, of, place, tuple(names), rate_hz, (rows, columns))


def events(
    y: NDArray[np.int64], session: NDArray[np.int64], frame: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the number of the touch, or of the pause, that each window is of, (n,)."""
    begins = np.zeros(len(y), dtype=np.bool_)
    # A frame of nobody knows what parts nothing; a longer silence does.
    begins[1:] = (np.diff(y) != 0) | (np.diff(session) != 0) | (np.abs(np.diff(frame)) > 3)
    return np.cumsum(begins).astype(np.int64)


def as_the_paper(recordings: Sequence[Recording]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return z, (n, taxels), and labels, (n,), as section 6 has them: all frames, labels as said.

    z is C / C0 with C0 the mean of the first ten seconds; labels are the button's, else the keys',
    else the cues', else the truth.
    """
    signals, labels = [], []
    names = max((one.origin.labels for one in recordings), key=len)
    for one in recordings:
        whose: Labels = next((n for n in SAID if (getattr(one, COLUMNS[n]) > 0).any()), "true")
        number = np.array([*(names.index(name) for name in one.origin.labels), UNKNOWN])
        label = number[getattr(one, COLUMNS[whose])]
        known = (label != UNKNOWN) & ~one.excluded
        rest = one.frames[: max(1, round(REST_S * one.origin.rate_hz))].mean(axis=0)
        z = (one.frames / rest).reshape(len(label), -1).astype(np.float64)
        signals.append(z[known])
        labels.append(label[known])
    return np.concatenate(signals), np.concatenate(labels)
