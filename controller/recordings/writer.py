"""Recordings into files: the same recording gives the same bytes, and no file is ever replaced."""

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.pipeline import Touch
from controller.recordings import meta
from controller.recordings.reader import COLUMNS, STATE
from controller.recordings.recording import Recording, Truth

NOWHERE = (np.nan, np.nan)


def pack(recording: Recording) -> bytes:
    """Return a recording as the bytes of its file."""
    commands, marks = recording.commands, recording.marks
    return npz.pack(
        {
            "frames": recording.frames,
            **{name: getattr(recording, name) for name in COLUMNS},
            "touch": recording.touch,
            **({} if recording.rest is None else {"rest": recording.rest}),
            "mark_t": np.array([m.t_s for m in marks], dtype=np.float64),
            "mark_kind": np.array([m.kind for m in marks], dtype=np.str_),
            "mark_text": np.array([m.text for m in marks], dtype=np.str_),
            "command_t": np.array([c.t_s for c in commands], dtype=np.float64),
            "command_frame": np.array([c.frame for c in commands], dtype=np.int64),
            "command_gesture": np.array([c.gesture for c in commands], dtype=np.str_),
            "command_probability": np.array([c.probability for c in commands], dtype=np.float64),
            "command_touch": _touches([c.touch for c in commands]),
            "command_name": np.array([c.command for c in commands], dtype=np.str_),
            **{STATE + name: array for name, array in recording.state.items()},
            **(_truth(recording.truth) if recording.truth else {}),
            "meta": np.array(meta.text(recording.origin)),
        }
    )


def _truth(truth: Truth) -> npz.Arrays:
    return {
        "true_touch": truth.touch,
        "true_contact": truth.contact,
        "event_onset": np.array([e.onset_s for e in truth.events], dtype=np.float64),
        "event_release": np.array([e.release_s for e in truth.events], dtype=np.float64),
        "event_name": np.array([e.kind for e in truth.events], dtype=np.str_),
    }


def _touches(touches: Sequence[Touch | None]) -> NDArray[np.float64]:
    return np.array([touch or NOWHERE for touch in touches], dtype=np.float64).reshape(-1, 2)


def write_beside(path: Path, data: bytes) -> None:
    """Write a file under another name, then give it its own, unless that is taken.

    So there is never half a file of this name, whatever happens.

    Raises:
        FileExistsError: The name is taken.
        OSError: It cannot be written.
    """
    beside = write_aside(path, data)
    try:
        try:
            os.link(beside, path)  # unlike rename, never replaces
        except FileExistsError:
            raise
        except OSError:  # a file system without links
            if path.exists():
                raise FileExistsError(path) from None
            beside.rename(path)
        sync_folder(path.parent)
    finally:
        beside.unlink(missing_ok=True)


def write_aside(path: Path, data: bytes) -> Path:
    """Write the data, safely on disk, under a new name in the same folder."""
    handle, name = tempfile.mkstemp(suffix=path.suffix, prefix=f".{path.stem}-", dir=path.parent)
    kept = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        kept.chmod(0o644)  # mkstemp's files are private
    except OSError:
        kept.unlink(missing_ok=True)
        raise
    return kept


def sync_folder(folder: Path) -> None:
    """Have the folder's names on the disk as well, where the system can do that."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:
        pass  # a file system that has no such thing
    finally:
        os.close(handle)
