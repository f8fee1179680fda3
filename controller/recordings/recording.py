"""A recording: every frame of a session with its time, its labels, and what was made of it.

It holds what a replay needs to give the same commands again: the frames as they were read, the
bundle's hash, the engine, and what the pipeline remembered before the first frame. What people
said of the frames is kept apart by who said it: `label` is what is held for true, `button`, `key`
and `cue` are what the label button, the keyboard and the cues said at the time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from controller import __version__
from controller.errors import UserError
from controller.recognition.pipeline import CommandRecord, PipelineSettings
from controller.recognition.preprocess import State

if TYPE_CHECKING:
    from controller.recognition.event_metric import Event

SCHEMA: Final = 3  # of the arrays and of meta: docs/recording.md
PICOFARAD: Final = "pF"


UNKNOWN: Final = -1  # a label that nobody gave
RATE_TOLERANCE: Final = 0.02  # farther apart than this, a window is no longer the network's second


class RecordingError(UserError, ValueError):
    """The recording cannot be read, used or written; the message says why, in one sentence."""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a recording comes from.

    Attributes:
        device_id: The sensor's serial number.
        rows: Taxel rows.
        columns: Taxel columns.
        pitch_mm: Distance of two taxels.
        rate_hz: Frames per second, as intended.
        labels: What the label columns count, "null" first.
        bundle: Hash of the bundle that gave the commands.
        engine: What ran its networks.
        software: Version of this program.
        user: Who touched it; "" unknown.
        session: Which of the user's sessions.
        protocol: What they were asked to do.
        preset: Quality of a simulated orb.
        seed: Of the simulation; None where nothing is simulated.
        id: Drawn once for each recording, so that copies are known; "" where nobody drew one.
        started: When its time was 0, UTC as ISO 8601; "" unknown.
        hardware: What kind of sensor it is, for people.
        unit: Of the frames; "pF" is capacitance, anything else is a sensor's own.
        schema: Version of the file's form.
    """

    device_id: str
    rows: int
    columns: int
    pitch_mm: float
    rate_hz: float
    labels: tuple[str, ...]
    bundle: str
    engine: str
    software: str
    user: str = ""
    session: str = ""
    protocol: str = ""
    preset: str = ""
    seed: int | None = None
    id: str = ""
    started: str = ""
    hardware: str = ""
    unit: str = PICOFARAD
    schema: int = SCHEMA


@dataclass(frozen=True, slots=True)
class Mark:
    """Something that happened at a time: a cue, a key, a pause, a lost sensor.

    Attributes:
        t_s: When, seconds of the recording.
        kind: What sort of thing, one word.
        text: Which.
    """

    t_s: float
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class SimulatedTruth:
    """What a simulation knows beside every frame.

    Attributes:
        touch: Where a press is, grid units, NaN elsewhere, (n, 2).
        contact: Every finger: x, y in grid units, depth in mm, NaN elsewhere, (n, fingers, 3).
        events: Gestures, and touches that were none, in order.
    """

    touch: NDArray[np.float32]
    contact: NDArray[np.float32]
    events: tuple[Event, ...]


@dataclass(frozen=True, slots=True)
class Recording:
    """A whole recording of n frames.

    Attributes:
        origin: Where it comes from.
        frames: As they were read, (n, rows, columns), in the origin's unit.
        t: End of each scan, monotonic seconds since the session began, (n,).
        sequence: Number of each frame; a missing number is a missed frame, (n,).
        label: What truly happened, as far as known: index into the labels, -1 unknown, (n,).
        button: What the label button said, likewise.
        key: What a key of the keyboard said, likewise.
        cue: What the cue asked for, likewise.
        excluded: Frames that nobody shall learn from: paused, or dropped afterwards, (n,).
        touch: The touch as recognised, grid units, NaN none, (n, 2).
        rest: The untouched sensor as first found, (rows, columns); None if it never was.
        marks: What happened beside the frames, in order of time.
        commands: What was recognised.
        state: The pipeline before the first frame.
        truth: What a simulation knows; None for a recording of the world.
    """

    origin: Provenance
    frames: NDArray[np.float32]
    t: NDArray[np.float64]
    sequence: NDArray[np.int64]
    label: NDArray[np.int16]
    button: NDArray[np.int16]
    key: NDArray[np.int16]
    cue: NDArray[np.int16]
    excluded: NDArray[np.bool_]
    touch: NDArray[np.float64]
    rest: NDArray[np.float32] | None = None
    marks: tuple[Mark, ...] = ()
    commands: tuple[CommandRecord, ...] = ()
    state: State = field(default_factory=dict)
    truth: SimulatedTruth | None = None

    @property
    def rate_hz(self) -> float:
        """Frames per second as measured: the median, which missed frames do not move."""
        if len(self.t) < 2:
            return self.origin.rate_hz
        return 1.0 / float(np.median(np.diff(self.t)))


def unlabelled(count: int) -> dict[str, NDArray[np.int16]]:
    """Return the label columns of `count` frames of which nobody has said anything."""
    return {name: np.full(count, UNKNOWN, dtype=np.int16) for name in LABELLERS}


LABELLERS: Final = ("label", "button", "key", "cue")


def refuse_misfit(recording: Recording, bundle: PipelineSettings) -> None:
    """Refuse a recording that the bundle's networks would misunderstand.

    Raises:
        RecordingError: Sensor, unit or rate differ; 2 % of rate are allowed.
    """
    shape, expected = recording.frames.shape[1:], (bundle.rows, bundle.columns)
    if shape != expected:
        raise RecordingError(
            f"the recording is of a {shape[0]}×{shape[1]} sensor, the bundle for "
            f"{expected[0]}×{expected[1]}; choose another with --bundle"
        )
    if abs(recording.rate_hz / bundle.rate_hz - 1.0) > RATE_TOLERANCE:
        raise RecordingError(
            f"the recording runs at {recording.rate_hz:.2f} Hz, the bundle at "
            f"{bundle.rate_hz:.2f} Hz, more than 2 % apart; choose another with --bundle"
        )
    if recording.origin.unit != PICOFARAD:
        raise RecordingError(
            f"the recording is in {recording.origin.unit}, the bundle wants {PICOFARAD}; "
            "choose another with --bundle"
        )


def software() -> str:
    """Return the version of this program."""
    return __version__
