"""One session of teaching: its parts, each checked before anything runs, and the run itself."""

import argparse
import logging
import sys
import time
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.bundles.vocabulary import Vocabulary
from controller.capture.cues import CueSession, ExampleRequest
from controller.capture.labels import Labeller
from controller.capture.session_recorder import RunFiles, SessionRecorder, provenance
from controller.capture.simulated_hand import CuedHand
from controller.errors import count
from controller.links.base import Link
from controller.protocol.messages import Message
from controller.recognition.debounce import NULL, DebounceSettings
from controller.recognition.frames import PreprocessSettings, Window, same_rate
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Networks, Pipeline, PipelineSettings
from controller.recordings.recorder import Recorder
from controller.runtime.device import Device, VirtualHand
from controller.runtime.loop import Loop
from controller.sensors import base as sensors
from controller.sensors.base import Sensor
from controller.sensors.virtual import knows
from controller.simulator.hand import DISTRACTORS
from controller.teach import TeachError, dataset_folder, protocols
from controller.teach.progress import ExampleCounts, ProgressLog

_TICK_S: Final = 1e-9  # waiting is never quite exact, and always goes on

_log = logging.getLogger("controller")


@dataclass(frozen=True)
class TeachPlan:
    """Checked settings of all sessions of one run of the program."""

    options: argparse.Namespace  # as the user gave them
    vocabulary: Vocabulary  # what is taught
    repetitions: int  # examples of each gesture, or of each place
    model: Bundle  # the present model
    recognizer: Recognizer  # its networks


@dataclass
class Session:
    """One session, before its first frame."""

    lesson: TeachPlan  # what it belongs to
    user: str  # the user who teaches; "" if unknown
    sensor: Sensor  # at its first frame
    model: Bundle | None  # the present model, where it fits this sensor
    runs: RunFiles  # where its recording goes
    key: int  # a number that no other session of this folder has
    asks: list[ExampleRequest]  # the examples, in order
    tally: ExampleCounts  # how many there are


def prepare(options: argparse.Namespace, vocabulary: Vocabulary | None = None) -> TeachPlan:
    """Check what needs no sensor, and lay the vocabulary (the folder's if None) into the folder.

    Raises:
        TeachError, BundleError, VocabularyError, SensorError: It cannot be taught like this.
    """
    vocabulary = vocabulary or dataset_folder.vocabulary(options.out, options.labels)
    if sensors.options(options.sensor).simulated:
        for label in vocabulary.labels[1:]:
            if not knows(vocabulary.files, label):
                raise TeachError(
                    f'the virtual orb\'s hand cannot do {label!r}; write file = "{label}.toml" '
                    "to it (docs/gestures.md)"
                )
    elif options.speed != 1.0:
        raise TeachError("--speed is for --sensor virtual; a real sensor has its own time")
    model = bundles.read(options.bundle or bundles.default_path(options.rate))
    lesson = TeachPlan(
        options,
        dataset_folder.lay(options.out, vocabulary),
        options.repetitions or protocols.REPETITIONS[options.protocol],
        model,
        Recognizer(model),
    )
    _asks(lesson, (2, 2), np.random.default_rng(0))  # what can never be asked is told first
    return lesson


def begin(lesson: TeachPlan, user: str) -> Session:
    """Open the sensor for a session of a user.

    Raises:
        SensorError: It cannot be used.
        TeachError: It does not fit the model that was named.
        RecordingError: Nothing can be recorded there.
    """
    options = lesson.options
    runs = RunFiles(options.out, user, options.session)
    name = runs.next().stem
    sensor = sensors.load(
        options.sensor, options.rate or (lesson.model.rate_hz if options.bundle else None),
        seed=options.seed, preset=options.preset, fault=tuple(options.fault),
        gestures=lesson.vocabulary.files, user=user, day=name, wiring=options.wiring,
    )  # fmt: skip
    key = zlib.crc32(name.encode())
    grid = sensor.geometry
    asks = _asks(lesson, (grid.rows, grid.columns), np.random.default_rng([options.seed, key]))
    model = _fitting(lesson, sensor)
    wanted = Counter(ask.label for ask in asks)
    labels = lesson.vocabulary.labels
    ordered = {name: wanted[name] for name in (*labels[1:], labels[NULL]) if name in wanted}
    before = _before(options.out)
    tally = ExampleCounts(ordered, before, model.labels if model is not None else ())
    return Session(lesson, user, sensor, model, runs, key, asks, tally)


