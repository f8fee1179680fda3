"""Zip files in one form: the same parts make the same bytes, and no other bytes are read.

Parts are stored uncompressed, one after the other, without dates and comments; any tool can open
them. A reader packs what it found once more and compares, so a changed bit anywhere is found.
"""

import hashlib
import io
import stat
import zipfile
from collections.abc import Mapping
from typing import Final

from controller.zip_limits import DAMAGE, ZipError, open_zip

MAX_PARTS: Final = 64
_UNIX: Final = 3  # system that made the file: APPNOTE.TXT, 4.4.2
_FILE: Final = (stat.S_IFREG | 0o644) << 16


class ArchiveError(ValueError):
    """The bytes are not what `pack` writes."""


def pack(parts: Mapping[str, bytes]) -> bytes:
    """Return the one zip file that these parts make, in this order."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, data in parts.items():
            info = zipfile.ZipInfo(name)  # of 1980, the first date that zip knows
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
            whole = pack(parts) == data
    except (*DAMAGE, ZipError, UnicodeError):  # in a name
        whole = False
    if not whole:
        raise ArchiveError("is damaged, or something else; copy it again from where it came")
    return parts


def sums(parts: Mapping[str, bytes], but: str) -> bytes:
    """Return the SHA-256 of every part but one, as the sha256sum tool writes and checks them."""
    lines = [
        f"{hashlib.sha256(data).hexdigest()}  {name}\n"
        for name, data in parts.items()
        if name != but
    ]
    return "".join(lines).encode()
