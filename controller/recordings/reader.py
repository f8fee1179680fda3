"""Read recordings from files of unknown origin, with every array checked.

`survey` reads the provenance and the length only; `load` reads all.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.pipeline import CommandRecord
from controller.recordings.recording import (
    LABELLERS,
    MAX_PROVENANCE,
    TOO_LONG,
    UNKNOWN,
    Mark,
    Provenance,
    Recording,
    RecordingError,
    SimulatedTruth,
    parse_provenance,
)
from controller.shared import npz
from controller.shared.blocks import blocks
from controller.shared.errors import reason
from controller.shared.event_metric import Event

MAX_BYTES: Final = 512 << 20  # of a file and of what it unpacks to: about four days at 10 Hz
LARGEST: Final = 1e6  # of a frame: a taxel has 41 pF (paper, section 3.2), a count some thousand
MAX_ROWS: Final = 1 << 18  # of each table: a command a second for three days
LATEST_S: Final = 1e9  # thirty years

STATE: Final = "state."  # begins the names of the pipeline's arrays
COLUMNS: Final[dict[str, type]] = {
    "t": np.float64,
    "sequence": np.int64,
    "label": np.int16,
    "button": np.int16,
    "key": np.int16,
    "cue": np.int16,
    "excluded": np.bool_,
}
LARGE: Final = ("frames", "touch", "true_touch", "true_contact")  # hundreds of bytes a frame
TABLES: Final = ("mark_", "command_", "event_")  # begin the names of tables' columns


@dataclass(frozen=True, slots=True)
class Survey:
    """Provenance, number of frames and duration of a recording."""

    path: Path
    origin: Provenance
    frames: int
    seconds: float


def survey(path: Path | str) -> Survey:
    """Return a recording's summary without reading its frames; RecordingError if it is none."""
    path = Path(path)
    with _one_sentence(path):
        shapes = _inspect(path)
        arrays = npz.unpack(path, MAX_BYTES, only=("meta", "t"))
        origin = origin_of(arrays.get("meta"))
        shape, kind = shapes.get("frames", ((), None))
        if kind != np.float32 or len(shape) != 3 or shape[1:] != (origin.rows, origin.columns):
            raise RecordingError("has no frames of its sensor")
        if not shape[0]:
            raise RecordingError("holds no frames")
        t = _rising(_array(arrays, "t", np.float64, shape[:1]), "t")
        return Survey(path, origin, shape[0], float(t[-1] - t[0]))


def load(path: Path | str, *, mapped: bool = False) -> Recording:
    """Return the recording in a file, with every array checked; RecordingError if it is none.

    Its largest arrays may be `mapped`, for passes by `controller.shared.blocks`.
    """
    path = Path(path)
    with _one_sentence(path):
        _inspect(path)
        return parse(npz.unpack(path, MAX_BYTES, mapped=LARGE if mapped else ()))


@contextmanager
def _one_sentence(path: Path) -> Iterator[None]:
    """Convert errors about a file into one sentence with its name."""
    try:
        if not path.exists():
            raise RecordingError("does not exist")
        if not path.is_file():
            raise RecordingError("is not a file")
        yield
        return
    except OSError as error:
        problem = f"cannot be read: {reason(error)}"
    except ValueError as error:  # ZipError and RecordingError
        problem = str(error)
    raise RecordingError(f"the recording {path} {problem}; name a file made with --record")


def _inspect(path: Path) -> dict[str, npz.Shape]:
    """Return the shapes of the arrays in a file, with excessive ones refused, reading only them."""
    shapes = npz.shapes(path, MAX_BYTES)
    _refuse_excessive(shapes)
    return shapes


def parse(arrays: npz.Arrays) -> Recording:
    """Return the recording in some arrays; RecordingError if they are no recording."""
    _refuse_excessive({name: (array.shape, array.dtype) for name, array in arrays.items()})
    origin = origin_of(arrays.get("meta"))
    frames = _array(arrays, "frames", np.float32, (-1, origin.rows, origin.columns))
    count = len(frames)
    if not count:
        raise RecordingError("holds no frames")
    extremes = [(frames[part].min(), frames[part].max()) for part in blocks(frames)]
    # NaN is refused as well.
    if not all(least > -LARGEST and most < LARGEST for least, most in extremes):
        raise RecordingError(f"holds frames that are not all numbers below {LARGEST:g}")
    columns = {name: _array(arrays, name, kind, (count,)) for name, kind in COLUMNS.items()}
    for name in ("t", "sequence"):
        _rising(columns[name], name)
    for name in LABELLERS:
        if not ((columns[name] >= UNKNOWN) & (columns[name] < len(origin.labels))).all():
            raise RecordingError(f"holds a {name} that it does not name")
    state = {
        name.removeprefix(STATE): array for name, array in arrays.items() if name.startswith(STATE)
    }
    if any(array.dtype != np.float64 or not np.isfinite(array).all() for array in state.values()):
        raise RecordingError("holds a state that is not all finite numbers")
    return Recording(
        origin,
        frames,
        touch=_array(arrays, "touch", np.float64, (count, 2)),
        rest=_rest(arrays, origin),
        marks=_marks(arrays),
        commands=_commands(arrays),
        state=state,
        truth=_truth(arrays, count),
        **columns,
    )


