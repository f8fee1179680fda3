"""One session of teaching: its parts, each checked before anything runs, and the run itself."""

import argparse
import logging
import sys
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.bundles.vocabulary import Vocabulary
from controller.capture.cue_plan import ExampleRequest
from controller.capture.cues import CueSession
from controller.capture.labels import Labeller
from controller.capture.run_files import RunFiles
from controller.capture.session_recorder import SessionRecorder
from controller.capture.simulated_hand import CuedHand
from controller.capture.status_line import Display
from controller.errors import count
from controller.keymap.terminal import Keyboard
from controller.recognition.debounce import NULL
from controller.recognition.pipeline import Pipeline
from controller.recordings.recorder import Recorder
from controller.recordings.recording import RATE_TOLERANCE, Provenance, software
from controller.runtime.device import Device, VirtualHand
from controller.runtime.loop import Loop
from controller.sensors import base as sensors
from controller.sensors.base import Sensor
from controller.sensors.virtual import knows
from controller.simulator.hand import DISTRACTORS
from controller.teach import TeachError, dataset_folder, null_model, protocols
from controller.teach.example_counts import ExampleCounts
from controller.teach.offline_link import OfflineLink
from controller.teach.progress import ProgressDisplay, ProgressLog, ProgressPage, drawable

_log = logging.getLogger("controller")


@dataclass(frozen=True)
class TeachPlan:
    """Checked settings of all sessions of one run of the program.

    Attributes:
        options: As the user gave them.
        vocabulary: What is taught.
        repetitions: Examples of each gesture, or of each place.
        model: The present model.
        recognizer: Its networks.
    """

    options: argparse.Namespace
    vocabulary: Vocabulary
    repetitions: int
    model: Bundle
    recognizer: Recognizer


@dataclass
class Session:
    """One session, before its first frame.

    Attributes:
        lesson: What it belongs to.
        user: The user who teaches; "" if unknown.
        sensor: At its first frame.
        model: The present model, where it fits this sensor.
        runs: Where its recording goes.
        key: A number that no other session of this folder has.
        asks: The examples, in order.
        tally: How many there are.
    """

    lesson: TeachPlan
    user: str
    sensor: Sensor
    model: Bundle | None
    runs: RunFiles
    key: int
    asks: list[ExampleRequest]
    tally: ExampleCounts


def prepare(options: argparse.Namespace, vocabulary: Vocabulary | None = None) -> TeachPlan:
    """Check what needs no sensor, and lay the vocabulary into the folder.

    Args:
        options: As the user gave them.
        vocabulary: What is taught; by default the named one, or the folder's.

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
    model = bundles.read(options.bundle or bundles.default_path())
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
        options.sensor, options.rate,
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


def run(session: Session, keyboard: Keyboard | None, stopped: Callable[[], bool]) -> list[Path]:
    """Run a session; return the recordings.

    Raises:
        SensorError: The sensor fails.
        RecordingError: A recording cannot be written where it should be.
    """
    options, sensor, vocabulary = session.lesson.options, session.sensor, session.lesson.vocabulary
    pipeline = _pipeline(session)
    pace = protocols.PACES[options.protocol]
    rng = np.random.default_rng([options.seed, session.key, 1])
    cues = CueSession(session.asks, pace, rng)
    made: list[Path] = []

    def record(state: dict[str, np.ndarray]) -> Recorder:
        origin = _origin(session)
        recorder = session.runs.begin(lambda path: Recorder(path, origin, state))
        made.append(recorder.path)
        return recorder

    tape = SessionRecorder(
        record,
        pipeline,
        Labeller(vocabulary.labels, cues=cues),
        keyboard=keyboard,
        display=_screen(session, keyboard),
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
    elif abs(sensor.rate_hz / model.rate_hz - 1.0) > RATE_TOLERANCE:
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
        return Pipeline(model.settings, session.lesson.recognizer, model.mapping)
    sensor, labels = session.sensor, session.lesson.vocabulary.labels
    return null_model.pipeline(labels, sensor.geometry, sensor.rate_hz)


def _screen(session: Session, keyboard: Keyboard | None) -> Display:
    """Return the display of a session."""
    options, tally, grid = session.lesson.options, session.tally, session.sensor.geometry
    pace = protocols.PACES[options.protocol]
    encoding = (getattr(sys.stderr, "encoding", "") or "").lower()
    page = ProgressPage(
        session.lesson.vocabulary,
        tally,
        (grid.rows, grid.columns),
        model=tally.model,
        example_s=pace.get_ready_s + protocols.GO_S + pace.rest_s + pace.jitter_s / 2.0,
        keyboard=keyboard is not None,
        plain=not encoding.startswith("utf"),
    )
    if drawable(sys.stderr):
        return ProgressDisplay(sys.stderr, page, tally, bell=options.bell)
    return ProgressLog(tally, say)


def say(line: str) -> None:
    """Print a message: to standard error, because results go to standard output."""
    print(line, file=sys.stderr, flush=True)


def _origin(session: Session) -> Provenance:
    """Return the provenance of a recording that begins now."""
    sensor, options, model = session.sensor, session.lesson.options, session.model
    return Provenance(
        device_id=sensor.device_id,
        rows=sensor.geometry.rows,
        columns=sensor.geometry.columns,
        pitch_mm=sensor.geometry.pitch_mm,
        rate_hz=sensor.rate_hz,
        labels=session.lesson.vocabulary.labels,
        bundle=model.hash if model is not None else "",
        engine=session.lesson.recognizer.engine,
        software=software(),
        user=session.user,
        session=options.session,
        protocol=options.protocol,
        preset=sensor.preset,
        seed=sensor.seed,
        started=datetime.now(UTC).isoformat(timespec="milliseconds"),
        hardware=sensor.hardware,
    )
