"""Keep a live session: whatever happens to the program or the computer, a second is lost at most.

Every frame goes into a journal in memory at once. A thread brings the journal's file up to date
and has the disk confirm it twice a second, so the loop never waits for a disk. When the recorder
is closed, the session is sealed into its file, and only then is the journal removed.
"""

import errno
import logging
import os
import secrets
import tempfile
import threading
from pathlib import Path
from time import monotonic
from typing import Final

from controller.recognition.pipeline import CommandRecord, Touch
from controller.recognition.preprocess import Frame, State
from controller.recordings import journal_repair, naming
from controller.recordings.journal import NOWHERE, Journal
from controller.recordings.journal_disk import Disk, RealDisk
from controller.recordings.journal_records import ID_BYTES
from controller.recordings.recorder_thread import JournalThread
from controller.recordings.recording import UNKNOWN, Provenance, Recording, RecordingError
from controller.recordings.sealing import seal

SYNC_S: Final = 0.4  # a frame waits so long for its turn, and then for one write and one sync
RETRY_S: Final = 1.0
SLOW_S: Final = 1.0  # a disk that takes longer for its turn may cost more than a second
HANG_S: Final = 10.0  # a disk that has not answered for so long is not waited for at the end
RECOVER: Final = "`controller recordings recover`"

_log = logging.getLogger("controller")


class TakenError(RecordingError):
    """The file, or its journal, exists; another name may be free."""


def taken(path: Path) -> bool:
    """Return whether a recording or its journal has this name."""
    return os.path.lexists(path) or os.path.lexists(naming.journal_of(path))


def refuse_taken(path: Path) -> None:
    """Refuse a file that cannot be recorded into, without making anything.

    Raises:
        TakenError: It or its journal exists.
        RecordingError: Its folder cannot be written to.
    """
    if os.path.lexists(path):
        raise TakenError(f"{path} exists and is kept as it is; record into another file")
    if os.path.lexists(journal := naming.journal_of(path)):
        raise TakenError(
            f"{journal} exists: it is being recorded, or a crash left it; record into another "
            f"file, or run {RECOVER}"
        )
    refuse_unwritable(path.parent)


def refuse_unwritable(folder: Path) -> None:
    """Refuse a folder in which nothing can be recorded.

    Raises:
        RecordingError: It is none, or cannot be written to.
    """
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise RecordingError(f"cannot write into {folder}; record into another folder")


