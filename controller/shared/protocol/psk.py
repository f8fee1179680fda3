"""Pre-shared key files: hexadecimal digits, readable by their owner only."""

import logging
import os
import secrets
import stat
from pathlib import Path
from typing import Final

from controller.shared.errors import TroubleError, UserError, reason
from controller.shared.files import atomic_write, open_regular

SIZE: Final = 32  # bytes of a new key; a longer one adds no strength to SHA-256
LEAST: Final = 16  # least bytes of a key from elsewhere
_LONGEST: Final = 4096  # bytes of a key file

_log = logging.getLogger("controller")


class KeyFileError(UserError, ValueError):
    """A key file cannot be used or made; the message is one sentence."""


def read(path: Path) -> bytes:
    """Return the key in a file; KeyFileError if it is missing, invalid, or readable by others."""
    try:
        with open_regular(path) as file:
            if os.name == "posix":
                _check_owner(path, os.fstat(file.fileno()))
            content = file.read(_LONGEST + 1)
    except OSError as error:
        raise KeyFileError(
            f"cannot read the key {path}: {reason(error)}; copy the file that the orb was started "
            "with"
        ) from error
    try:
        key = bytes.fromhex(content.decode("ascii")) if len(content) <= _LONGEST else b""
    except ValueError:
        key = b""
    if len(key) < LEAST:
        raise KeyFileError(
            f"{path} is no key: expected are {2 * LEAST} or more hexadecimal digits; "
            "remove it, and `controller --key FILE` makes one"
        )
    return key


def read_or_make(path: Path) -> bytes:
    """Return the key in a file; draw one that only its owner can read if there is no file.

    KeyFileError as of `read`, TroubleError if the file cannot be written.
    """
    try:
        data = (secrets.token_hex(SIZE) + "\n").encode()
        atomic_write(path, data, private=True, replace=False, folders=False)
        _log.info("drew a key into %s; copy it to the host (scp -p keeps it yours)", path)
    except FileExistsError:
        return read(path)
    except OSError as error:
        raise TroubleError(
            f"cannot write the key {path}: {reason(error)}; name another file"
        ) from error
    return read(path)


def _check_owner(path: Path, found: os.stat_result) -> None:
    """Raise unless the file is ours, or root's, and closed to other users."""
    if found.st_mode & 0o077:
        raise KeyFileError(
            f"the key {path} is open to others (mode {stat.S_IMODE(found.st_mode):03o}); "
            f"draw a new one if they may have read it, else: chmod 600 {path}"
        )
    if found.st_uid not in (os.geteuid(), 0):
        raise KeyFileError(f"the key {path} belongs to another user; copy it into a file of yours")
