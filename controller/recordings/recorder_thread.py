"""Bring a journal's file up to date with the journal in memory, turn by turn.

A turn that fails is done again from the last place that the disk has confirmed: after a failed
sync nobody knows what became of anything written since.
"""

import contextlib
import errno
import threading
from typing import Final

from controller.recordings.journal import Journal
from controller.recordings.journal_disk import JournalFile
from controller.recordings.recording import RecordingError

_CHUNK: Final = 1 << 20  # bytes copied while the loop must wait


class JournalThread:
    """Writes a journal to its file.

    Attributes:
        journal: In memory; touched only while holding `lock`.
        file: On the disk.
        lock: Held for moments, never while the disk works.
    """

    def __init__(self, journal: Journal, file: JournalFile) -> None:
        """Begin with an empty file."""
        self.journal = journal
        self.file = file
        self.lock = threading.Lock()
        self._written = self._confirmed = 0  # offsets
        self._idle = 0  # the journal's length when there is nothing to do

    def turn(self) -> None:
        """Write what is new, have it confirmed, and write that it is.

        Raises:
            OSError: The disk is full or fails; everything waits for the next turn.
        """
        with self.lock:
            end = len(self.journal.data)
        if end == self._idle:
            return
        try:
            self._write(end)
            self.file.sync()
            self._confirmed = end
            with self.lock:
                alone = len(self.journal.data) == end
                with contextlib.suppress(RecordingError):  # full: then the next turn goes without
                    self.journal.synced(end)
                after = len(self.journal.data)
            self._idle = after if alone else -1
            self._write(after)
        except OSError:
            self._written = self._confirmed
            self._idle = -1
            raise

    def _write(self, end: int) -> None:
        """Write up to an offset, however little the disk takes at a time."""
        while self._written < end:
            stop = min(end, self._written + _CHUNK)
            with self.lock:
                chunk = bytes(memoryview(self.journal.data)[self._written : stop])
            taken = self.file.write(self._written, chunk)
            if taken <= 0:
                raise OSError(errno.EIO, "the disk takes nothing")
            self._written += taken
