"""One teaching session: cues, the recording of what they ask for, and counts."""

import logging
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles.inference.networks import NoGestures
from controller.bundles.vocabulary import Vocabulary
from controller.capture.labels import Labeller
from controller.capture.session_recorder import RunFiles, SessionRecorder, provenance
from controller.links.base import KeyLink
from controller.recognition.debounce import DebounceSettings
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Pipeline, PipelineSettings
from controller.recordings.recorder import Recorder
from controller.runtime.device import Device, VirtualHand
from controller.runtime.loop import Loop, hurry
from controller.sensors import base as sensors
from controller.sensors.base import Sensor
from controller.sensors.geometry import Geometry
from controller.sensors.virtual import knows, place
from controller.shared.aliases import Say, State
from controller.shared.cues import NULL_LABEL, Cue, CueSession, CueTiming, ExampleRequest, Phase
from controller.shared.errors import UserError, count
from controller.shared.protocol.messages import Message, Perform
from controller.simulator.hand.gesture_file import load
from controller.simulator.hand.performance import BRIEF

GESTURES: Final = "gestures"  # every gesture, and touches that are none, in any order
LOCATIONS: Final = "locations"  # gestures whose place counts, on every site and between them
FEW: Final = "few"  # some examples of one gesture, to be learned at once: `controller teach --add`
MAX_EXAMPLES: Final = 10_000  # about ten hours
MOST_SITES: Final = 100  # of a session; of a larger grid so many are drawn
NOTHING: Final = "touch it, but make none of the gestures"  # what the cue says of "null"
PACES: Final = {
    # In play gestures follow each other quickly: a network that only ever saw them alone misses
    # them there. A place is found more slowly than it is pressed.
    GESTURES: CueTiming(get_ready_s=0.5, go_s=2.5, rest_s=0.4, jitter_s=1.6, still_s=0.4),
    LOCATIONS: CueTiming(get_ready_s=1.2, go_s=2.0, rest_s=0.5, jitter_s=0.5, still_s=0.4),
    # Few examples shall be done with care, and what was before each is learned too.
    FEW: CueTiming(get_ready_s=1.5, go_s=3.0, rest_s=1.0, jitter_s=0.5, still_s=0.6),
}
_REACTION_S: Final = (0.2, 0.6)  # from a cue to the simulated hand's first movement

_log = logging.getLogger("controller")


@dataclass(frozen=True, slots=True)
class SessionPlan:
    """One session: the sensor, what is taught, and where the recording goes."""

    sensor: str  # NAME:KEY=VALUE,...
    out: Path  # folder of the recording
    user: str  # the person who teaches; "" unknown
    session: str  # name of the session
    vocabulary: Vocabulary  # what is taught
    protocol: str  # `GESTURES`, `LOCATIONS` or `FEW`
    repetitions: int  # examples of each gesture, or of each place
    rate_hz: float | None = None  # frames per second; None: the sensor's own


def requests(
    plan: SessionPlan, grid: tuple[int, int], rng: np.random.Generator
) -> list[ExampleRequest]:
    """Return the examples of a session on a grid = (rows, columns), in an order that `rng` draws.

    Raises:
        UserError: No gesture has a place, or there are too many examples.
    """
    labels = plan.vocabulary.labels[1:]
    if plan.protocol == LOCATIONS:
        if not plan.vocabulary.located:
            raise UserError(
                f"no gesture of {plan.vocabulary.name!r} has a place; write located = true to one"
            )
        places = sites(*grid, rng)
        once = [
            ExampleRequest(label, place) for label in plan.vocabulary.located for place in places
        ]
    else:
        others = () if plan.protocol == FEW else (NULL_LABEL,)
        once = [ExampleRequest(label) for label in (*labels, *others)]
    total = len(once) * plan.repetitions
    if total > MAX_EXAMPLES:
        raise UserError(
            f"{total} examples are more than {MAX_EXAMPLES}; choose fewer --repetitions"
        )
    # In rounds: after an early stop each has been asked for as often.
    return [once[i] for _ in range(plan.repetitions) for i in rng.permutation(len(once))]


