"""Write recordings: a file is written whole or not at all, and never over another."""

import dataclasses
import json
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.pipeline import CommandRecord, Touch
from controller.preprocess import Frame, State
from controller.recording import NUMBERS, STATE, UNKNOWN, Origin, Recording, RecordingError, Truth

_NOWHERE = (np.nan, np.nan)


class Recorder:
    """Gathers a session and seals it into a file when it is closed."""

    def __init__(self, path: Path, origin: Origin, state: State) -> None:
        """Prepare a recording.

        Args:
            path: The file to write; must not exist.
            origin: Where the frames come from.
            state: `Pipeline.state()` before the first frame.

        Raises:
            RecordingError: The file exists, or its folder cannot be written to.
        """
        if path.exists() or path.is_symlink():
            raise RecordingError(f"{path} exists and is kept as it is; record into another file")
        folder = path.parent
        if not folder.is_dir() or not os.access(folder, os.W_OK):
            raise RecordingError(f"cannot write into {folder}; record into another folder")
        self.path = path
        self._origin = origin
        self._state = state
        self._frames: list[Frame] = []
        self._rows: list[tuple[float, int, int, int]] = []  # t, sequence, label, button
        self._touches: list[Touch] = []
        self._commands: list[CommandRecord] = []

    def add(
        self,
        frame: Frame,
        t_s: float,
        number: int,
        *,
        label: int = UNKNOWN,
        button: int = UNKNOWN,
        touch: Touch | None = None,
        command: CommandRecord | None = None,
    ) -> None:
        """Take one frame, and what was made of it."""
        self._frames.append(frame.copy())
        self._rows.append((t_s, number, label, button))
        self._touches.append(touch or _NOWHERE)
        if command is not None:
            self._commands.append(command)

    def close(self) -> Path | None:
        """Seal what was gathered; return the file, or None if there was nothing. Only once.

        Raises:
            RecordingError: The file cannot be written; the message says where the data is.
        """
        if not self._frames:
            return None
        t, sequence, label, button = zip(*self._rows, strict=True)
        data = pack(
            Recording(
                self._origin,
                np.array(self._frames, dtype=np.float32),
                t=np.array(t, dtype=np.float64),
                sequence=np.array(sequence, dtype=np.int64),
                label=np.array(label, dtype=np.int16),
                button=np.array(button, dtype=np.int16),
                touch=np.array(self._touches, dtype=np.float64),
                commands=tuple(self._commands),
                state=self._state,
            )
        )
        self._frames.clear()
        try:
            write_beside(self.path, data)
        except FileExistsError:
            kept = _write_aside(self.path, data)
            raise RecordingError(f"{self.path} appeared meanwhile; recorded into {kept}") from None
        except OSError as error:
            raise RecordingError(self._rescue(data, error)) from None
        return self.path

    def _rescue(self, data: bytes, error: OSError) -> str:
        """Keep a session that has no place where it should go; return the sentence that says so."""
        problem = f"cannot write {self.path}: {error.strerror or error}"
        try:
            kept = _write_aside(Path(tempfile.gettempdir()) / self.path.name, data)
        except OSError:
            return f"{problem}; the session is lost"
        return f"{problem}; the session is kept in {kept}"


def pack(recording: Recording) -> bytes:
    """Return a recording as the bytes of its file; the same recording gives the same bytes."""
    commands = recording.commands
    return npz.pack(
        {
            "frames": recording.frames,
            **{name: getattr(recording, name) for name in NUMBERS},
            "touch": recording.touch,
            "command_t": np.array([c.t_s for c in commands], dtype=np.float64),
            "command_frame": np.array([c.frame for c in commands], dtype=np.int64),
            "command_gesture": np.array([c.gesture for c in commands], dtype=np.str_),
            "command_probability": np.array([c.probability for c in commands], dtype=np.float64),
            "command_touch": _touches([c.touch for c in commands]),
            "command_name": np.array([c.command for c in commands], dtype=np.str_),
            **{STATE + name: array for name, array in recording.state.items()},
            **(_truth(recording.truth) if recording.truth else {}),
            "meta": np.array(json.dumps(dataclasses.asdict(recording.origin))),
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
    return np.array([touch or _NOWHERE for touch in touches], dtype=np.float64).reshape(-1, 2)


def write_beside(path: Path, data: bytes) -> None:
    """Write a file under another name, then give it its own, unless that is taken.

    So there is never half a file of this name, whatever happens.

    Raises:
        FileExistsError: The name is taken.
        OSError: It cannot be written.
    """
    beside = _write_aside(path, data)
    try:
        try:
            os.link(beside, path)  # unlike rename, never replaces
        except FileExistsError:
            raise
        except OSError:  # a file system without links
            if path.exists():
                raise FileExistsError(path) from None
            beside.rename(path)
    finally:
        beside.unlink(missing_ok=True)


def _write_aside(path: Path, data: bytes) -> Path:
    """Write the data, safely on disk, under a new name in the same folder."""
    handle, name = tempfile.mkstemp(suffix=".npz", prefix=f".{path.stem}-", dir=path.parent)
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
