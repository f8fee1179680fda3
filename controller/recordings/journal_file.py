"""File of a crash journal: written at an offset, synced, and locked during the recording."""

import contextlib
import sys
from pathlib import Path
from typing import IO, Final

from controller.files import sync, sync_folder

_LOCK_AT: Final = 1 << 40  # Windows refuses to read locked bytes; this offset is beyond the end


class JournalFile:
    """A journal's file, locked until it is closed."""

    def __init__(self, path: Path) -> None:
        """Create the file, and sync its folder.

        Raises:
            FileExistsError: It exists.
            OSError: It cannot be created.
        """
        self._path = path
        self._file = path.open("xb", buffering=0)
        with contextlib.suppress(OSError):  # a file system without locks
            lock(self._file, wait=True)  # a recovery may be reading it
        sync_folder(path.parent)

    def write(self, offset: int, data: bytes) -> None:
        """Write all of `data` at an offset.

        Raises:
            OSError: The disk is full or fails; a part may have been written.
        """
        self._file.seek(offset)
        while data:
            data = data[self._file.write(data) :]

    def sync(self) -> None:
        """Flush all written bytes to the disk.

        Raises:
            OSError: Bytes written since the last sync may be lost.
        """
        sync(self._file.fileno())

    def close(self) -> None:
        """Close and unlock the file."""
        with contextlib.suppress(OSError):  # a removed disk
            self._file.close()

    def remove(self) -> None:
        """Close the file, and delete it if possible."""
        if sys.platform == "win32":  # cannot delete an open file
            self.close()
        remove(self._path)
        self.close()


def remove(path: Path) -> None:
    """Delete a journal, if possible; otherwise the next recovery finds it."""
    with contextlib.suppress(OSError):
        path.unlink()
        sync_folder(path.parent)


def lock(file: IO[bytes], *, wait: bool = False) -> None:
    """Lock a journal until the file is closed or the process ends.

    Raises:
        BlockingIOError: Another process has locked it.
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
