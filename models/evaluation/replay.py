"""Recordings played through a bundle, many windows at once, as the device would frame by frame.

The stages are the device's own. Only the networks are asked differently: all windows of a session
first, and then the very `Pipeline` runs with their answers at hand.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.bundles.inference import onnxruntime_engine
from controller.recognition.debounce import NULL, DebounceSettings
from controller.recognition.event_metric import Answer
from controller.recognition.pipeline import Networks as PipelineNetworks
from controller.recognition.pipeline import Pipeline, Touch
from controller.recognition.preprocess import Image, Preprocessor, PreprocessSettings, Window
from controller.recordings.recording import PICOFARAD, Recording, refuse_misfit
from models.data.ground_truth import Known

AT_ONCE: Final = 64  # windows that a network is asked together: more are no faster
_NOWHERE: Final = (float("nan"), float("nan"))

Windows = NDArray[np.float32]  # (windows, images, rows, columns)


@dataclass(frozen=True, slots=True, eq=False)
class Felt:
    """What the sensor's frames became.

    Attributes:
        windows: Every whole window, oldest first.
        last: Last frame of each, (windows,).
    """

    windows: Windows
    last: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """What was made of a recording, frame by frame.

    Attributes:
        known: What is known of it.
        ready: A whole window was there, (n,).
        probabilities: One per class, (n, classes); certainly null where no window was there.
        touches: Where the present touch is, grid units, NaN at rest, (n, 2).
        sigmas: Deviation that the bundle gives it, grid units, NaN where it gives none, (n,).
        answers: Gestures that fired, in order.
    """

    known: Known
    ready: NDArray[np.bool_]
    probabilities: NDArray[np.float32]
    touches: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    answers: tuple[Answer, ...]


class Networks(Protocol):
    """What answers many questions at once."""

    def probabilities(self, windows: Windows) -> NDArray[np.float32]:
        """Return the probability of each class, (windows, classes)."""

    def touches(self, images: NDArray[np.float32]) -> NDArray[np.float32] | None:
        """Return where images (images, rows, columns) are touched, (images, 2); None: unknown."""


class Batched:
    """The networks of a bundle, asked many questions at once."""

    def __init__(self, bundle: Bundle) -> None:
        self._gesture = onnxruntime_engine.session(bundle.gesture_onnx)
        self._location = (
            onnxruntime_engine.session(bundle.location_onnx) if bundle.locates else None
        )

    def probabilities(self, windows: Windows) -> NDArray[np.float32]:
        """Return the probability of each class, (windows, classes)."""
        return _ask(self._gesture, windows)

    def touches(self, images: NDArray[np.float32]) -> NDArray[np.float32] | None:
        """Return where images are touched, (images, 2); None where the bundle locates nothing."""
        return None if self._location is None else _ask(self._location, images)


def run(bundle: Bundle, networks: Networks, recording: Recording, known: Known) -> Stream:
    """Play a recording through a bundle's stages.

    Args:
        bundle: Names the stages' settings.
        networks: Its own (`Batched`), or others in their place.
        recording: Its frames.
        known: What is known of them.

    Raises:
        RecordingError: The bundle is for another sensor or rate.
    """
    refuse(recording, bundle)
    felt = feel(recording.frames, bundle.preprocess)
    return replay(bundle, networks, recording, known, felt)


def feel(frames: NDArray[np.float32], settings: PreprocessSettings) -> Felt:
    """Take frames (n, rows, columns) through the device's preprocessing."""
    stage = Preprocessor(settings, *frames.shape[1:])
    windows: list[Window] = []
    last: list[int] = []
    for number, frame in enumerate(frames):
        if stage.step(frame).ready and (window := stage.window()) is not None:
            windows.append(window)
            last.append(number)
    empty = np.empty((0, settings.window, *frames.shape[1:]), dtype=np.float32)
    return Felt(np.stack(windows) if windows else empty, np.array(last, dtype=np.int64))


def replay(
    bundle: Bundle, networks: Networks, recording: Recording, known: Known, felt: Felt
) -> Stream:
    """Let the device's pipeline make of a recording what these networks say."""
    answers = networks.probabilities(felt.windows)
    spoken = _Spoken(answers, len(known.t))
    pipeline = Pipeline(bundle.settings, spoken, bundle.mapping)
    fired = []
    sigmas = np.full(len(known.t), np.nan)
    for frame, t_s in zip(recording.frames, known.t.tolist(), strict=True):
        step = pipeline.step(frame, t_s)
        sigmas[spoken.frame] = np.nan if step.sigma is None else step.sigma
        spoken.frame += 1
        if step.gesture is not None:
            fired.append(Answer(t_s, step.gesture))
    ready, probabilities = spread(answers, felt, len(known.t), len(bundle.labels))
    touches = np.full((len(known.t), 2), np.nan)
    if spoken.images and (places := networks.touches(np.stack(spoken.images))) is not None:
        touches[spoken.asked] = places
    return Stream(known, ready, probabilities, touches, sigmas, tuple(fired))


