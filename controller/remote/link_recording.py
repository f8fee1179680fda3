"""Recordings that the host on the link starts and stops, in the user's data folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from controller.capture.labels import Labeller
from controller.capture.session_recorder import RunFiles, SessionRecorder
from controller.recordings.recording import RecordingError
from controller.remote.worker import Worker
from controller.runtime.assemble import Parts, next_file
from controller.runtime.device import Device
from controller.runtime.loop import Handler
from controller.shared import files
from controller.shared.errors import reason
from controller.shared.files import is_free
from controller.shared.notices import notice
from controller.shared.protocol.messages import Message
from controller.shared.protocol.teaching import Record, RecordingStatus, RecordLabel

MOST_S: Final = 1800.0  # of one recording
MOST_BYTES: Final = 200 << 20  # of all


class LinkRecording(Handler):
    """The recording under way, if there is one; files are sealed by a worker."""

    def __init__(self, folder: Path, worker: Worker, current: Callable[[], Parts]) -> None:
        """Record into a folder, which need not exist."""
        self._folder, self._worker, self._current = folder, worker, current
        self._recorder: SessionRecorder | None = None
        self._bundle, self._since_s = "", 0.0

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        """Start or stop a recording, or label its next frames; return the answer."""
        if not isinstance(message, Record | RecordLabel):
            return None
        own = self._recorder is not None and device.recorder is self._recorder
        if isinstance(message, Record) and message.on:
            if device.recorder is not None:
                return [RecordingStatus(True, str(device.recorder.path))]
            return [self._start(device, self._current())]
        if not own:
            started = device.recorder is not None
            why = notice("began_with_orb") if started else notice("nothing_recorded")
            return [RecordingStatus(started, why)]
        assert self._recorder is not None
        if isinstance(message, Record):
            self._stop(device)
        elif message.label not in self._recorder.labels:
            return [RecordingStatus(True, notice("no_gesture", message.label))]
        else:
            self._recorder.ask(message.label)
            device.note("cue", "rest" if message.label == "null" else f"go {message.label}")
        return []

    def poll(self, device: Device) -> Sequence[Message]:
        """End a recording that is too long, or whose bundle is not in use any more."""
        if self._recorder is None:
            return ()
        if device.recorder is not self._recorder:
            self._recorder = None  # a device closes its recording
        elif self._current().bundle.hash != self._bundle:
            self._stop(device, "changed")
        elif device.now_s - self._since_s > MOST_S or self._recorder.full:
            self._stop(device, "long_enough")
        return ()

    def _start(self, device: Device, parts: Parts) -> Message:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            if sum(path.stat().st_size for path in self._folder.iterdir()) > MOST_BYTES:
                raise RecordingError(notice("folder_full", self._folder))
            runs = RunFiles(self._folder, parts.options.user, parts.options.session)
            self._recorder = device.recorder = SessionRecorder(
                next_file(parts, runs, device.sensor),
                device.pipeline,
                Labeller(parts.bundle.labels),
            )
        except RecordingError as error:
            return RecordingStatus(False, str(error))
        except OSError as error:
            return RecordingStatus(False, notice("cannot_record", reason(error)))
        self._bundle, self._since_s = parts.bundle.hash, device.now_s
        return RecordingStatus(True, str(self._recorder.path))

    def _stop(self, device: Device, why: str = "") -> None:
        """Take the recorder from the device, and seal its file; `why` is the code of a notice."""
        recorder, self._recorder, device.recorder = self._recorder, None, None
        assert recorder is not None
        self._worker.begin(partial(_seal, recorder, why))


def delete(folder: Path) -> int:
    """Delete all recordings in a folder but the one under way; return how many."""
    if not folder.is_dir():
        return 0
    files.sweep(folder, age_s=0.0)
    found = [path for path in folder.iterdir() if path.is_file() and is_free(path)]
    for path in found:
        path.unlink(missing_ok=True)
    return len(found)


def _seal(recorder: SessionRecorder, why: str) -> Iterable[Message]:
    """Finish a recording, and return its report."""
    try:
        kept = recorder.close()
    except RecordingError as error:
        return [RecordingStatus(False, str(error))]
    text = str(recorder.path) if kept else notice("short")
    return [RecordingStatus(False, notice(why, text) if why else text)]
