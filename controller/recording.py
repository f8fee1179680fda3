"""A recording: every frame of a session with its time, and what was made of it, in one `.npz`.

It holds what a replay needs to give the same commands again: the frames as they were read, the
bundle's hash, the engine, and what the pipeline remembered before the first frame.
`controller/recorder.py` writes it.

Arrays: `frames` float32 (n, rows, columns) pF; `t` float64 (n,) seconds, the end of each scan;
`sequence` int64 (n,), the frame's number; `label` int16 (n,), index into the labels, -1 unknown;
`button` int16 (n,), the labelling button, -1 none; `touch` float64 (n, 2), the touch as
recognised, NaN none; `command_*` (m,), a column each of the commands given; `state.*`, the
pipeline before the first frame; `meta`, a JSON text (`Origin`).

A simulated session knows the truth as well (`Truth`): `true_touch` float32 (n, 2), where a press
is; `true_contact` float32 (n, fingers, 3), every finger's x, y and depth, NaN where it does not
touch; `event_onset` and `event_release` float64 (k,) seconds, `event_name` text (k,), every true
gesture and every touch that was none.
"""

import json
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.bundle import Bundle
from controller.events import Event
from controller.pipeline import CommandRecord, Touch
from controller.preprocess import State

SCHEMA = 2  # of the arrays and of meta
READABLE: Final = (1, SCHEMA)  # form 1 had no truth and did not say who played
MAX_BYTES = 512 << 20  # of a file and of what it unpacks to: about four days at 10 Hz
RATE_TOLERANCE = 0.02  # farther apart than this, a window is no longer the network's second
MIN_PF, MAX_PF = 1e-3, 1e6  # what can be a taxel: paper, section 3.2: 41 pF
UNKNOWN = -1  # label or button

STATE = "state."  # begins the names of the pipeline's arrays
NUMBERS = {"t": np.float64, "sequence": np.int64, "label": np.int16, "button": np.int16}


class RecordingError(ValueError):
    """The recording cannot be read, used or written; the message says why, in one sentence."""


@dataclass(frozen=True)
class Origin:
    """Where a recording comes from.

    Attributes:
        device_id: The sensor's serial number.
        rows: Taxel rows.
        columns: Taxel columns.
        pitch_mm: Distance of two taxels.
        rate_hz: Frames per second, as intended.
        labels: What `Recording.label` counts, "null" first.
        bundle: Hash of the bundle that gave the commands.
        engine: What ran its networks.
        software: Version of this program.
        user: Who touched it; "" unknown.
        session: Which of the user's sessions.
        protocol: What they were asked to do.
        preset: Quality of a simulated orb.
        seed: Of the simulation; None where nothing is simulated.
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
    schema: int = SCHEMA


@dataclass(frozen=True)
class Truth:
    """What a simulation knows beside every frame; the arrays are described at the top.

    Attributes:
        touch: Where a press is, grid units, NaN elsewhere, (n, 2).
        contact: Every finger: x, y in grid units, depth in mm, NaN elsewhere, (n, fingers, 3).
        events: Gestures, and touches that were none, in order.
    """

    touch: NDArray[np.float32]
    contact: NDArray[np.float32]
    events: tuple[Event, ...]


@dataclass(frozen=True)
class Recording:
    """A whole recording; the arrays are described at the top of this file."""

    origin: Origin
    frames: NDArray[np.float32]
    t: NDArray[np.float64]
    sequence: NDArray[np.int64]
    label: NDArray[np.int16]
    button: NDArray[np.int16]
    touch: NDArray[np.float64]
    commands: tuple[CommandRecord, ...] = ()
    state: State = field(default_factory=dict)
    truth: Truth | None = None

    @property
    def rate_hz(self) -> float:
        """Frames per second as measured: the median, which missed frames do not move."""
        if len(self.t) < 2:
            return self.origin.rate_hz
        return 1.0 / float(np.median(np.diff(self.t)))


def check(recording: Recording, bundle: Bundle) -> None:
    """Refuse a recording that the bundle's networks would misunderstand.

    Raises:
        RecordingError: Sensor or rate differ; 2 % of rate are allowed.
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


def software() -> str:
    """Return the version of this program."""
    try:
        return version("orbtouch")
    except PackageNotFoundError:  # run from a source tree that is not installed
        return "unknown"


def load(path: Path) -> Recording:
    """Return the recording in a file, every array checked.

    Raises:
        RecordingError: There is none, it is damaged, or it is no recording.
    """
    try:
        if not path.exists():
            raise RecordingError("does not exist")
        if not path.is_file():
            raise RecordingError("is not a file")
        return _parse(npz.unpack(path, MAX_BYTES))
    except OSError as error:
        problem = f"cannot be read: {error.strerror or error}"
    except ValueError as error:  # NpzError and RecordingError
        problem = str(error)
    raise RecordingError(f"the recording {path} {problem}; name a file made with --record")


