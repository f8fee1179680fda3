"""The player's files: where they are, how they are read at a bounded cost, and how replaced whole.

Every error of reading and writing is an `OSError` whose `strerror` completes the sentence "cannot
read FILE: ..." or "cannot write FILE: ...".
"""

import errno
import os
import stat
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final, TypeVar

import platformdirs

Content = TypeVar("Content")

_NO_WAITING: Final = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
# A file with one of these has what this program never wrote; it can be put aside.
_DAMAGES: Final = (errno.EINVAL, errno.EFBIG, errno.EILSEQ)


# -- where they are ----------------------------------------------------------------------------


def data_folder() -> Path:
    """Return the folder of best lists and replays; it may not exist yet."""
    return platformdirs.user_data_path("orbtouch", appauthor=False) / "tetris"


def config_folder() -> Path:
    """Return the folder of settings; it may not exist yet."""
    return platformdirs.user_config_path("orbtouch", appauthor=False) / "tetris"


# -- reading -----------------------------------------------------------------------------------


def read_bytes(path: Path, limit_bytes: int) -> bytes:
    """Return the content of a regular file. Pipes and devices are refused: they may never end.

    Raises:
        OSError: It cannot be read, is not a regular file, or has more than `limit_bytes`.
    """
    try:
        handle = os.open(path, os.O_RDONLY | _NO_WAITING)
    except ValueError as error:  # a zero byte in the name
        raise OSError(errno.EINVAL, str(error), str(path)) from None
    try:
        _check_regular(os.fstat(handle).st_mode, path)
        with open(handle, "rb", closefd=False) as file:
            data = file.read(limit_bytes + 1)
    finally:
        os.close(handle)
    if len(data) > limit_bytes:
        raise OSError(errno.EFBIG, f"it has more than {limit_bytes} bytes", str(path))
    return data


# -- writing -----------------------------------------------------------------------------------


def write_beside(path: Path, content: bytes) -> None:
    """Write a whole file: beside the old one, onto the disk, and then in its place.

    Folders that are missing are made. A pipe or a device is never replaced.

    Raises:
        OSError: The disk is full, or the folder may not be written; the old file is as it was.
    """
    try:
        _check_regular(path.stat().st_mode, path)
    except FileNotFoundError:
        pass
    except ValueError as error:
        raise OSError(errno.EINVAL, str(error), str(path)) from None
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name[:100]}.", dir=path.parent)
    beside = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def load(path: Path, read: Callable[[Path], Content], usual: Content) -> tuple[Content, str]:
    """Return what `read` makes of the player's file, and a sentence, "" when all is well.

    A damaged file is renamed, so that a new one can take its place; `usual` stands for it.
    """
    try:
        return read(path), ""
    except FileNotFoundError:
        return usual, ""
    except (OSError, ValueError, RecursionError) as error:
        if isinstance(error, OSError) and error.errno not in _DAMAGES:
            return usual, f"cannot read {path}: {error.strerror or error}"
    number = 1
    while (aside := path.with_name(f"{path.stem}-damaged-{number}{path.suffix}")).exists():
        number += 1
    try:
        path.rename(aside)
    except OSError as error:
        return usual, f"{path} is damaged and stays: {error.strerror or error}"
    return usual, f"{path.name} is damaged and was put aside as {aside.name}"


def _check_regular(mode: int, path: Path) -> None:
    if not stat.S_ISREG(mode):
        number = errno.EISDIR if stat.S_ISDIR(mode) else errno.EINVAL
        raise OSError(number, "it is no regular file", str(path))


def _sync_folder(folder: Path) -> None:
    """Make a rename last through a power cut, where folders can be opened (not on Windows)."""
    with suppress(OSError):  # some network drives refuse; the file itself is safe
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
