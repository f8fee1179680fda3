"""Read, replace and lock files: regular ones only, of bounded size, and never half written.

Every error is an `OSError` whose `strerror` completes the sentence "cannot read FILE: ...". The
folders of a user's own files are those of platformdirs. A folder that several programs change has a
lock; what killed programs left in it is swept.
"""

import contextlib
import errno
import os
import re
import stat
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final

import platformdirs

_APPLICATION: Final = "orbtouch"
_NO_WAITING: Final = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
_PIECE: Final = 1 << 20  # bytes that are read at once
_KINDS: Final = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
LOCK: Final = ".lock"
WAIT_S: Final = 10.0  # for another program's change; each takes milliseconds
AGE_S: Final = 600.0  # after which a temporary file is no one's; learning takes two minutes at most
# Files that replace others (`atomic_write`), and bundles that are learned or corrected.
TEMPORARY: Final = re.compile(r"\..+\.[0-9a-f]{8}|(taught|corrected)-\d+\.orb")
_POLL_S: Final = 0.01
_LOCK_AT: Final = 1 << 40  # Windows refuses to read locked bytes; this offset is beyond the end


def data_folder() -> Path:
    """Return the folder of what is kept for good: bundles."""
    return platformdirs.user_data_path(_APPLICATION, appauthor=False)


def state_folder() -> Path:
    """Return the folder of what can be measured again: calibrations, hosts."""
    return platformdirs.user_state_path(_APPLICATION, appauthor=False)


def config_folder() -> Path:
    """Return the folder of what the user chose: the host's devices."""
    return platformdirs.user_config_path(_APPLICATION, appauthor=False)


def shipped(name: str) -> Path:
    """Return a folder of the project, such as "docs"; in a wheel these are in `assets`."""
    root = Path(__file__).resolve().parents[2]
    packed = root / "assets" / name
    return packed if packed.is_dir() else root / name


def open_regular(path: Path) -> IO[bytes]:
    """Open a regular file for reading, or raise OSError: pipes and devices may never end."""
    try:
        handle = os.open(path, os.O_RDONLY | _NO_WAITING)
    except ValueError as error:  # a zero byte in the name
        raise OSError(errno.EINVAL, str(error), str(path)) from None
    except OSError as error:
        if error.errno == errno.ENXIO:  # so Linux answers for a socket
            error.strerror = "it is a socket, expected is a file"
        raise
    mode = os.fstat(handle).st_mode
    if not stat.S_ISREG(mode):
        os.close(handle)
        raise _special(mode, path)
    return os.fdopen(handle, "rb")


def read_bytes(path: Path, limit_bytes: int) -> bytes:
    """Return the content of a regular file; OSError if it has more than `limit_bytes`, too."""
    data = bytearray()
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        while size <= limit_bytes and (piece := file.read(_PIECE)):
            data += piece
            size = max(size, len(data))
    if size > limit_bytes:
        raise OSError(errno.EFBIG, f"it has more than {limit_bytes} bytes", str(path))
    return bytes(data)


def read_text(path: Path, limit_bytes: int) -> str:
    """Return the text of a regular file in UTF-8, without a byte order mark, or raise OSError."""
    try:
        return read_bytes(path, limit_bytes).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise OSError(errno.EILSEQ, "it is not text in UTF-8", str(path)) from None


def check_target(path: Path) -> None:
    """Raise OSError if a name is that of a folder, a device or the like, which is not replaced."""
    with contextlib.suppress(FileNotFoundError):
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            raise _special(mode, path)


def atomic_write(
    path: Path, data: bytes, *, private: bool = False, replace: bool = True, folders: bool = True
) -> None:
    """Write a file so that its name never stands for half of it, whatever ends the program.

    The data goes to a new file in the same folder, to the disk, and then to its name. The file's
    permissions follow the user's umask; if `private`, only the user may read it. `folders` makes
    those that are missing.

    Raises:
        FileExistsError: The name is taken, and `replace` is false.
        OSError: It cannot be written, or is no file; what was there is as it was. `filename` is
            `path`.
    """
    check_target(path)
    beside = path.with_name(f".{path.name[:100]}.{os.urandom(4).hex()}")
    try:
        if folders:
            path.parent.mkdir(parents=True, exist_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        with os.fdopen(os.open(beside, flags, 0o600 if private else 0o666), "wb") as file:
            file.write(data)
            file.flush()
            sync(file.fileno())
        if replace:
            beside.replace(path)
        else:
            _name_once(beside, path)
    except OSError as error:
        error.filename, error.filename2 = str(path), None
        raise
    finally:
        with contextlib.suppress(OSError):
            beside.unlink()
    sync_folder(path.parent)


def sync(handle: int) -> None:
    """Return when the file is on the disk itself, or raise OSError."""
    os.fsync(handle)
    if sys.platform == "darwin":  # whose fsync leaves data in the drive's own memory
        import fcntl

        with contextlib.suppress(OSError):  # a drive that has no such thing
            fcntl.fcntl(handle, fcntl.F_FULLFSYNC)


def sync_folder(folder: Path) -> None:
    """Put a folder's names on the disk, where the system can do that."""
    if os.name != "posix":
        return
    with contextlib.suppress(OSError):  # some network drives refuse; the file itself is on the disk
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


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


def _special(mode: int, path: Path) -> OSError:
    """Return the error that a name is not that of a regular file."""
    kind = next((words for of_kind, words in _KINDS if of_kind(mode)), "something else")
    return OSError(errno.EINVAL, f"it is {kind}, expected is a file", str(path))


def _name_once(beside: Path, path: Path) -> None:
    """Give a file a name that is free."""
    try:
        os.link(beside, path)  # unlike a rename, never replaces
    except FileExistsError:
        raise
    except OSError:  # a file system without links
        if path.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path)) from None
        beside.rename(path)
