"""Folders that several programs change: their lock, and what killed programs left in them."""

import contextlib
import errno
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final

LOCK: Final = ".lock"
WAIT_S: Final = 10.0  # for another program's change; each takes milliseconds
AGE_S: Final = 600.0  # after which a temporary file is no one's; learning takes two minutes at most
# Files that replace others (`files.atomic_write`), and bundles that are learned or corrected.
TEMPORARY: Final = re.compile(r"\..+\.[0-9a-f]{8}|(taught|corrected)-\d+\.orb")
_POLL_S: Final = 0.01
_LOCK_AT: Final = 1 << 40  # Windows refuses to read locked bytes; this offset is beyond the end


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which is made; OSError if it is not free within WAIT_S.

    A program that is killed frees it. A file system without locks has none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("ab") as file:
        until_s = time.monotonic() + WAIT_S
        while True:
            try:
                lock(file)
            except BlockingIOError:
                if time.monotonic() > until_s:
                    busy = "another program changes it; try again in a moment"
                    raise OSError(errno.EBUSY, busy, str(folder)) from None
                time.sleep(_POLL_S)
            except OSError:
                break
            else:
                break
        yield


def lock(file: IO[bytes], *, wait: bool = False) -> None:
    """Lock a file until it is closed or the process ends.

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


def is_free(path: Path) -> bool:
    """Return whether no program has locked a file."""
    try:
        with path.open("ab") as file:
            lock(file)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def sweep(folder: Path, *, age_s: float = AGE_S) -> int:
    """Delete temporary files of a folder that are older; return their number."""
    count, now_s = 0, time.time()
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            with contextlib.suppress(OSError):
                old = now_s - path.lstat().st_mtime >= age_s
                if TEMPORARY.fullmatch(path.name) and old:
                    path.unlink()
                    count += 1
    return count