def _parse(arrays: npz.Arrays) -> Recording:
    """Return the recording that these arrays make."""
    origin = _origin(arrays.get("meta"))
    frames = _array(arrays, "frames", np.float32, (-1, origin.rows, origin.columns))
    count = len(frames)
    if not count:
        raise RecordingError("holds no frames")
    if not ((frames > MIN_PF) & (frames < MAX_PF)).all():  # NaN is refused as well
        raise RecordingError(f"holds frames that are not all within {MIN_PF:g} and {MAX_PF:g} pF")
    columns = {name: _array(arrays, name, kind, (count,)) for name, kind in NUMBERS.items()}
    for name in ("t", "sequence"):
        if not np.isfinite(columns[name]).all() or not (np.diff(columns[name]) > 0).all():
            raise RecordingError(f"holds {name!r} that does not rise from frame to frame")
    for name in ("label", "button"):
        if not ((columns[name] >= UNKNOWN) & (columns[name] < len(origin.labels))).all():
            raise RecordingError(f"holds a {name} that it does not name")
    state = {
        name.removeprefix(STATE): array for name, array in arrays.items() if name.startswith(STATE)
    }
    if any(array.dtype != np.float64 or not np.isfinite(array).all() for array in state.values()):
        raise RecordingError("holds a state that is not all finite numbers")
    touch = _array(arrays, "touch", np.float64, (count, 2))
    return Recording(
        origin,
        frames,
        touch=touch,
        commands=_commands(arrays),
        state=state,
        truth=_truth(arrays, count),
        **columns,
    )


def _origin(meta: NDArray[Any] | None) -> Origin:
    """Return what meta says, checked."""
    if meta is None or meta.shape != () or meta.dtype.kind != "U":
        raise RecordingError("is no recording of OrbTouch")
    try:
        fields = json.loads(meta.item())
        if fields.get("schema") not in READABLE:
            raise RecordingError(
                f"has form {fields.get('schema')!r}, this program reads "
                f"{' and '.join(map(str, READABLE))} (update one)"
            )
        origin = Origin(**{**fields, "labels": tuple(fields["labels"])})
    except RecordingError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise RecordingError("says nothing legible about its origin") from None
    texts = (
        *(origin.device_id, origin.bundle, origin.engine, origin.software, *origin.labels),
        *(origin.user, origin.session, origin.protocol, origin.preset),
    )
    sizes = (origin.rows, origin.columns)
    scales = (origin.pitch_mm, origin.rate_hz)
    if not (
        all(isinstance(text, str) for text in texts)
        and all(type(size) is int and size > 0 for size in sizes)
        and all(type(scale) in (int, float) and 0.0 < scale < 1e6 for scale in scales)
        and (origin.seed is None or (type(origin.seed) is int and origin.seed >= 0))
    ):
        raise RecordingError("says impossible things about its origin")
    return origin


def _array(arrays: npz.Arrays, name: str, kind: type, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return one array, of exactly this type and shape; -1 is any length."""
    array = arrays.get(name)
    if array is None:
        raise RecordingError(f"has no {name!r}")
    same = array.ndim == len(shape) and all(
        wanted in (-1, size) for size, wanted in zip(array.shape, shape, strict=True)
    )
    if array.dtype != kind or not same:
        wanted = ", ".join("n" if size < 0 else str(size) for size in shape)
        raise RecordingError(
            f"has {name!r} as {array.dtype} {array.shape}, not {np.dtype(kind)} ({wanted})"
        )
    return array


def _commands(arrays: npz.Arrays) -> tuple[CommandRecord, ...]:
    """Return the table of commands, row by row."""
    t = _array(arrays, "command_t", np.float64, (-1,))
    rows = (len(t),)
    frame = _array(arrays, "command_frame", np.int64, rows)
    probability = _array(arrays, "command_probability", np.float64, rows)
    touch = _array(arrays, "command_touch", np.float64, (*rows, 2))
    texts = [arrays.get(f"command_{name}") for name in ("gesture", "name")]
    if any(text is None or text.dtype.kind != "U" or text.shape != rows for text in texts):
        raise RecordingError("has a table of commands without their names")
    gesture, name = (text.tolist() for text in texts if text is not None)
    return tuple(
        CommandRecord(
            float(t[i]), int(frame[i]), gesture[i], float(probability[i]), _place(touch[i]), name[i]
        )
        for i in range(len(t))
    )


def _truth(arrays: npz.Arrays, count: int) -> Truth | None:
    """Return what a simulation knew; None for a recording of the world."""
    if "true_touch" not in arrays:
        return None
    touch = _array(arrays, "true_touch", np.float32, (count, 2))
    contact = _array(arrays, "true_contact", np.float32, (count, -1, 3))
    onset = _array(arrays, "event_onset", np.float64, (-1,))
    release = _array(arrays, "event_release", np.float64, onset.shape)
    name = arrays.get("event_name")
    if name is None or name.dtype.kind != "U" or name.shape != onset.shape:
        raise RecordingError("has a table of events without their names")
    table = zip(onset.tolist(), release.tolist(), name.tolist(), strict=True)
    events = tuple(Event(*row) for row in table)
    if not np.isfinite([*onset, *release]).all() or (release < onset).any():
        raise RecordingError("has events that end before they begin")
    return Truth(touch, contact, events)


def _place(touch: NDArray[np.float64]) -> Touch | None:
    return None if np.isnan(touch).any() else (float(touch[0]), float(touch[1]))