def sites(rows: int, columns: int, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Return where to touch, grid units: on taxels and between four; at most `MOST_SITES`."""
    places = [(float(x), float(y)) for y in range(rows) for x in range(columns)]
    places += [(x + 0.5, y + 0.5) for y in range(rows - 1) for x in range(columns - 1)]
    most = min(len(places), MOST_SITES)
    return [places[i] for i in sorted(rng.choice(len(places), most, replace=False))]


def run(plan: SessionPlan, stopped: Callable[[], bool], say: Say) -> list[Path]:
    """Run a session until its end or `stopped`; return the recordings.

    Raises:
        SensorError, RecordingError: The sensor cannot be used, or nothing can be recorded.
        UserError: It cannot be taught like this.
    """
    _check_hand(plan)
    runs = RunFiles(plan.out, plan.user, plan.session)
    name = runs.next().stem
    number = name.rpartition("-")[2]
    day = plan.session if number == "01" else f"{plan.session}-{number}"  # of the simulated hand
    sensor = sensors.load(
        plan.sensor,
        plan.rate_hz,
        gestures=plan.vocabulary.files,
        user=plan.user,
        day=day,
    )
    seeds = [sensor.seed or 0, zlib.crc32(name.encode())]  # another for each recording
    grid = (sensor.geometry.rows, sensor.geometry.columns)
    asks = requests(plan, grid, np.random.default_rng(seeds))
    cues = CueSession(asks, PACES[plan.protocol], np.random.default_rng([*seeds, 1]))
    made = _record(plan, sensor, cues, runs, seeds[0] * 2**32 + seeds[1], stopped, say)
    missing = cues.at(0.0).more
    for label in plan.vocabulary.labels:
        if wanted := sum(ask.label == label for ask in asks):
            say(f"  {label}: {count(wanted - missing[label], 'example')}")
    return made


def _record(
    plan: SessionPlan,
    sensor: Sensor,
    cues: CueSession,
    runs: RunFiles,
    hand_seed: int,
    stopped: Callable[[], bool],
    say: Say,
) -> list[Path]:
    """Record a session of cues; return its files."""
    labels = plan.vocabulary.labels
    origin = provenance(sensor, labels, "", "", plan.user, plan.session, plan.protocol)
    made: list[Path] = []

    def record(state: State) -> Recorder:
        recorder = runs.begin(lambda path: Recorder(path, origin, state))
        made.append(recorder.path)
        return recorder

    said = {NULL_LABEL: NOTHING, **{one.label: one.say for one in plan.vocabulary.entries}}
    pipeline = _pipeline(sensor, labels)
    tape = SessionRecorder(
        record,
        pipeline,
        Labeller(labels, cues=cues),
        say=None if sensor.virtual else say,
        words=said,
    )
    obey = None
    if sensor.virtual:
        obey = CuedHand(sensor.geometry, hand_seed, plan.vocabulary.files).obey
    alone = _NoLink()
    device = Device(sensor, pipeline, alone, recorder=tape, hand=VirtualHand(respond=obey))
    if sensor.virtual:
        hurry(device, stopped)
    else:
        loop = Loop(alone, lambda: device, time.monotonic)
        loop.run(stopped)
        if loop.missed:
            _log.info("missed %s; is the machine too busy?", count(loop.missed, "frame"))
    return [path for path in made if path.exists()]


def _check_hand(plan: SessionPlan) -> None:
    """Raise UserError if the sensor's own hand cannot do a gesture."""
    if not sensors.options(plan.sensor).simulated:
        return
    for label in plan.vocabulary.labels[1:]:
        if not knows(plan.vocabulary.files, label):
            raise UserError(
                f'the virtual orb\'s hand cannot do {label!r}; write file = "{label}.toml" to it '
                "(orbtouch docs gestures)"
            )


def _pipeline(sensor: Sensor, labels: Sequence[str]) -> Pipeline:
    """Return a pipeline that only finds touches, before its first frame."""
    preprocess = PreprocessSettings(rate_hz=sensor.rate_hz, window=max(1, round(sensor.rate_hz)))
    grid = sensor.geometry
    settings = PipelineSettings(
        tuple(labels), grid.rows, grid.columns, preprocess, DebounceSettings()
    )
    return Pipeline(settings, NoGestures(len(labels)), Mapping(), signal=sensor.signal)


class CuedHand:
    """A simulated hand that follows cues with a reaction time, for sessions without a user."""

    def __init__(self, geometry: Geometry, seed: int, gestures: Sequence[Path] = ()) -> None:
        """Prepare a hand with files of gestures, besides the shipped ones."""
        self._rng = np.random.default_rng([seed, 1])
        self._geometry, self._repertoire = geometry, load(gestures)
        self._number = 0

    def obey(self, cue: Cue, t_s: float) -> tuple[float, Perform] | None:
        """Return time and gesture of the hand for a cue that changed at `t_s`; None: it rests."""
        if cue.phase is not Phase.GO:
            return None
        label = cue.label
        if label == NULL_LABEL:
            label = str(self._rng.choice(BRIEF))
        at = cue.place or place(label, self._geometry, self._repertoire, self._rng)
        self._number += 1
        at_s = t_s + float(self._rng.uniform(*_REACTION_S))
        return at_s, Perform(self._number, label, *at)


class _NoLink(KeyLink):
    """A link on which no host ever comes."""

    def send(self, message: Message, t_ms: int) -> None:
        """Drop the message."""

    def close(self) -> None:
        """Nothing is open."""
