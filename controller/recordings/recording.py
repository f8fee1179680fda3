"""A recording: every frame of a session with its time, its labels and the recognised commands.

It holds the data for an exact replay: the raw frames, the bundle's hash, the engine, and the state
of the pipeline before the first frame. Labels are stored by source: `label` is the known truth,
`button`, `key` and `cue` are the labels of the label button, the keyboard and the cues.
"""

import dataclasses
import json
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller import __version__
from controller.recognition.images.frames import same_rate
from controller.recognition.images.scale import PICOFARAD as PICOFARAD
from controller.recognition.images.scale import Signal
from controller.recognition.pipeline import CommandRecord, PipelineSettings
from controller.shared.aliases import State
from controller.shared.errors import UserError
from controller.shared.event_metric import Event

SCHEMA: Final = 3  # of the arrays and of the provenance: docs/recording.md
# Form 1 had no truth and no user; form 2 had no keys, cues, marks and rest.
LABELLERS: Final = ("label", "button", "key", "cue")
UNKNOWN: Final = -1  # a label that no source gave
OFTEN: Final = 0.95  # quantile of the intervals ...
PAUSE: Final = 2.0  # ... and so many times it is the longest that is no pause

MAX_PROVENANCE: Final = 1 << 20  # characters of its JSON: three times that of the longest labels
TOO_LONG: Final = f"holds too much about its origin; {MAX_PROVENANCE} characters are allowed"
MAX_TEXT: Final = 1000  # characters of any name
MAX_TAXELS: Final = 4096  # 64×64
MAX_LABELS: Final = 256


class RecordingError(UserError, ValueError):
    """The recording cannot be read, used or written; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Provenance of a recording."""

    device_id: str  # the sensor's serial number
    rows: int
    columns: int
    pitch_mm: float  # distance between adjacent taxels
    rate_hz: float  # nominal frames per second
    labels: tuple[str, ...]  # names that the label columns index, "null" first
    bundle: str  # hash of the bundle that recognised the commands
    engine: str  # inference engine that ran its networks
    software: str  # version of this program
    user: str = ""  # ID of the user; "" unknown
    session: str = ""  # ID of the session, unique for the user
    protocol: str = ""  # name of the task
    preset: str = ""  # noise preset of a simulated orb
    seed: int | None = None  # of the simulation; None for a real sensor
    id: str = ""  # random, to recognise copies; "" before form 3
    started: str = ""  # time 0 of the recording, UTC as ISO 8601; "" unknown
    hardware: str = ""  # kind of sensor, as text
    # of the frames; "pF" is capacitance, anything else is specific to the sensor
    unit: str = PICOFARAD
    sign: int = -1  # -1: a touch lowers the frames' values, 1: it raises them
    schema: int = SCHEMA  # version of the file's form

    @property
    def signal(self) -> Signal:
        """What the frames' values are."""
        return Signal(self.unit, self.sign)


@dataclass(frozen=True, slots=True)
class Mark:
    """An event, such as a cue, a key, a pause or a lost sensor, with its time, kind and details."""

    t_s: float
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class SimulatedTruth:
    """Ground truth of a simulated session of n frames."""

    touch: NDArray[np.float32]  # position of a press, grid units, NaN elsewhere, (n, 2)
    # every finger: x, y in grid units, depth in mm, NaN elsewhere, (n, fingers, 3)
    contact: NDArray[np.float32]
    events: tuple[Event, ...]  # gestures and distractors, in order


@dataclass(frozen=True, slots=True)
class Recording:
    """A whole recording of n frames."""

    origin: Provenance
    frames: NDArray[np.float32]  # raw frames, (n, rows, columns), in the origin's unit
    t: NDArray[np.float64]  # end of each scan, monotonic seconds since the session began, (n,)
    sequence: NDArray[np.int64]  # number of each frame; a missing number is a missed frame, (n,)
    label: NDArray[np.int16]  # known truth: index into the labels, -1 unknown, (n,)
    button: NDArray[np.int16]  # label from the label button, -1 unknown, (n,)
    key: NDArray[np.int16]  # label from the keyboard, -1 unknown, (n,)
    cue: NDArray[np.int16]  # label of the cue, -1 unknown, (n,)
    excluded: NDArray[np.bool_]  # frames left out of training: paused, or dropped afterwards, (n,)
    touch: NDArray[np.float64]  # recognised position of the touch, grid units, NaN none, (n, 2)
    # first image of the untouched sensor, (rows, columns); None if it was never found
    rest: NDArray[np.float32] | None = None
    marks: tuple[Mark, ...] = ()  # events, in order of time
    commands: tuple[CommandRecord, ...] = ()
    state: State = field(default_factory=dict)  # state of the pipeline before the first frame
    truth: SimulatedTruth | None = None  # ground truth of a simulation; None for a real sensor

    @property
    def rate_hz(self) -> float:
        """Measured frames per second: frames over time, without pauses."""
        return mean_rate(np.diff(self.t)[np.diff(self.sequence) == 1]) or self.origin.rate_hz


