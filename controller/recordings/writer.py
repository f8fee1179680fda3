"""Recordings into files: the same recording gives the same bytes, and no file is ever replaced."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.files import atomic_write
from controller.recognition.pipeline import Touch
from controller.recordings import meta
from controller.recordings.reader import COLUMNS, STATE
from controller.recordings.recording import Recording, SimulatedTruth

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


def _truth(truth: SimulatedTruth) -> npz.Arrays:
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
    """Write a file whole or not at all, and never over another.

    Raises:
        FileExistsError: The name is taken.
        OSError: It cannot be written.
    """
    atomic_write(path, data, replace=False, folders=False)
