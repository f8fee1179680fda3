"""Export a recording as CSV tables.

NAME.csv has a row for each frame, NAME_events.csv the true gestures, NAME_commands.csv and
NAME_marks.csv the tables of those names, and NAME.json all other data. The tables follow RFC 4180,
in UTF-8.
"""

import csv
import io
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.recording import LABELLERS, Recording

FORM: Final = 1  # of these tables
EVENTS: Final = ("onset_s", "release_s", "name")
COMMANDS: Final = ("t_s", "frame", "gesture", "probability", "touch_x", "touch_y", "command")
MARKS: Final = ("t_s", "kind", "text")
_FIXED: Final = ("t", "sequence", *LABELLERS, "excluded", "touch_x", "touch_y")
_FINGER: Final = ("x", "y", "depth_mm")

Row = Sequence[str]


def tables(recording: Recording) -> dict[str, str]:
    """Return the files of a recording: the suffix of each name after NAME, and its content."""
    origin, truth = recording.origin, recording.truth
    about: dict[str, Any] = {
        "form": FORM,
        "meta": asdict(origin),
        "rest": None if recording.rest is None else recording.rest.astype(float).tolist(),
        "state": {
            name: {"shape": array.shape, "values": array.ravel().tolist()}
            for name, array in recording.state.items()
        },
        "truth": None if truth is None else {"fingers": truth.contact.shape[1]},
    }
    commands = (
        (_text(c.t_s), str(c.frame), c.gesture, _text(c.probability),
         *(("", "") if c.touch is None else map(_text, c.touch)), c.command)
        for c in recording.commands
    )  # fmt: skip
    files = {
        ".csv": _written(_header(recording), _rows(recording)),
        "_commands.csv": _written(COMMANDS, commands),
        "_marks.csv": _written(MARKS, ((_text(m.t_s), m.kind, m.text) for m in recording.marks)),
        ".json": json.dumps(about, indent=1, allow_nan=False) + "\n",
    }
    if truth is not None:
        events = ((_text(e.onset_s), _text(e.release_s), e.kind) for e in truth.events)
        files["_events.csv"] = _written(EVENTS, events)
    return files


def _header(recording: Recording) -> list[str]:
    rows, columns = recording.frames.shape[1:]
    taxels = [f"c_{row}_{column}" for row in range(rows) for column in range(columns)]
    if recording.truth is None:
        return [*_FIXED, *taxels]
    fingers = range(1, recording.truth.contact.shape[1] + 1)
    contact = [f"finger_{i}_{name}" for i in fingers for name in _FINGER]
    return [*_FIXED, *taxels, "true_touch_x", "true_touch_y", *contact]


def _rows(recording: Recording) -> Iterator[Row]:
    names = (*recording.origin.labels, "")  # index -1, unknown, is the last
    columns = [
        [_text(t_s) for t_s in recording.t.tolist()],
        [str(number) for number in recording.sequence.tolist()],
        *([names[index] for index in getattr(recording, name).tolist()] for name in LABELLERS),
        [str(int(flag)) for flag in recording.excluded.tolist()],
    ]
    numbers: list[NDArray[Any]] = [recording.touch, recording.frames]
    if recording.truth is not None:
        numbers += [recording.truth.touch, recording.truth.contact]
    for i in range(len(recording.t)):
        cells = [_text(value) for array in numbers for value in array[i].ravel()]
        yield [*(column[i] for column in columns), *cells]


def _text(value: float | np.floating[Any]) -> str:
    """Return the shortest text that reads back as this number in its type; NaN is empty."""
    return "" if value != value else str(value)


def _written(header: Row, rows: Iterable[Row]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer)
    writer.writerow(header)
    writer.writerows(rows)
    return buffer.getvalue()