def mean_rate(steps_s: NDArray[np.float64]) -> float:
    """Return the frames per second by the mean interval, (n,) seconds; 0 if there is none.

    A computer's clock may count in 16 ms, and frames may arrive in bursts: the mean is right where
    a median is not. Rare intervals far above all others are pauses.
    """
    if not len(steps_s):
        return 0.0
    usual = steps_s[steps_s <= PAUSE * np.quantile(steps_s, OFTEN)]
    return float(1.0 / usual.mean())


def unlabelled(count: int) -> dict[str, NDArray[np.int16]]:
    """Return the label columns of `count` unlabelled frames, each (count,)."""
    return {name: np.full(count, UNKNOWN, dtype=np.int16) for name in LABELLERS}


def refuse_misfit(recording: Recording, bundle: PipelineSettings) -> None:
    """Raise RecordingError if sensor or rate (by 2 %) are not those of a bundle.

    Any unit fits, as live: `controller.recognition.images.scale` has what a bundle in picofarads
    gets.
    """
    shape, expected = recording.frames.shape[1:], (bundle.rows, bundle.columns)
    if shape != expected:
        raise RecordingError(
            f"the recording is of a {shape[0]}×{shape[1]} sensor, the bundle for "
            f"{expected[0]}×{expected[1]}; choose another with --bundle"
        )
    if not same_rate(recording.rate_hz, bundle.preprocess.rate_hz):
        raise RecordingError(
            f"the recording runs at {recording.rate_hz:.2f} Hz, the bundle at "
            f"{bundle.preprocess.rate_hz:.2f} Hz, more than 2 % apart; choose another with --bundle"
        )


def software() -> str:
    """Return the version of this program."""
    return __version__


def format_provenance(origin: Provenance) -> str:
    """Return a provenance as JSON; without the usual sign, as before there was one."""
    fields = dataclasses.asdict(origin)
    if origin.sign == -1:
        del fields["sign"]
    return json.dumps(fields)


def parse_provenance(text: str) -> Provenance:
    """Return the provenance in an untrusted JSON text; RecordingError if there is none."""
    if len(text) > MAX_PROVENANCE:
        raise RecordingError(TOO_LONG)
    try:
        fields = json.loads(text)
        schema = fields.get("schema")
        if type(schema) is not int or schema != SCHEMA:
            raise RecordingError(
                f"has form {str(schema)[:20]}, this program reads {SCHEMA} (update one)"
            )
        if not isinstance(fields["labels"], list):
            raise TypeError("labels")
        origin = Provenance(**{**fields, "labels": tuple(fields["labels"])})
        possible = _possible(origin)
    except RecordingError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise RecordingError("holds nothing legible about its origin") from None
    if not possible:
        raise RecordingError("holds impossible things about its origin")
    return origin


def _possible(origin: Provenance) -> bool:
    """Return whether every field is of its type and within its limits."""
    texts = (
        *(origin.device_id, origin.bundle, origin.engine, origin.software, *origin.labels),
        *(origin.user, origin.session, origin.protocol, origin.preset),
        *(origin.id, origin.started, origin.hardware, origin.unit),
    )
    sizes = (origin.rows, origin.columns)
    scales = (origin.pitch_mm, origin.rate_hz)
    return (
        all(isinstance(text, str) and len(text) <= MAX_TEXT for text in texts)
        and all(text.isprintable() for text in texts)  # no control sequences for terminals
        and all(type(size) is int and size > 0 for size in sizes)
        and origin.rows * origin.columns <= MAX_TAXELS
        and 0 < len(set(origin.labels)) == len(origin.labels) <= MAX_LABELS
        and all(type(scale) in (int, float) and 0.0 < scale < 1e6 for scale in scales)
        and type(origin.sign) is int
        and origin.sign in (-1, 1)
        and (origin.seed is None or (type(origin.seed) is int and 0 <= origin.seed < 1 << 64))
    )
