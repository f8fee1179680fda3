"""Files that a crash cannot leave half written, and damaged ones kept for whoever can mend them."""

import os
import tempfile
from pathlib import Path


def write_beside(path: Path, content: bytes) -> None:
    """Write a whole file at once: beside the old one, onto the disk, and then in its place.

    Whoever reads the path sees the old content or the new one, never a part. Folders that
    are missing are made.

    Raises:
        OSError: The disk is full, or the folder may not be written; the old file is as it was.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
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


def put_aside(path: Path) -> Path:
    """Rename a damaged file, so that a new one can take its place; return where it is now.

    Raises:
        OSError: It cannot be renamed.
    """
    number = 1
    while (aside := path.with_name(f"{path.stem}-damaged-{number}{path.suffix}")).exists():
        number += 1
    return path.rename(aside)


def _sync_folder(folder: Path) -> None:
    """Make a rename last through a power cut, where folders can be opened (not on Windows)."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(handle)
    except OSError:  # some network drives refuse; the file itself is safe
        pass
    finally:
        os.close(handle)
