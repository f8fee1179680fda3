"""The disk under a journal: the one file that writes, syncs and locks one."""

import contextlib
import sys
from pathlib import Path
from typing import IO, Protocol

from controller.files import sync, sync_folder
from controller.recordings.writer import write_beside

_LOCK_AT = 1 << 40  # Windows locks bytes, and locked ones cannot be read: one far behind the end


class JournalFile(Protocol):
    """A journal that is being written; nobody else may touch it meanwhile."""

    def write(self, offset: int, data: bytes) -> int:
        """Write at an offset; return how many bytes were taken, perhaps not all.

        Raises:
            OSError: The disk is full or fails.
        """

    def sync(self) -> None:
        """Return when all that was written is on the disk itself.

        Raises:
            OSError: It is not; what was written since the last sync may be lost.
        """

    def close(self) -> None:
        """Let go of the file, which stays."""

    def remove(self) -> None:
        """Let go of the file, and delete it if that is possible."""


class Disk(Protocol):
    """Where journals and recordings are put."""

    def create(self, path: Path) -> JournalFile:
        """Create a journal's file, which must not exist, and lock it.

        Raises:
            FileExistsError: It exists.
            OSError: It cannot be created.
        """

    def seal(self, path: Path, data: bytes) -> None:
        """Write a whole file that must not exist.

        Raises:
            FileExistsError: It exists.
            OSError: It cannot be written.
        """


class RealDisk:
    """The file system."""

    def create(self, path: Path) -> JournalFile:
        """Create a journal's file and have its name on the disk as well."""
        return _RealFile(path)

    def seal(self, path: Path, data: bytes) -> None:
        """Write a whole file under its name, or none."""
        write_beside(path, data)


class _RealFile:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = path.open("xb", buffering=0)
        with contextlib.suppress(OSError):  # a file system without locks
            lock(self._file, wait=True)  # a recovery may be looking at it just now
        sync_folder(path.parent)

    def write(self, offset: int, data: bytes) -> int:
        self._file.seek(offset)
        return self._file.write(data) or 0

    def sync(self) -> None:
        sync(self._file.fileno())

    def close(self) -> None:
        with contextlib.suppress(OSError):  # a disk that was pulled
            self._file.close()

    def remove(self) -> None:
        if sys.platform == "win32":  # which deletes no open file
            self.close()
        remove(self._path)
        self.close()


def remove(path: Path) -> None:
    """Delete a journal, if that is possible; one that stays is found by the next recovery."""
    with contextlib.suppress(OSError):
        path.unlink()
        sync_folder(path.parent)


def lock(file: IO[bytes], *, wait: bool = False) -> None:
    """Take a journal for this process alone, until the file is closed or the process ends.

    Raises:
        BlockingIOError: Another process has it.
        OSError: This file system has no locks.
    """
    if sys.platform == "win32":
        import msvcrt

        place = file.tell()
        file.seek(_LOCK_AT)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            raise BlockingIOError(*error.args) from None
        finally:
            file.seek(place)
    else:
        import fcntl

        fcntl.flock(file.fileno(), fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
