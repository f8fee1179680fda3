"""Files of results: text and JSON read at a bounded cost and written whole; dataclasses as JSON.

A file that cannot be used is refused in one sentence that names it.
"""

import json
import math
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any, Final

from controller.shared import config, files
from controller.shared.errors import UserError, reason
from controller.shared.notices import Notice, packed

MAX_BYTES: Final = 64 << 20  # of a report, a page, a list of games: ours have a few megabytes
DIGITS: Final = 6  # of numbers in JSON, after the point


class UserFileError(UserError, ValueError):
    """A file cannot be read or written; the message is one sentence that names it."""


def read_text(path: Path, limit_bytes: int = MAX_BYTES) -> str:
    """Return the text in a regular file in UTF-8; raise UserFileError for any other."""
    try:
        return files.read_text(path, limit_bytes)
    except OSError as error:
        raise UserFileError(f"cannot read {path}: {reason(error)}") from None


def read_json(path: Path) -> Any:
    """Return the value in a JSON file; raise UserFileError, with the line, for any other."""
    try:
        return config.parse_json(read_text(path), MAX_BYTES)
    except config.ConfigError as error:
        raise UserFileError(f"{path}, {error}") from None


def target(path: Path) -> Path:
    """Return the path of a file to write; raise UserFileError if none can be written there."""
    try:
        files.check_target(path)
    except OSError as error:
        raise UserFileError(f"cannot write {path}: {reason(error)}") from None
    if not path.parent.is_dir():
        raise UserFileError(f"cannot write {path}: {path.parent} is no directory; make it first")
    return path


def bundle_target(path: Path) -> Path:
    """Return the path of a bundle to write; raise UserFileError if it cannot be, or is not .orb."""
    if path.suffix != ".orb":
        raise UserFileError(f"{str(path)!r} is no name of a bundle; name one that ends in .orb")
    if target(path).is_file() and not zipfile.is_zipfile(path):
        raise UserFileError(f"{path} is there and no bundle; name another file, or remove it")
    return path


def write_text(path: Path, text: str) -> None:
    """Write a text file, complete or not at all; an OSError leaves the older file."""
    files.atomic_write(path, text.encode())


def write_json(path: Path, value: Any) -> None:
    """Write a value as a JSON file; NaN and infinities become null."""
    write_text(path, f"{json_text(value)}\n")


def read_tables(path: Path, *names: str) -> dict[str, Any] | None:
    """Return results that `write_json` wrote, with some tables by name; None if there are none."""
    if not target(path).exists():  # refused now, not when the first result is written
        return None
    found = read_json(path)
    if isinstance(found, dict) and all(isinstance(found.get(name), dict) for name in names):
        return found
    raise UserFileError(
        f"{path} holds no results of this command; remove it, or choose another DIR"
    )


def json_text(value: Any) -> str:
    """Return dataclasses, mappings and sequences as the text of a JSON file."""
    return json.dumps(plain(value), indent=1, allow_nan=False, ensure_ascii=False)


def plain(value: Any) -> Any:
    """Return dataclasses and mappings as dictionaries, sequences as lists, numbers rounded."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Notice):
        return packed(value)
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return round(value, DIGITS) if math.isfinite(value) else None
    return value
