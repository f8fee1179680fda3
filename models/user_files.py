"""Files that a user names: read at a bounded cost, and refused in one sentence."""

from pathlib import Path
from typing import Any, Final

from controller import config, files
from controller.errors import UserError, reason

MAX_BYTES: Final = 64 << 20  # of a report, a page, a list of games: ours have a few megabytes


class UserFileError(UserError, ValueError):
    """A file cannot be read or written; the message is one sentence that names it."""


def read_text(path: Path, limit_bytes: int = MAX_BYTES) -> str:
    """Return the text in a file.

    Raises:
        UserFileError: It cannot be read, is no regular file, too large, or no text in UTF-8.
    """
    try:
        return files.read_text(path, limit_bytes)
    except OSError as error:
        raise UserFileError(f"cannot read {path}: {reason(error)}") from None


def read_json(path: Path, limit_bytes: int = MAX_BYTES) -> Any:
    """Return the value in a JSON file.

    Raises:
        UserFileError: As `read_text`, or it is no JSON; the message has the line.
    """
    try:
        return config.parse_json(read_text(path, limit_bytes), limit_bytes)
    except config.ConfigError as error:
        raise UserFileError(f"{path}, {error}") from None


def target(path: Path) -> Path:
    """Return the path of a file that is going to be written.

    Raises:
        UserFileError: No file can be written there: its folder is missing, or it is a folder or a
            device itself.
    """
    try:
        files.check_target(path)
    except OSError as error:
        raise UserFileError(f"cannot write {path}: {reason(error)}") from None
    if not path.parent.is_dir():
        raise UserFileError(f"cannot write {path}: {path.parent} is no directory; make it first")
    return path


def bundle_target(path: Path) -> Path:
    """Return the path of a bundle that is going to be written.

    Raises:
        UserFileError: As `target`, or the name does not end in .orb.
    """
    if path.suffix != ".orb":
        raise UserFileError(f"{str(path)!r} is no name of a bundle; name one that ends in .orb")
    return target(path)


def folder_target(path: Path) -> Path:
    """Return the path of a folder that is going to be written into; it is made if need be.

    Raises:
        UserFileError: It cannot be made, or is something else.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserFileError(
            f"cannot write into {path}: {reason(error)}; choose another --out"
        ) from None
    return path


def write_text(path: Path, text: str) -> None:
    """Write a text file, complete or not at all.

    Raises:
        OSError: It cannot be written; an older file is as it was.
    """
    files.atomic_write(path, text.encode())
