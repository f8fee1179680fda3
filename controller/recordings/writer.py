"""Files of recordings: written deterministically, named by the BIDS standard, never replaced.

The name is `sub-ID_ses-DATE_run-NN.npz`. The journal of an unsealed recording has the same one, so
that counts as taken.
"""

import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from controller.recognition.pipeline import CommandRecord
from controller.recordings import reader
from controller.recordings.reader import COLUMNS, STATE
from controller.recordings.recording import (
    Mark,
    Recording,
    RecordingError,
    SimulatedTruth,
    format_provenance,
)
from controller.shared import npz
from controller.shared.files import atomic_write

SEALED: Final = ".npz"
JOURNAL: Final = ".journal"
DAMAGED: Final = ".damaged"  # appended to the name of a damaged journal
LONGEST: Final = 64  # characters of an ID: three parts fit the 255 of file systems
_RUN: Final = re.compile(r"(.*_run-)(\d{1,9})")
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
    touches = np.array([c.touch or NOWHERE for c in commands], dtype=np.float64)
    return {
        "mark_t": np.array([m.t_s for m in marks], dtype=np.float64),
        "mark_kind": np.array([m.kind for m in marks], dtype=np.str_),
        "mark_text": np.array([m.text for m in marks], dtype=np.str_),
        "command_t": np.array([c.t_s for c in commands], dtype=np.float64),
        "command_frame": np.array([c.frame for c in commands], dtype=np.int64),
        "command_gesture": np.array([c.gesture for c in commands], dtype=np.str_),
        "command_probability": np.array([c.probability for c in commands], dtype=np.float64),
        "command_touch": touches.reshape(-1, 2),
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
    for place in alternatives(path):
        if not os.path.lexists(place):
            if place != path and os.path.lexists(journal_of(place)):
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


# --- names ----------------------------------------------------------------------------------------


def check_names(user: str, session: str) -> None:
    """Raise RecordingError if names are not of letters and digits."""
    for what, name in (("user", user), ("session", session)):
        if not (name.isascii() and name.isalnum() and len(name) <= LONGEST):
            raise RecordingError(
                f"the {what} {name!r} names files, so it must be 1 to {LONGEST} letters (a to z) "
                "and digits; choose another"
            )


def next_free(folder: Path, user: str, session: str) -> Path:
    """Return the file of the next run; RecordingError if names are not of letters and digits."""
    check_names(user, session)
    stem = f"sub-{user}_ses-{session}_run-"
    runs = [0]
    for path in folder.iterdir() if folder.is_dir() else ():
        match = _RUN.match(path.name.lower())  # some file systems ignore case
        if match and match[1] == stem.lower():
            runs.append(int(match[2]))
    return folder / f"{stem}{max(runs) + 1:02d}{SEALED}"


def alternatives(path: Path) -> Iterator[Path]:
    """Yield `path`, then an infinite sequence of names after it: run-02, run-03 or x-2, x-3."""
    yield path
    run = _RUN.fullmatch(path.stem)
    stem, first = (run[1], int(run[2]) + 1) if run else (f"{path.stem}-", 2)
    width = len(run[2]) if run else 1
    while True:
        yield path.with_name(f"{stem}{first:0{width}d}{path.suffix}")
        first += 1


def journal_of(path: Path) -> Path:
    """Return the path of a recording's journal."""
    return path.with_name((path.stem if path.suffix == SEALED else path.name) + JOURNAL)