class Recorder:
    """Gathers a session, keeps it safe, and seals it into a file when it is closed.

    Attributes:
        path: The file it will be sealed into.
        origin: As given, with the id that was drawn for this recording.
    """

    def __init__(
        self, path: Path, origin: Provenance, state: State, *, disk: Disk | None = None
    ) -> None:
        """Begin a recording: its journal is on the disk when this returns.

        Args:
            path: The file to write; must not exist.
            origin: Where the frames come from; a new id is drawn for each recording.
            state: `Pipeline.state()` before the first frame.
            disk: Where to put it.

        Raises:
            TakenError: The file exists.
            RecordingError: Its folder cannot be written to, or no recording can have such an
                origin or state.
        """
        refuse_taken(path)
        self.path = path
        self._disk = disk or RealDisk()
        self._journal = Journal(origin, state, secrets.token_bytes(ID_BYTES))
        self.origin = self._journal.origin
        self._place = naming.journal_of(path)
        self._keeper = self._begin()
        self._problem = ""
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._keep, name="recorder", daemon=True)
        self._thread.start()

    def add(
        self,
        frame: Frame,
        t_s: float,
        number: int,
        *,
        label: int = UNKNOWN,
        button: int = UNKNOWN,
        key: int = UNKNOWN,
        cue: int = UNKNOWN,
        excluded: bool = False,
        touch: Touch | None = None,
        command: CommandRecord | None = None,
    ) -> None:
        """Take one frame, and what was made of it; never waits for the disk.

        Raises:
            RecordingError: The frame could not be read again: its shape, numbers, order or labels
                are impossible. What was taken before is kept.
        """
        with self._keeper.lock:
            who = (label, button, key, cue)
            self._journal.frame(frame, t_s, number, who, excluded, touch or NOWHERE)
            if command is not None:
                self._journal.command(command)

    def mark(self, t_s: float, kind: str, text: str) -> None:
        """Note what happened at a time, in any order; texts are cut after 1000 characters."""
        with self._keeper.lock:
            self._journal.mark(t_s, kind, text)

    def rest(self, frame: Frame) -> None:
        """Note the untouched sensor; the first one counts."""
        with self._keeper.lock:
            self._journal.rest(frame)

    def amend(self, column: str, from_s: float, to_s: float, value: int) -> None:
        """Change a label column, or "excluded", of the frames so far with times in [from, to)."""
        with self._keeper.lock:
            self._journal.amend(column, from_s, to_s, value)

    @property
    def full(self) -> bool:
        """Whether to close this recorder and begin the next; there is room for as much again."""
        return self._journal.full

    @property
    def problem(self) -> str:
        """What is wrong with the disk now, "" if nothing; each change is logged here already."""
        return self._problem

    def close(self, least_s: float = 0.0) -> Path | None:
        """Seal what was gathered; return the file, or None if there was nothing or it was closed.

        Args:
            least_s: What is shorter is not kept.

        Raises:
            RecordingError: The file cannot be written; the message says where the data is.
        """
        if self._closing.is_set():
            return None
        self._closing.set()
        self._thread.join(HANG_S)
        answers = not self._thread.is_alive()
        recording = journal_repair.decode(bytes(self._journal.data)).recording
        if recording is None or recording.t[-1] - recording.t[0] < least_s:
            if answers:
                self._keeper.file.remove()
            return None
        try:
            if not answers:
                raise TimeoutError(errno.ETIMEDOUT, "the disk does not answer")
            place = seal(self.path, recording, self._disk.seal)
        except OSError as error:
            problem = f"cannot write {self.path}: {error.strerror or error}"
            raise RecordingError(self._rescue(recording, problem, answers)) from None
        except RecordingError as error:
            raise RecordingError(self._rescue(recording, str(error), answers)) from None
        self._keeper.file.remove()
        if place != self.path:
            raise RecordingError(f"{self.path} appeared meanwhile; recorded into {place}")
        return place

    def _begin(self) -> JournalThread:
        """Return who keeps the journal; its header is on the disk."""
        try:
            keeper = JournalThread(self._journal, self._disk.create(self._place))
        except FileExistsError:
            raise TakenError(f"{self._place} exists; record into another file") from None
        except OSError as error:
            raise RecordingError(f"cannot write {self._place}: {error.strerror or error}") from None
        try:
            keeper.turn()
        except OSError as error:
            keeper.file.remove()
            raise RecordingError(f"cannot write {self._place}: {error.strerror or error}") from None
        return keeper

    def _keep(self) -> None:
        """Bring the file up to date until the recorder is closed, and then once more."""
        wait_s = SYNC_S
        while True:
            closing = self._closing.wait(wait_s)
            began_s = monotonic()
            try:
                self._keeper.turn()
            except OSError as error:
                wait_s = RETRY_S
                self._tell(self._trouble(error))
            else:
                wait_s = SYNC_S
                self._tell(self._slowness(monotonic() - began_s))
            if closing:
                return

    def _tell(self, problem: str) -> None:
        """Log a change for the worse or the better, once."""
        before, self._problem = self._problem, problem
        if problem and not before:
            _log.warning("%s", problem)
        elif before and not problem:
            _log.info("%s is up to date again", self._place)

    def _slowness(self, took_s: float) -> str:
        if took_s <= SLOW_S:
            return ""
        return (
            f"the disk took {took_s:.1f} s for a moment of {self._place}; a crash may cost as "
            "much, so record onto a faster one"
        )

    def _trouble(self, error: OSError) -> str:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        return (
            f"cannot write {self._place}: {error.strerror or error}; "
            f"{'make room' if full else 'look at the disk'}: what is recorded waits in memory, "
            "and is tried again every second"
        )

    def _rescue(self, recording: Recording, problem: str, answers: bool) -> str:
        """Keep a session that has no place where it should go; return the sentence that says so.

        Its journal, if there is one, stays as well: a temporary folder may not last.
        """
        if answers:
            self._keeper.file.close()
        try:
            folder = Path(tempfile.mkdtemp(prefix="orbtouch-"))  # private, with a name of chance
            try:
                kept = seal(folder / self.path.name, recording)
            except (OSError, RecordingError):
                folder.rmdir()
                raise
        except (OSError, RecordingError):
            if answers and os.path.lexists(self._place):
                return f"{problem}; what the disk took is in {self._place}: make room, {RECOVER}"
            return f"{problem}; the session is lost"
        return f"{problem}; the session is kept in {kept}"
