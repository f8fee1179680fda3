"""Recovery after a crash: seal a journal into its recording.

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

from controller.errors import count, reason
from controller.files import sync_folder
from controller.recordings import journal_file, naming
from controller.recordings.journal import MAX_BYTES, decode
from controller.recordings.naming import DAMAGED, JOURNAL, SEALED
from controller.recordings.recording import RecordingError
from controller.recordings.writer import seal

_BLOCK: Final = 4096  # bytes; disks lose or keep whole blocks


class LockedError(RecordingError):
    """Another program is recording into the journal, and will seal it."""


@dataclass(frozen=True)
class Recovered:
    """Outcome of one recovery."""

    path: Path | None  # the recording; None if the journal held no frame
    line: str  # the outcome as text

    def __str__(self) -> str:
        return self.line


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
    if not journal.exists():
        raise RecordingError(f"there is no journal {journal}; name one, or a folder")
    try:
        with _locked(journal) as file:
            return _recovered(journal, file)
    except LockedError:
        raise
    except OSError as error:
        problem = f"cannot be recovered: {reason(error)}"
        advice = "try again when that is fixed"
    except RecordingError as error:
        problem, advice = str(error), "delete it if you do not need it"
    raise RecordingError(f"the journal {journal} {problem}; it is kept as it is, {advice}")


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
    journal_file.remove(journal)
    return Recovered(path, line)


def _set_aside(journal: Path) -> Path:
    """Rename a damaged journal so that no recovery finds it; return the new path."""
    names = naming.alternatives(journal.with_name(journal.name + DAMAGED))
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
            journal_file.lock(file)
        except BlockingIOError:
            raise LockedError(
                f"the journal {journal} is being recorded; it is sealed when that program ends"
            ) from None
        if not (journal.exists() and os.path.samestat(os.fstat(file.fileno()), journal.stat())):
            raise RecordingError("has been sealed meanwhile")
        yield file


def _is_file(path: Path) -> bool:
    """Return whether this is a regular file, no link."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except FileNotFoundError:  # sealed since the folder was listed
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
