"""Write recordings to files, deterministically and without replacing a file."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.files import atomic_write
from controller.recognition.pipeline import CommandRecord, Touch
from controller.recordings import naming, reader
from controller.recordings.reader import COLUMNS, STATE
from controller.recordings.recording import (
    Mark,
    Recording,
    RecordingError,
    SimulatedTruth,
    format_provenance,
)

NOWHERE: Final = (np.nan, np.nan)


def pack(recording: Recording) -> bytes:
    """Return a recording as the bytes of its file."""
    return npz.pack(
        {
            "frames": recording.frames,
            **{name: getattr(recording, name) for name in COLUMNS},
            "touch": recording.touch,
            **({} if recording.rest is None else {"rest": recording.rest}),
            **tables(recording.marks, recording.commands),
            **{STATE + name: array for name, array in recording.state.items()},
            **(_truth(recording.truth) if recording.truth else {}),
            "meta": np.array(format_provenance(recording.origin)),
        }
    )


def tables(marks: Sequence[Mark], commands: Sequence[CommandRecord]) -> npz.Arrays:
    """Return the columns of the tables of marks and commands, one row each."""
    return {
        "mark_t": np.array([m.t_s for m in marks], dtype=np.float64),
        "mark_kind": np.array([m.kind for m in marks], dtype=np.str_),
        "mark_text": np.array([m.text for m in marks], dtype=np.str_),
        "command_t": np.array([c.t_s for c in commands], dtype=np.float64),
        "command_frame": np.array([c.frame for c in commands], dtype=np.int64),
        "command_gesture": np.array([c.gesture for c in commands], dtype=np.str_),
        "command_probability": np.array([c.probability for c in commands], dtype=np.float64),
        "command_touch": _touches([c.touch for c in commands]),
        "command_name": np.array([c.command for c in commands], dtype=np.str_),
    }


def seal(path: Path, recording: Recording) -> Path:
    """Write a recording, unless it exists already; return its file: `path`, or the next free name.

    The file is complete, on the disk, and was read again when this returns.

    Raises:
        RecordingError: The written file cannot be read again.
        OSError: It cannot be written.
    """
    data = pack(recording)
    for place in naming.alternatives(path):
        if not os.path.lexists(place):
            if place != path and os.path.lexists(naming.journal_of(place)):
                continue  # in use by a recorder
            try:
                write_beside(place, data)
            except FileExistsError:
                continue
            if not _holds(place, recording):
                raise RecordingError(f"{place} was written and cannot be read again")
            return place
        if _holds(place, recording):
            return place
    raise AssertionError("names have no end")


def write_beside(path: Path, data: bytes) -> None:
    """Write a new file atomically; FileExistsError if the name is taken."""
    atomic_write(path, data, replace=False, folders=False)


def _holds(path: Path, recording: Recording) -> bool:
    """Return whether a file holds this recording, or a longer one with the same id."""
    try:
        if reader.survey(path).origin.id != recording.origin.id:
            return False
        there = reader.load(path).frames[: len(recording.frames)]
    except RecordingError:
        return False
    return there.tobytes() == recording.frames.tobytes()


def _truth(truth: SimulatedTruth) -> npz.Arrays:
    return {
        "true_touch": truth.touch,
        "true_contact": truth.contact,
        "event_onset": np.array([e.onset_s for e in truth.events], dtype=np.float64),
        "event_release": np.array([e.release_s for e in truth.events], dtype=np.float64),
        "event_name": np.array([e.kind for e in truth.events], dtype=np.str_),
    }


def _touches(touches: Sequence[Touch | None]) -> NDArray[np.float64]:
    """Return positions as rows, (n, 2), NaN for none."""
    return np.array([touch or NOWHERE for touch in touches], dtype=np.float64).reshape(-1, 2)
