"""File of a crash journal: locked while it is recorded, sealed into its recording after a crash.

Nothing is removed before its replacement is on the disk and was read again, so an interrupted
recovery can be repeated.
"""

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

from controller.recordings import writer
from controller.recordings.journal import MAX_BYTES, decode
from controller.recordings.recording import RecordingError
from controller.recordings.writer import DAMAGED, JOURNAL, SEALED, seal
from controller.shared.errors import count, reason
from controller.shared.files import lock, sync, sync_folder

_BLOCK: Final = 4096  # bytes; disks lose or keep whole blocks


class LockedError(RecordingError):
    """Another program is recording into the journal, and will seal it."""


class JournalFile:
    """A journal's file, locked until it is closed."""

    def __init__(self, path: Path) -> None:
        """Create the file, and sync its folder; OSError if it exists or cannot be created."""
        self._path = path
        self._file = path.open("xb", buffering=0)
        with suppress(OSError):  # a file system without locks
            lock(self._file, wait=True)  # a recovery may be reading it
        sync_folder(path.parent)

    def write(self, offset: int, data: bytes) -> None:
        """Write all of `data` at an offset; after an OSError a part may have been written."""
        self._file.seek(offset)
        while data:
            data = data[self._file.write(data) :]

    def sync(self) -> None:
        """Flush to the disk; after an OSError bytes since the last sync may be lost."""
        sync(self._file.fileno())

    def close(self) -> None:
        """Close and unlock the file."""
        with suppress(OSError):  # a removed disk
            self._file.close()

    def remove(self) -> None:
        """Close the file, and delete it if possible."""
        if sys.platform == "win32":  # cannot delete an open file
            self.close()
        remove(self._path)
        self.close()


def remove(path: Path) -> None:
    """Delete a journal, if possible; otherwise the next recovery finds it."""
    with suppress(OSError):
        path.unlink()
        sync_folder(path.parent)


# --- recovery -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Recovered:
    """Outcome of one recovery."""

    path: Path | None  # the recording; None if the journal held no frame
    line: str  # the outcome as text


def leftovers(folder: Path) -> list[Path]:
    """Return the journals in a folder, by name; some may be in use."""
    if not folder.is_dir():
        return []
    return sorted(
        path for path in folder.iterdir() if path.name.endswith(JOURNAL) and _is_file(path)
    )


def recover(journal: Path) -> Recovered:
    """Seal a journal, then remove it, or rename it if it is damaged.

    Raises:
        LockedError: Another program is recording into it.
        RecordingError: It is not readable, or the recording cannot be written; it is kept.
    """
    try:
        with _locked(journal) as file:
            return _recovered(journal, file)
    except LockedError:
        raise
    except OSError as error:
        problem = f"cannot be recovered: {reason(error)}"
    except RecordingError as error:
        problem = str(error)
    raise RecordingError(
        f"the journal {journal} {problem}; it is kept as it is: try again when that is fixed, or "
        "delete it if you do not need it"
    )


def _recovered(journal: Path, file: IO[bytes]) -> Recovered:
    size = file.seek(0, os.SEEK_END)
    decoded = decode(_read(file, size))
    unread = size - decoded.whole_bytes
    unread = unread if unread >= decoded.frame_bytes else 0  # less: an incomplete record
    path, line = None, f"{journal} held no frame"
    if (recording := decoded.recording) is not None:
        stem = journal.name.partition(JOURNAL)[0]
        path = seal(journal.with_name(stem + SEALED), recording)
        seconds = float(recording.t[-1] - recording.t[0])
        frames = count(len(recording.t), "frame")
        line = f"recovered {frames} ({seconds:.1f} s) into {path}"
    if unread:
        line += f"; its last {count(unread, 'byte')} follow a damaged record"
    if not journal.name.endswith(JOURNAL):  # another name, given by the user, is kept
        return Recovered(path, f"{line}; the journal is kept as {journal}")
    if sys.platform == "win32":  # cannot move or delete an open file
        file.close()
    if unread:
        return Recovered(path, f"{line}; the journal is kept as {_set_aside(journal)}")
    remove(journal)
    return Recovered(path, line)


def _set_aside(journal: Path) -> Path:
    """Rename a damaged journal so that no recovery finds it; return the new path."""
    names = writer.alternatives(journal.with_name(journal.name + DAMAGED))
    place = next(name for name in names if not os.path.lexists(name))
    journal.rename(place)
    sync_folder(place.parent)
    return place


@contextmanager
def _locked(journal: Path) -> Iterator[IO[bytes]]:
    """Open a journal, locked against recorders and other recoveries until it is closed."""
    if not _is_file(journal):
        raise RecordingError("is not a file")
    with journal.open("r+b", buffering=0) as file:
        try:
            lock(file)
        except BlockingIOError:
            raise LockedError(
                f"the journal {journal} is being recorded; it is sealed when that program ends"
            ) from None
        if not (journal.exists() and os.path.samestat(os.fstat(file.fileno()), journal.stat())):
            raise RecordingError("has been sealed meanwhile")
        yield file


def _is_file(path: Path) -> bool:
    """Return whether this is a regular file, no link."""
    with suppress(FileNotFoundError):  # sealed since the folder was listed
        return stat.S_ISREG(path.lstat().st_mode)
    return False


def _read(file: IO[bytes], size: int) -> bytes:
    """Return the bytes of a journal up to the first unreadable block."""
    if size > MAX_BYTES:
        raise RecordingError(f"has {size} bytes, more than the {MAX_BYTES} allowed")
    data = bytearray()
    file.seek(0)
    with suppress(OSError):
        while chunk := file.read(_BLOCK):
            data += chunk
    return bytes(data)
