"""Recover what a crash has left: a journal becomes the recording that it would have become.

Nothing is removed before what replaces it is on the disk and was read again, so recovery may be
interrupted anywhere and simply begins anew.
"""

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

from controller.console import count
from controller.files import sync_folder
from controller.recordings import journal_disk, journal_repair, naming
from controller.recordings.journal import BLOCK, MAX_BYTES
from controller.recordings.journal_repair import Report
from controller.recordings.naming import DAMAGED, JOURNAL, SEALED
from controller.recordings.recording import RecordingError
from controller.recordings.sealing import seal

_CHUNK: Final = 1 << 20


class LockedError(RecordingError):
    """The journal is being written; whoever has it will seal it."""


@dataclass(frozen=True)
class Recovered:
    """What became of a journal.

    Attributes:
        journal: Where it was.
        path: The recording; None if the journal held no frame.
        seconds: From the recording's first frame to its last.
        report: What of the journal was whole.
        damaged: Where the journal is kept, as more may be in it; None if it was removed.
    """

    journal: Path
    path: Path | None
    seconds: float
    report: Report
    damaged: Path | None

    def __str__(self) -> str:
        """Return one line for people."""
        r = self.report
        if self.path is None:
            told = f"{self.journal} held no frame"
        else:
            told = f"recovered {count(r.frames, 'frame')} ({self.seconds:.1f} s) into {self.path}"
        if r.damaged_bytes:
            told += f"; {count(r.damaged_bytes, 'byte')} of the journal damaged"
        if r.lost_records:
            told += f", {count(r.lost_records, 'record')} lost"
        if r.left_out:
            told += f"; {count(r.left_out, 'record')} after a gap left out"
        return f"{told}; the journal is kept as {self.damaged}" if self.damaged else told


def leftovers(folder: Path) -> list[Path]:
    """Return the journals in a folder, by name; some may still be written."""
    if not folder.is_dir():
        return []
    return sorted(
        path for path in folder.iterdir() if path.name.endswith(JOURNAL) and _is_file(path)
    )


def recover(journal: Path) -> Recovered:
    """Seal what is whole in a journal, then remove it, or keep it aside if it was damaged.

    Raises:
        LockedError: It is being written.
        RecordingError: It holds nothing that can be read, or the recording cannot be written; the
            journal is kept as it is.
    """
    if not journal.exists():
        raise RecordingError(f"there is no journal {journal}; name one, or a folder")
    try:
        with _held(journal) as file:
            return _recovered(journal, file)
    except LockedError:
        raise
    except OSError as error:
        problem = f"cannot be recovered: {error.strerror or error}"
        advice = "try again when that is mended"
    except RecordingError as error:
        problem, advice = str(error), "delete it if you do not need it"
    raise RecordingError(f"the journal {journal} {problem}; it is kept as it is, {advice}")


def _recovered(journal: Path, file: IO[bytes]) -> Recovered:
    decoded = journal_repair.decode(_read(file))
    recording, report = decoded.recording, decoded.report
    path, seconds = None, 0.0
    if recording is not None:
        stem = journal.name.partition(JOURNAL)[0]
        path = seal(journal.with_name(stem + SEALED), recording)
        seconds = float(recording.t[-1] - recording.t[0])
    damaged = journal
    if journal.name.endswith(JOURNAL):  # anything else was named by hand, and stays
        if sys.platform == "win32":  # which moves and deletes no open file
            file.close()
        if report.damaged_bytes or report.left_out:
            damaged = _set_aside(journal)
        else:
            journal_disk.remove(journal)
            return Recovered(journal, path, seconds, report, None)
    return Recovered(journal, path, seconds, report, damaged)


def _set_aside(journal: Path) -> Path:
    """Give a damaged journal a name that no recovery looks for; return it."""
    for place in naming.alternatives(journal.with_name(journal.name + DAMAGED)):
        try:
            os.link(journal, place)  # unlike rename, never replaces
        except FileExistsError:
            if not place.samefile(journal):  # else an interrupted recovery was here
                continue
        except OSError:  # a file system without links
            if os.path.lexists(place):
                continue
            journal.rename(place)
            return place
        sync_folder(place.parent)
        journal_disk.remove(journal)
        return place
    raise AssertionError("names have no end")


@contextmanager
def _held(journal: Path) -> Iterator[IO[bytes]]:
    """Open a journal that nobody else may touch until it is closed."""
    if not os.path.lexists(journal):
        raise RecordingError("does not exist")
    if not _is_file(journal):
        raise RecordingError("is not a file")
    with journal.open("r+b", buffering=0) as file:
        try:
            journal_disk.lock(file)
        except BlockingIOError:
            raise LockedError(
                f"the journal {journal} is being recorded; it is sealed when that program ends"
            ) from None
        if not (journal.exists() and os.path.samestat(os.fstat(file.fileno()), journal.stat())):
            raise RecordingError("has been sealed meanwhile")
        yield file


def _is_file(path: Path) -> bool:
    """Whether this is a plain file: nothing that waits for a writer, and no link elsewhere."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except FileNotFoundError:  # sealed since its name was read
        return False


def _read(file: IO[bytes]) -> bytes:
    """Return the bytes of a journal; blocks that the disk cannot read are zeros.

    Raises:
        RecordingError: There are more than a journal has.
    """
    size = file.seek(0, os.SEEK_END)
    if size > MAX_BYTES:
        raise RecordingError(f"has {size} bytes, more than the {MAX_BYTES} allowed")
    data = bytearray()
    step = _CHUNK
    while len(data) < size:
        file.seek(len(data))
        try:
            data += (chunk := file.read(min(step, size - len(data))))
        except OSError:
            if step == BLOCK:
                data += bytes(min(BLOCK, size - len(data)))
            step = BLOCK
            continue
        if not chunk:
            break
    return bytes(data)
