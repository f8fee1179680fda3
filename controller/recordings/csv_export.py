"""Recordings as tables that any program reads, and back: nothing is lost on the way.

NAME.csv has a row for each frame, NAME_events.csv the true gestures, NAME_commands.csv and
NAME_marks.csv what their names say, and NAME.json all that is no table. The tables are as RFC 4180
has them: UTF-8, a comma between, a quote where one is needed.
"""

import csv
import io
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from controller.config import parse_json
from controller.errors import reason
from controller.files import read_bytes
from controller.recognition.event_metric import Event
from controller.recognition.pipeline import CommandRecord
from controller.recordings.reader import MAX_BYTES
from controller.recordings.recording import (
    LABELLERS,
    UNKNOWN,
    Mark,
    Recording,
    RecordingError,
    SimulatedTruth,
    parse_provenance,
)

FORM: Final = 1  # of these tables
_MAX_JSON: Final = 64 << 20  # bytes of NAME.json
_MAX_TABLE: Final = 4 * MAX_BYTES  # bytes of a table: numbers are longer as texts
EVENTS: Final = ("onset_s", "release_s", "name")
COMMANDS: Final = ("t_s", "frame", "gesture", "probability", "touch_x", "touch_y", "command")
MARKS: Final = ("t_s", "kind", "text")
TABLES: Final = ("", "_events", "_commands", "_marks")  # what stands between NAME and .csv
_FIXED: Final = ("t", "sequence", *LABELLERS, "excluded", "touch_x", "touch_y")
_FINGER: Final = ("x", "y", "depth_mm")
# Shortest signs for "nobody knows"; the first that is no label is taken.
_UNKNOWN: Final = ("", "?", "??", "???")

Row = Sequence[str]
Table = Callable[[str], str]  # gives the content of a table by its place in `TABLES`


def tables(recording: Recording) -> dict[str, str]:
    """Return the files of a recording: what follows NAME, and their content."""
    origin, truth = recording.origin, recording.truth
    unknown = _unknown(origin.labels)
    about: dict[str, Any] = {
        "form": FORM,
        "meta": asdict(origin),
        "unknown": unknown,
        "rest": None if recording.rest is None else recording.rest.astype(float).tolist(),
        "state": {
            name: {"shape": array.shape, "values": array.ravel().tolist()}
            for name, array in recording.state.items()
        },
        "truth": None if truth is None else {"fingers": truth.contact.shape[1]},
    }
    commands = (
        (_text(c.t_s), str(c.frame), c.gesture, _text(c.probability),
         *("" if c.touch is None else _text(v) for v in c.touch or (0, 0)), c.command)
        for c in recording.commands
    )  # fmt: skip
    files = {
        ".csv": _written(_header(recording), _rows(recording, unknown)),
        "_commands.csv": _written(COMMANDS, commands),
        "_marks.csv": _written(MARKS, ((_text(m.t_s), m.kind, m.text) for m in recording.marks)),
        ".json": json.dumps(about, indent=1, allow_nan=False) + "\n",
    }
    if truth is not None:
        events = ((_text(e.onset_s), _text(e.release_s), e.kind) for e in truth.events)
        files["_events.csv"] = _written(EVENTS, events)
    return files


def encode(content: str) -> bytes:
    """Return the content of a table as the bytes of its file."""
    return content.encode("utf-8", "surrogatepass")


def read(path: Path) -> Recording:
    """Return the recording whose NAME.json this is; its tables stand beside it.

    Raises:
        RecordingError: One of its files is missing, or none of ours.
    """

    def table(part: str) -> str:
        return _read(path.with_name(f"{path.stem}{part}.csv"), _MAX_TABLE)

    return parse(_read(path, _MAX_JSON), table, path)


def parse(about: str, table: Table, path: Path) -> Recording:
    """Return the recording that these texts make; `path` is for messages.

    Raises:
        RecordingError: They make none.
    """
    try:
        return _parse(parse_json(about, _MAX_JSON), table)
    except RecordingError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, csv.Error) as error:
        raise RecordingError(
            f"the tables of {path} are none that this program exported ({_reason(error)}); "
            "name the .json of controller recordings export"
        ) from None


# --- out ------------------------------------------------------------------------------------------


def _unknown(labels: Sequence[str]) -> str:
    return next(sign for sign in (*_UNKNOWN, "?" * (len(labels) + 4)) if sign not in labels)


def _header(recording: Recording) -> list[str]:
    rows, columns = recording.frames.shape[1:]
    taxels = [f"c_{row}_{column}" for row in range(rows) for column in range(columns)]
    fingers = 0 if recording.truth is None else recording.truth.contact.shape[1]
    true = [] if recording.truth is None else ["true_touch_x", "true_touch_y"]
    contact = [f"finger_{i + 1}_{what}" for i in range(fingers) for what in _FINGER]
    return [*_FIXED, *taxels, *true, *contact]


def _rows(recording: Recording, unknown: str) -> Iterator[Row]:
    names = (*recording.origin.labels, unknown)  # -1 is the last
    columns = [
        _texts(recording.t),
        [str(number) for number in recording.sequence.tolist()],
        *([names[index] for index in getattr(recording, name).tolist()] for name in LABELLERS),
        [str(int(flag)) for flag in recording.excluded.tolist()],
    ]
    numbers: list[NDArray[Any]] = [recording.touch, recording.frames]
    if recording.truth is not None:
        numbers += [recording.truth.touch, recording.truth.contact]
    for i in range(len(recording.t)):
        row = [column[i] for column in columns]
        for array in numbers:
            row += _texts(array[i].ravel())
        yield row