def answered(
    known: Known,
    felt: Felt,
    answers: NDArray[np.float32],
    labels: Sequence[str],
    settings: DebounceSettings,
) -> Stream:
    """Return what a debouncer makes of answers to all windows; nobody asks where touches are.

    Args:
        known: What is known of the recording.
        felt: Its windows.
        answers: Probabilities of each window, (windows, classes).
        labels: The classes, "null" first.
        settings: When a gesture counts.
    """
    ready, probabilities = spread(answers, felt, len(known.t), len(labels))
    nowhere = np.full((len(known.t), 3), np.nan)
    fired = fire(
        smoothed(probabilities, settings.smoothing), known.t, labels, settings.on, settings.off
    )
    where, sigmas = nowhere[:, :2], nowhere[:, 2]
    return Stream(known, ready, probabilities, where, sigmas, tuple(fired))


def spread(
    answers: NDArray[np.float32], felt: Felt, frames: int, classes: int
) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Return which frames end a window, and the probabilities of every frame, (n, classes)."""
    probabilities = np.zeros((frames, classes), dtype=np.float32)
    probabilities[:, NULL] = 1.0
    probabilities[felt.last] = answers
    ready = np.zeros(frames, dtype=np.bool_)
    ready[felt.last] = True
    return ready, probabilities


def smoothed(probabilities: NDArray[np.float32], smoothing: float) -> NDArray[np.float64]:
    """Return the debouncer's running mean after every frame, (n, classes)."""
    means = np.empty(probabilities.shape)
    mean = np.zeros(probabilities.shape[1])
    mean[NULL] = 1.0
    for number, newest in enumerate(probabilities.astype(np.float64)):
        mean += smoothing * (newest - mean)
        means[number] = mean
    return means


def fire(
    means: NDArray[np.float64], t: NDArray[np.float64], labels: Sequence[str], on: float, off: float
) -> list[Answer]:
    """Return what a debouncer answers to these running means: `Debouncer`, but all at once."""
    best = NULL + 1 + means[:, NULL + 1 :].argmax(axis=1)
    rises = np.flatnonzero(means[np.arange(len(means)), best] >= on)
    falls = np.flatnonzero(1.0 - means[:, NULL] < off)
    answers = []
    at = 0
    while at < len(rises):
        frame = int(rises[at])
        answers.append(Answer(float(t[frame]), labels[int(best[frame])]))
        place = int(np.searchsorted(falls, frame, side="right"))
        if place == len(falls):
            break
        at = int(np.searchsorted(rises, falls[place], side="right"))
    return answers


def debounced(stream: Stream, labels: Sequence[str], settings: DebounceSettings) -> list[Answer]:
    """Return what a debouncer of other settings answers to a stream."""
    means = smoothed(stream.probabilities, settings.smoothing)
    return fire(means, stream.known.t, labels, settings.on, settings.off)


def refuse(recording: Recording, bundle: Bundle) -> None:
    """Refuse a recording of another sensor or rate than the bundle's.

    Raises:
        RecordingError: It is.
    """
    if bundle.preprocess.normalise != "ratio":  # then the unit is the sensor's own
        recording = replace(recording, origin=replace(recording.origin, unit=PICOFARAD))
    refuse_misfit(recording, bundle.settings)


class _Spoken(PipelineNetworks):
    """Networks for the pipeline that have answered already."""

    def __init__(self, answers: NDArray[np.float32], frames: int) -> None:
        self._answers = iter(answers)
        self.frame = 0
        self.asked: list[int] = []  # frames in which something touched
        self.images: list[Image] = []  # and their images

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        """Return the answer to the next window."""
        return next(self._answers)

    def touch(self, image: Image) -> Touch | None:
        """Keep the image: its place is asked for later, and meanwhile is nowhere."""
        self.asked.append(self.frame)
        self.images.append(image)
        return _NOWHERE


def _ask(session: Any, questions: NDArray[np.float32]) -> NDArray[np.float32]:
    """Ask in batches; an empty list of questions has an empty list of answers."""
    (entry,), (leave,) = session.get_inputs(), session.get_outputs()
    parts = [
        session.run([leave.name], {entry.name: questions[i : i + AT_ONCE]})[0]
        for i in range(0, len(questions), AT_ONCE)
    ]
    return np.concatenate(parts) if parts else np.empty((0, leave.shape[1]), dtype=np.float32)
