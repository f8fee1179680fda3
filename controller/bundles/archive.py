"""Canonical zip files: the same parts give the same bytes, and no other bytes are accepted.

Parts are stored uncompressed, one after the other, without dates and comments. The reader packs
the parts again and compares the bytes, so any changed bit is detected.
"""

import hashlib
import io
import stat
import zipfile
from collections.abc import Mapping
from typing import Final

from controller.npz import DAMAGE, ZipError, open_zip

MAX_PARTS: Final = 64
_UNIX: Final = 3  # system that made the file: APPNOTE.TXT, 4.4.2
_FILE: Final = (stat.S_IFREG | 0o644) << 16


class ArchiveError(ValueError):
    """The bytes are not a file that `pack` writes."""


def pack(parts: Mapping[str, bytes]) -> bytes:
    """Return the canonical zip file of these parts, in this order."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, data in parts.items():
            info = zipfile.ZipInfo(name)  # dated 1980, the first date of the format
            info.create_system, info.external_attr = _UNIX, _FILE
            file.writestr(info, data)
    return buffer.getvalue()


def unpack(data: bytes) -> dict[str, bytes]:
    """Return the parts by name, in the order of the file.

    Raises:
        ArchiveError: The file is not exactly what `pack` makes of such parts.
    """
    try:
        with open_zip(io.BytesIO(data), len(data), MAX_PARTS) as file:
            parts = {name: file.read(name) for name in file.namelist()}
            intact = pack(parts) == data
    except (*DAMAGE, ZipError, UnicodeError):  # the last: in a name
        intact = False
    if not intact:
        raise ArchiveError("is damaged, or something else; copy it again from where it came")
    return parts


def sums(parts: Mapping[str, bytes], but: str) -> bytes:
    """Return the SHA-256 of every part but one, in the format of the sha256sum tool."""
    lines = [
        f"{hashlib.sha256(data).hexdigest()}  {name}\n"
        for name, data in parts.items()
        if name != but
    ]
    return "".join(lines).encode()
