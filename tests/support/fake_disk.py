"""A journal's file on a disk that fills, fails, hangs, and loses unsynced blocks."""

import errno
import threading
from collections.abc import Callable
from pathlib import Path

from controller.recordings.journal_file import JournalFile

BLOCK = 4096
PATIENCE_S = 20.0  # the longest that any test waits for a thread


class FakeFile(JournalFile):
    """A journal's file: `seen` is what programs read, `kept` is what a power cut leaves."""

    def __init__(self, path: Path = Path()) -> None:
        self.seen = bytearray()
        self.kept = bytearray()
        self.dirty: set[int] = set()  # blocks that have yet to reach the disk
        self.room = 1 << 40  # bytes until the disk is full
        self.fails = False  # every sync
        self.syncs = 0
        self.removed = self.closed = False
        self.meanwhile: Callable[[], None] = lambda: None  # what happens while a sync takes time
        self.answers = threading.Event()  # a disk that hangs has it cleared
        self.answers.set()
        self._changed = threading.Condition()

    def write(self, offset: int, data: bytes) -> None:
        taken = min(len(data), self.room - offset)
        if taken > 0:
            self.seen[offset : offset + taken] = data[:taken]
            self.dirty |= set(range(offset // BLOCK, (offset + taken - 1) // BLOCK + 1))
        if taken < len(data):
            raise OSError(errno.ENOSPC, "No space left on device")

    def sync(self) -> None:
        assert self.answers.wait(PATIENCE_S)
        with self._changed:
            blocks = sorted(self.dirty)
            self.meanwhile()
            if self.fails:  # as Linux does it: the next sync succeeds, and the data is gone
                self.dirty.clear()
                raise OSError(errno.EIO, "Input/output error")
            self.write_back(blocks)
            self.syncs += 1
            self._changed.notify_all()

    def write_back(self, blocks: list[int]) -> None:
        """Bring some blocks to the disk, in whatever order, as a system does when it likes."""
        for block in blocks:
            start, end = block * BLOCK, min((block + 1) * BLOCK, len(self.seen))
            self.kept.extend(bytes(max(0, end - len(self.kept))))
            self.kept[start:end] = self.seen[start:end]
            self.dirty.discard(block)

    def until(self, done: Callable[[], bool]) -> None:
        """Wait until something is true after a sync."""
        with self._changed:
            assert self._changed.wait_for(done, PATIENCE_S)

    def close(self) -> None:
        self.closed = True

    def remove(self) -> None:
        self.removed = self.closed = True
