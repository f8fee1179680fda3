"""Write a live session: a file is written whole or not at all, and never over another."""

import os
import tempfile
from pathlib import Path

import numpy as np

from controller.pipeline import CommandRecord, Touch
from controller.preprocess import Frame, State
from controller.recordings.recording import (
    UNKNOWN,
    Origin,
    Recording,
    RecordingError,
    unlabelled,
)
from controller.recordings.writer import NOWHERE, pack, write_aside, write_beside


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
        self._touches.append(touch or NOWHERE)
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
                key=unlabelled(len(t))["key"],
                cue=unlabelled(len(t))["cue"],
                excluded=np.zeros(len(t), dtype=np.bool_),
                touch=np.array(self._touches, dtype=np.float64),
                commands=tuple(self._commands),
                state=self._state,
            )
        )
        self._frames.clear()
        try:
            write_beside(self.path, data)
        except FileExistsError:
            kept = write_aside(self.path, data)
            raise RecordingError(f"{self.path} appeared meanwhile; recorded into {kept}") from None
        except OSError as error:
            raise RecordingError(self._rescue(data, error)) from None
        return self.path

    def _rescue(self, data: bytes, error: OSError) -> str:
        """Keep a session that has no place where it should go; return the sentence that says so."""
        problem = f"cannot write {self.path}: {error.strerror or error}"
        try:
            kept = write_aside(Path(tempfile.gettempdir()) / self.path.name, data)
        except OSError:
            return f"{problem}; the session is lost"
        return f"{problem}; the session is kept in {kept}"
