"""Seal a recording: its file is whole, is on the disk, and was read again, before it counts."""

import os
from collections.abc import Callable
from pathlib import Path

from controller.recordings import naming, reader
from controller.recordings.recording import Recording, RecordingError
from controller.recordings.writer import pack, write_beside

Write = Callable[[Path, bytes], None]


def seal(path: Path, recording: Recording, write: Write = write_beside) -> Path:
    """Write a recording, unless it has been; return its file: `path`, or the next free name.

    Args:
        path: Where it belongs; what has this name already is kept.
        recording: What to write; its id says whether a file holds it already.
        write: Writes a file whole or not at all, and never over another.

    Raises:
        RecordingError: What was written cannot be read again.
        OSError: It cannot be written.
    """
    data = pack(recording)
    for place in naming.alternatives(path):
        if not os.path.lexists(place):
            if place != path and os.path.lexists(naming.journal_of(place)):
                continue  # that name is being recorded
            try:
                write(place, data)
            except FileExistsError:
                continue
            if not holds(place, recording):
                raise RecordingError(f"{place} was written and cannot be read again")
            return place
        if holds(place, recording):
            return place
    raise AssertionError("names have no end")


def holds(path: Path, recording: Recording) -> bool:
    """Whether a file holds this recording, or one of the same id with more frames."""
    try:
        if reader.survey(path).origin.id != recording.origin.id:
            return False
        there = reader.load(path).frames[: len(recording.frames)]
    except RecordingError:
        return False
    return there.tobytes() == recording.frames.tobytes()