def run(session: Session, stopped: Callable[[], bool]) -> list[Path]:
    """Run a session; return the recordings. SensorError or RecordingError if it breaks off."""
    options, sensor, vocabulary = session.lesson.options, session.sensor, session.lesson.vocabulary
    pipeline = _pipeline(session)
    pace = protocols.PACES[options.protocol]
    rng = np.random.default_rng([options.seed, session.key, 1])
    cues = CueSession(session.asks, pace, rng)
    made: list[Path] = []

    def record(state: dict[str, np.ndarray]) -> Recorder:
        model, engine = session.model, session.lesson.recognizer.engine
        origin = provenance(
            sensor, vocabulary.labels, "" if model is None else model.hash, engine,
            session.user, options.session, options.protocol,
        )  # fmt: skip
        recorder = session.runs.begin(lambda path: Recorder(path, origin, state))
        made.append(recorder.path)
        return recorder

    tape = SessionRecorder(
        record,
        pipeline,
        Labeller(vocabulary.labels, cues=cues),
        display=ProgressLog(session.tally, say, None if sensor.virtual else vocabulary),
    )
    obey = None
    if sensor.virtual:
        seed = options.seed * 2**32 + session.key
        obey = CuedHand(sensor.geometry, seed, vocabulary.files, DISTRACTORS).obey
    alone = OfflineLink(options.speed)
    device = Device(sensor, pipeline, alone, recorder=tape, hand=VirtualHand(respond=obey))
    loop = Loop(alone, lambda: device, alone.now_s)
    loop.run(stopped)
    if loop.missed:
        _log.info("missed %s; is the machine too busy?", count(loop.missed, "frame"))
    return [path for path in made if path.exists()]


def _asks(
    lesson: TeachPlan, grid: tuple[int, int], rng: np.random.Generator
) -> list[ExampleRequest]:
    options = lesson.options
    return protocols.asks(options.protocol, lesson.vocabulary, grid, lesson.repetitions, rng)


def _fitting(lesson: TeachPlan, sensor: Sensor) -> Bundle | None:
    """Return the present model if it is for such a sensor; one that was named must be."""
    model, grid = lesson.model, sensor.geometry
    if (model.rows, model.columns) != (grid.rows, grid.columns):
        why = (
            f"is for {model.rows}×{model.columns} taxels, the sensor has {grid.rows}×{grid.columns}"
        )
    elif not same_rate(sensor.rate_hz, model.rate_hz):
        why = f"is for {model.rate_hz:g} Hz, the sensor has {sensor.rate_hz:g} Hz"
    else:
        return model
    if lesson.options.bundle is not None:
        raise TeachError(f"{lesson.options.bundle} {why}; leave out --bundle")
    return None


def _before(out: Path) -> dict[str, int]:
    """Return how many examples of each label the folder has."""
    counts: dict[str, int] = {}
    for one in dataset_folder.taken(out):
        for label, number in one.examples.items():
            counts[label] = counts.get(label, 0) + number
    return counts


def _pipeline(session: Session) -> Pipeline:
    """Return a pipeline before its first frame; without a model it only finds touches."""
    model = session.model
    if model is not None:
        mapping, recognizer = model.mapping, session.lesson.recognizer
        return Pipeline(model.settings, recognizer, mapping, signal=session.sensor.signal)
    sensor, labels = session.sensor, session.lesson.vocabulary.labels
    preprocess = PreprocessSettings(rate_hz=sensor.rate_hz, window=max(1, round(sensor.rate_hz)))
    grid = sensor.geometry
    settings = PipelineSettings(labels, grid.rows, grid.columns, preprocess, DebounceSettings())
    return Pipeline(settings, _NullModel(len(labels)), Mapping(), signal=sensor.signal)


def say(line: str) -> None:
    """Print a message: to standard error, because results go to standard output."""
    print(line, file=sys.stderr, flush=True)


class OfflineLink(Link):
    """A link without a host, and the clock of its `wait`."""

    connected = False
    dropped = 0

    def __init__(self, speed: float) -> None:
        """Begin; `speed` is how many times as fast as real time, 0: only waiting moves time."""
        self._speed, self._now_s = speed, 0.0
        self._start_s = time.monotonic()

    def now_s(self) -> float:
        """Return the session's time, seconds."""
        return (time.monotonic() - self._start_s) * self._speed if self._speed else self._now_s

    def send(self, message: Message, t_ms: int) -> None:
        """Drop the message."""

    def close(self) -> None:
        """Nothing is open."""

    def wait(self, timeout_s: float) -> None:
        """Let so much of the session's time pass."""
        if self._speed:
            time.sleep(timeout_s / self._speed)
        else:
            self._now_s += timeout_s + _TICK_S


class _NullModel(Networks):
    """Networks that recognise nothing, for a sensor without a model."""

    def __init__(self, labels: int) -> None:
        self._nothing = np.zeros(labels, dtype=np.float32)
        self._nothing[NULL] = 1.0

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        """Return "null" for certain, (classes,)."""
        return self._nothing