def _refuse_excessive(shapes: Mapping[str, npz.Shape]) -> None:
    """Raise RecordingError for texts and tables that need far more memory as Python objects."""
    for name, (shape, kind) in shapes.items():
        if name == "meta" and kind.itemsize > 4 * MAX_PROVENANCE:
            raise RecordingError(TOO_LONG)
        if name.startswith(TABLES) and len(shape) > 0 and shape[0] > MAX_ROWS:
            raise RecordingError(f"has {name!r} of {shape[0]} rows; {MAX_ROWS} are allowed")


def _rising(column: NDArray[Any], name: str) -> NDArray[Any]:
    """Return times or numbers of frames, (n,), after a check that they increase strictly."""
    # Differences of arbitrary numbers may overflow; comparisons do not.
    if not (column[1:] > column[:-1]).all():
        raise RecordingError(f"holds {name!r} that does not rise from frame to frame")
    if column.dtype.kind == "f" and not (column[0] > -LATEST_S and column[-1] < LATEST_S):
        raise RecordingError(f"holds {name!r} beyond {LATEST_S:g} s")
    return column


def _rest(arrays: npz.Arrays, origin: Provenance) -> NDArray[np.float32] | None:
    """Return the image of the untouched sensor, (rows, columns); None if it was never found."""
    if "rest" not in arrays:
        return None
    rest = _array(arrays, "rest", np.float32, (origin.rows, origin.columns))
    if not (np.abs(rest) < LARGEST).all():
        raise RecordingError(f"holds a rest image that is not all numbers below {LARGEST:g}")
    return rest


def _marks(arrays: npz.Arrays) -> tuple[Mark, ...]:
    """Return the table of marks."""
    t = _array(arrays, "mark_t", np.float64, (-1,))
    kind, text = (_texts(arrays, f"mark_{name}", len(t)) for name in ("kind", "text"))
    if not np.isfinite(t).all() or not (np.diff(t) >= 0).all():
        raise RecordingError("holds marks that are not in order of time")
    return tuple(Mark(*row) for row in zip(t.tolist(), kind, text, strict=True))


def origin_of(array: NDArray[Any] | None) -> Provenance:
    """Return the checked provenance in the array "meta", a text of shape ()."""
    if array is None or array.shape != () or array.dtype.kind != "U":
        raise RecordingError("is no recording of OrbTouch")
    return parse_provenance(_legible(array))


def _legible(array: NDArray[Any]) -> Any:
    """Return an array of any shape as Python strings, refusing invalid code points."""
    try:
        texts = array.tolist()
        "".join(texts).encode()
    except (ValueError, SystemError):  # NumPy raises the second beyond Unicode
        raise RecordingError("holds texts that are none") from None
    return texts


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


def _texts(arrays: npz.Arrays, name: str, count: int) -> list[str]:
    """Return one array of names."""
    array = arrays.get(name)
    if array is None or array.dtype.kind != "U" or array.shape != (count,):
        raise RecordingError(f"has a table without its {count} names, {name!r}")
    texts: list[str] = _legible(array)
    return texts


def _commands(arrays: npz.Arrays) -> tuple[CommandRecord, ...]:
    """Return the table of commands, row by row."""
    t = _array(arrays, "command_t", np.float64, (-1,))
    rows = (len(t),)
    frame = _array(arrays, "command_frame", np.int64, rows)
    probability = _array(arrays, "command_probability", np.float64, rows)
    touch = _array(arrays, "command_touch", np.float64, (*rows, 2))
    gesture, name = (_texts(arrays, f"command_{name}", len(t)) for name in ("gesture", "name"))
    if not np.isfinite(t).all() or not np.isfinite(probability).all():
        raise RecordingError("holds commands whose times or probabilities are no numbers")
    places = [None if np.isnan(place).any() else (place[0], place[1]) for place in touch.tolist()]
    columns = (t.tolist(), frame.tolist(), gesture, probability.tolist(), places, name)
    return tuple(CommandRecord(*row) for row in zip(*columns, strict=True))


def _truth(arrays: npz.Arrays, count: int) -> SimulatedTruth | None:
    """Return the ground truth of a simulation; None for a real sensor."""
    if "true_touch" not in arrays:
        return None
    touch = _array(arrays, "true_touch", np.float32, (count, 2))
    contact = _array(arrays, "true_contact", np.float32, (count, -1, 3))
    onset = _array(arrays, "event_onset", np.float64, (-1,))
    release = _array(arrays, "event_release", np.float64, onset.shape)
    name = _texts(arrays, "event_name", len(onset))
    table = zip(onset.tolist(), release.tolist(), name, strict=True)
    events = tuple(Event(*row) for row in table)
    if not (np.isfinite(onset) & np.isfinite(release) & (release >= onset)).all():
        raise RecordingError("has events that end before they begin")
    return SimulatedTruth(touch, contact, events)
