"""Replay of recordings through a bundle's pipeline, or through one network and the debouncer."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import gestures_of
from controller.recognition.debounce import NULL, DebounceSettings
from controller.recognition.debounced_stream import fire, smooth
from controller.recognition.images.frames import Frame, PreprocessSettings, Window
from controller.recognition.images.preprocess import Preprocessor
from controller.recognition.pipeline import Networks, Pipeline
from controller.recognition.touch_position import ContactLevel
from controller.recordings.recording import PICOFARAD, Recording, RecordingError, refuse_misfit
from controller.shared.aliases import Windows
from controller.shared.event_metric import Answer
from controller.shared.touch_strength import scaled
from models.data.ground_truth import GroundTruth

BATCH: Final = 64  # windows in a run of a network: more are no faster
_NOWHERE: Final = (float("nan"), float("nan"))


@dataclass(frozen=True, slots=True, eq=False)
class NetworkInputs:
    """Windows that the device's preprocessing makes of a recording."""

    windows: Windows  # every whole window, oldest first
    last: NDArray[np.int64]  # last frame of each, (windows,)
    idle: NDArray[np.float64]  # mean of |z - 1| while nothing touches, then, (windows,)
    levels: NDArray[np.float64]  # of the contact in every frame, (n,)
    rest: Frame | None = None  # first image of the untouched sensor; None: it was never found


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """Output of the pipeline for a recording, frame by frame."""

    truth: GroundTruth  # ground truth of the recording
    ready: NDArray[np.bool_]  # the frame ends a whole window, (n,)
    # one per class, (n, classes); 1 for null where no window ends
    probabilities: NDArray[np.float32]
    idle: NDArray[np.float64]  # mean of |z - 1| while nothing touches; 0 where no window ends, (n,)
    levels: NDArray[np.float64]  # of the contact, (n,)
    touches: NDArray[np.float64]  # position of the present touch, grid units, NaN at rest, (n, 2)
    # standard deviation of it, grid units, NaN where the bundle gives none, (n,)
    sigmas: NDArray[np.float64]
    answers: tuple[Answer, ...]  # gestures that fired, in order


def run(bundle: Bundle, networks: Networks, recording: Recording, truth: GroundTruth) -> Stream:
    """Replay a recording as on the device; raise RecordingError if it does not fit."""
    refuse(recording, bundle)
    pipeline = Pipeline(bundle.settings, networks, bundle.mapping)
    steps = [pipeline.step(*one) for one in zip(recording.frames, truth.t.tolist(), strict=True)]
    inputs = network_inputs(recording.frames, bundle.preprocess)
    windows = np.array([step.probabilities for step in steps], dtype=np.float32)[inputs.last]
    return Stream(
        truth,
        *spread(windows, inputs, len(truth.t), len(bundle.labels)),
        inputs.levels,
        np.array([step.touch or _NOWHERE for step in steps]),
        np.array([np.nan if step.sigma is None else step.sigma for step in steps]),
        tuple(Answer(step.t_s, step.gesture) for step in steps if step.gesture is not None),
    )


def probabilities(bundle: Bundle, windows: Windows) -> NDArray[np.float32]:
    """Return the probability of each class by CNN-3D alone, (windows, classes)."""
    network, seen = gestures_of(bundle), scaled(windows, bundle.strength)
    parts = [network(seen[i : i + BATCH]) for i in range(0, len(seen) or 1, BATCH)]
    return np.concatenate(parts)


def network_inputs(frames: NDArray[np.float32], settings: PreprocessSettings) -> NetworkInputs:
    """Return the windows of frames (n, rows, columns), by the device's preprocessing."""
    stage = Preprocessor(settings, *frames.shape[1:])
    windows: list[Window] = []
    last: list[int] = []
    idle: list[float] = []
    contact, levels = ContactLevel(*frames.shape[1:]), np.zeros(len(frames))
    rest: Frame | None = None
    for number, frame in enumerate(frames):
        prepared = stage.step(frame)
        if prepared.ready:
            levels[number] = contact.step(prepared.image, prepared.idle)
            rest = stage.rest if rest is None else rest
        if prepared.ready and (window := stage.window()) is not None:
            windows.append(window)
            last.append(number)
            idle.append(prepared.idle)
    empty = np.empty((0, settings.window, *frames.shape[1:]), dtype=np.float32)
    stacked = np.stack(windows) if windows else empty
    return NetworkInputs(stacked, np.array(last, dtype=np.int64), np.array(idle), levels, rest)


def debounced_stream(
    truth: GroundTruth,
    inputs: NetworkInputs,
    outputs: NDArray[np.float32],
    labels: Sequence[str],
    settings: DebounceSettings,
) -> Stream:
    """Return the stream of window probabilities, (windows, classes), without touch positions."""
    ready, probabilities, idle = spread(outputs, inputs, len(truth.t), len(labels))
    nowhere = np.full((len(truth.t), 3), np.nan)
    means = smooth(probabilities, settings.weight(idle))
    fired = fire(means, settings, truth.rate_hz, labels, inputs.levels, idle)
    answers = tuple(Answer(float(truth.t[frame]), labels[kind]) for frame, kind in fired)
    places, sigmas = nowhere[:, :2], nowhere[:, 2]
    return Stream(truth, ready, probabilities, idle, inputs.levels, places, sigmas, answers)


def spread(
    outputs: NDArray[np.float32], inputs: NetworkInputs, frames: int, classes: int
) -> tuple[NDArray[np.bool_], NDArray[np.float32], NDArray[np.float64]]:
    """Return which frames end a window, (n,), their probabilities, (n, classes), and idle, (n,)."""
    probabilities = np.zeros((frames, classes), dtype=np.float32)
    probabilities[:, NULL] = 1.0
    probabilities[inputs.last] = outputs
    ready = np.zeros(frames, dtype=np.bool_)
    ready[inputs.last] = True
    idle = np.zeros(frames)
    idle[inputs.last] = inputs.idle
    return ready, probabilities, idle


def refuse(recording: Recording, bundle: Bundle) -> None:
    """Raise RecordingError for a recording of another sensor or rate than the bundle's."""
    refuse_misfit(recording, bundle.settings)
    origin = recording.origin
    if bundle.preprocess.normalise == "ratio" and not origin.signal.ratio:
        raise RecordingError(
            f"the recording is in {origin.unit}, {'raised' if origin.sign > 0 else 'lowered'} by "
            f"touch, the bundle wants {PICOFARAD} lowered by touch; choose another with --bundle"
        )