def _texts(values: NDArray[np.floating]) -> list[str]:
    """Return numbers in the shortest texts that read back to the same ones; NaN is empty."""
    if values.dtype == np.float64:
        return [_text(value) for value in values.tolist()]
    short = [str(value) for value in values]
    back = np.array(short, dtype=np.float64).astype(values.dtype)
    same = (back == values) | np.isnan(values)
    if not same.all():  # a text that is half-way between two float32 to within a float64
        short = [text if ok else repr(float(value))
                 for text, ok, value in zip(short, same.tolist(), values, strict=True)]  # fmt: skip
    return ["" if text == "nan" else text for text in short]


def _text(value: float) -> str:
    return "" if value != value else repr(float(value))


def _written(header: Row, rows: Iterable[Row]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer)
    writer.writerow(header)
    writer.writerows(rows)
    return buffer.getvalue()


# --- in -------------------------------------------------------------------------------------------


def _read(path: Path, limit_bytes: int) -> str:
    try:
        return read_bytes(path, limit_bytes).decode("utf-8", "surrogatepass")
    except UnicodeDecodeError:
        raise RecordingError(f"{path} is no text in UTF-8; name an exported recording") from None
    except OSError as error:
        raise RecordingError(
            f"cannot read {path}: {reason(error)}; an exported recording is "
            "NAME.json with its tables beside it"
        ) from None


def _parse(about: Mapping[str, Any], table: Table) -> Recording:
    if about["form"] != FORM:
        raise RecordingError(f"tables of form {about['form']!r}, this program reads {FORM}")
    origin = parse_provenance(json.dumps(about["meta"]))
    header, *rows = csv.reader(io.StringIO(table(""), newline=""))
    values = {name: [row[i] for row in rows] for i, name in enumerate(header)}
    size, fingers = origin.rows * origin.columns, (about["truth"] or {"fingers": 0})["fingers"]
    if not (0 < size <= len(header) and 0 <= fingers <= len(header)):
        raise RecordingError("its columns are not those of its sensor")
    taxels = [f"c_{row}_{col}" for row in range(origin.rows) for col in range(origin.columns)]
    if header[: len(_FIXED) + size] != [*_FIXED, *taxels]:
        raise RecordingError("its columns are not those of its sensor")
    index = {name: i for i, name in enumerate(origin.labels)} | {about["unknown"]: UNKNOWN}

    def block(names: Sequence[str], kind: DTypeLike, *shape: int) -> NDArray[Any]:
        columns = [_numbers(values[name], kind) for name in names]
        flat = np.stack(columns, axis=1) if columns else np.empty((len(rows), 0), dtype=kind)
        return flat.reshape(len(rows), *shape)

    columns = {name: np.array([index[word] for word in values[name]], dtype=np.int16)
               for name in LABELLERS}  # fmt: skip
    rest = about["rest"]
    return Recording(
        origin,
        block(taxels, np.float32, origin.rows, origin.columns),
        t=_numbers(values["t"], np.float64),
        sequence=np.array([int(number) for number in values["sequence"]], dtype=np.int64),
        excluded=np.array([{"0": False, "1": True}[f] for f in values["excluded"]], dtype=np.bool_),
        touch=block(("touch_x", "touch_y"), np.float64, 2),
        rest=None if rest is None else np.array(rest, dtype=np.float32),
        marks=tuple(
            Mark(_number(t), kind, text) for t, kind, text in _table(table("_marks"), MARKS)
        ),
        commands=tuple(map(_command, _table(table("_commands"), COMMANDS))),
        state={
            name: np.array(array["values"], dtype=np.float64).reshape(array["shape"])
            for name, array in about["state"].items()
        },
        truth=_truth(about["truth"], block, table),
        **columns,
    )


def _truth(about: Any, block: Callable[..., NDArray[Any]], table: Table) -> SimulatedTruth | None:
    if about is None:
        return None
    fingers = about["fingers"]
    names = [f"finger_{i + 1}_{what}" for i in range(fingers) for what in _FINGER]
    events = _table(table("_events"), EVENTS)
    return SimulatedTruth(
        block(("true_touch_x", "true_touch_y"), np.float32, 2),
        block(names, np.float32, fingers, 3),
        tuple(Event(_number(onset), _number(release), name) for onset, release, name in events),
    )


def _table(content: str, header: Row) -> Iterator[list[str]]:
    first, *rows = csv.reader(io.StringIO(content, newline=""))
    if first != list(header):
        raise RecordingError(f"a table has the columns {', '.join(first)}, not {', '.join(header)}")
    yield from rows


def _command(row: list[str]) -> CommandRecord:
    t_s, frame, gesture, probability, x, y, command = row
    touch = (float(x), float(y)) if x and y else None
    return CommandRecord(_number(t_s), int(frame), gesture, _number(probability), touch, command)


def _number(text: str) -> float:
    return float(text or "nan")


def _numbers(texts: list[str], kind: DTypeLike) -> NDArray[Any]:
    with np.errstate(over="ignore"):  # what is too large becomes infinite, and is refused later
        return np.array([text or "nan" for text in texts], dtype=np.float64).astype(kind)


def _reason(error: Exception) -> str:
    return f"no {error}" if isinstance(error, KeyError) else str(error).split("\n")[0]
