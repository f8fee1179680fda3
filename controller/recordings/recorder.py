"""Recorder of a live session: a crash of the program or the computer loses at most a second.

Every frame is appended to a journal in memory. A thread writes new bytes to the journal's file and
syncs it twice a second, so the loop never waits for a disk. On close, the session is sealed into
its file, and only then is the journal removed.
"""

import contextlib
import errno
import logging
import os
import secrets
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import Final

from controller.recordings import writer
from controller.recordings.journal import Journal, decode
from controller.recordings.journal_file import JournalFile
from controller.recordings.recording import Provenance, Recording, RecordingError
from controller.recordings.writer import seal
from controller.shared.aliases import State
from controller.shared.errors import reason

SYNC_S: Final = 0.4  # between two syncs
RETRY_S: Final = 1.0  # after a failed sync
SLOW_S: Final = 1.0  # with a slower sync, a crash may lose more than a second
HANG_S: Final = 10.0  # timeout for the disk on close
ADVICE: Final = (
    "make room, or look at the disk: what is recorded waits in memory, and is tried again every "
    "second"
)
RECOVER: Final = "`controller recordings`"

_log = logging.getLogger("controller")


class TakenError(RecordingError):
    """The file, or its journal, exists; another name may be free."""


def taken(path: Path) -> bool:
    """Return whether a recording or its journal has this name."""
    return os.path.lexists(path) or os.path.lexists(writer.journal_of(path))


def refuse_taken(path: Path) -> None:
    """Refuse a file that exists (TakenError) or cannot be written (RecordingError)."""
    if os.path.lexists(path):
        raise TakenError(f"{path} exists and is kept as it is; record into another file")
    if os.path.lexists(place := writer.journal_of(path)):
        raise TakenError(
            f"{place} exists: it is being recorded, or a crash left it; record into another "
            f"file, or run {RECOVER}"
        )
    refuse_unwritable(path.parent)


def refuse_unwritable(folder: Path) -> None:
    """Raise RecordingError unless a folder exists and is writable."""
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise RecordingError(f"cannot write into {folder}; record into another folder")


class Recorder:
    """Recorder of a session into a journal, which is sealed into a file on close.

    Attributes:
        path: The file to write.
        origin: Provenance, with the random id of this recording.
        journal: What is recorded; only one thread may append to it.
        problem: The present problem of the disk, "" if there is none; each change is logged.
    """

    def __init__(
        self,
        path: Path,
        origin: Provenance,
        state: State,
        *,
        create: Callable[[Path], JournalFile] = JournalFile,
    ) -> None:
        """Begin a recording after `Pipeline.state()`: its journal is on the disk when this returns.

        The origin's id is replaced, and `create` makes the journal's file.

        Raises:
            TakenError: The file exists.
            RecordingError: Its folder is not writable, or the origin or state is not valid.
        """
        refuse_taken(path)
        self.path, self.problem = path, ""
        self.journal = Journal(origin, state, secrets.token_hex(16))
        self.origin = self.journal.origin
        self._synced = 0  # bytes of the journal that are on the disk
        self._place = writer.journal_of(path)
        try:
            self._file = create(self._place)
            try:
                self.sync()
            except OSError:
                self._file.remove()
                raise
        except FileExistsError:
            raise TakenError(f"{self._place} exists; record into another file") from None
        except OSError as error:
            raise RecordingError(f"cannot write {self._place}: {reason(error)}") from None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def close(self, least_s: float = 0.0) -> Path | None:
        """Return the sealed file, None if shorter than `least_s`, or raise RecordingError."""
        if self._closing.is_set():
            return None
        self._closing.set()
        self._thread.join(HANG_S)
        answers = not self._thread.is_alive()
        recording = decode(bytes(self.journal.data)).recording
        if recording is None or recording.t[-1] - recording.t[0] < least_s:
            if answers:
                self._file.remove()
            return None
        try:
            if not answers:
                raise TimeoutError(errno.ETIMEDOUT, "the disk does not answer")
            place = seal(self.path, recording)
        except (OSError, RecordingError) as error:
            raise RecordingError(self._rescue(recording, error, answers)) from None
        self._file.remove()
        if place != self.path:
            raise RecordingError(f"{self.path} appeared meanwhile; recorded into {place}")
        return place

    def sync(self) -> None:
        """Write new bytes to the journal's file, and wait for the disk.

        Raises:
            OSError: The disk is full or fails. The next call writes the same bytes again, since
                bytes before a failed sync may be lost.
        """
        new = bytes(self.journal.data[self._synced :])  # one step, so no append comes between
        if new:
            self._file.write(self._synced, new)
            self._file.sync()
            self._synced += len(new)

    def _run(self) -> None:
        """Sync until the recorder is closed, and a last time then."""
        wait_s, closing = SYNC_S, False
        while not closing:
            closing = self._closing.wait(wait_s)
            began_s = monotonic()
            try:
                self.sync()
            except OSError as error:
                wait_s, problem = RETRY_S, f"cannot write {self._place}: {reason(error)}; {ADVICE}"
            else:
                wait_s, problem, took_s = SYNC_S, "", monotonic() - began_s
                if took_s > SLOW_S:
                    problem = (
                        f"the disk took {took_s:.1f} s to sync {self._place}; a crash may cost as "
                        "much, so record onto a faster one"
                    )
            if problem and not self.problem:
                _log.warning("%s", problem)
            elif self.problem and not problem:
                _log.info("%s is up to date again", self._place)
            self.problem = problem

    def _rescue(self, recording: Recording, error: Exception, answers: bool) -> str:
        """Seal a session into a temporary folder, beside its journal; return the sentence."""
        problem = str(error)
        if isinstance(error, OSError):
            problem = f"cannot write {self.path}: {reason(error)}"
        if answers:
            self._file.close()
        with contextlib.suppress(OSError, RecordingError):
            folder = Path(tempfile.mkdtemp(prefix="orbtouch-"))  # private, with a random name
            place = seal(folder / self.path.name, recording)
            return f"{problem}; the session is kept in {place}"
        return f"{problem}; what the disk took is in {self._place}: make room, {RECOVER}"
