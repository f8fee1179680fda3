"""Zip files in one form only: the same parts make the same bytes, and no other bytes are read.

Any tool can open them: parts stored uncompressed, one after the other, no dates, no comments.
A reader packs what it found once more and compares, so a bit that changed anywhere is found,
even where zip itself would not look. We write the records ourselves because `zipfile` promises
no particular bytes.
"""

import hashlib
import stat
import zlib
from collections.abc import Iterator, Mapping, Sequence

from controller.unzip import CENTRAL, END, LOCAL

_SIZE, _LENGTH = 7, 9  # fields of the local header: of the part, of its name
_MOST = 64  # parts
_VERSION, _NO_FLAGS, _STORED, _MIDNIGHT, _1980 = 20, 0, 0, 0, 0x21
_UNIX, _FILE = 3 << 8, (stat.S_IFREG | 0o644) << 16


class ArchiveError(ValueError):
    """The bytes are not what `pack` writes."""


def pack(parts: Mapping[str, bytes]) -> bytes:
    """Return the one zip file that these parts make, in this order."""
    return b"".join(_pieces(parts))


def _pieces(parts: Mapping[str, bytes]) -> Iterator[bytes]:
    """Yield that file piece by piece: each part's header and its bytes, then the directory."""
    directory, offset = bytearray(), 0
    for name, data in parts.items():
        title, crc, size = name.encode(), zlib.crc32(data), len(data)
        common = (_VERSION, _NO_FLAGS, _STORED, _MIDNIGHT, _1980, crc, size, size, len(title), 0)
        rest = (0, 0, 0, _FILE, offset)
        directory += CENTRAL.pack(b"PK\1\2", _UNIX | _VERSION, *common, *rest) + title
        header = LOCAL.pack(b"PK\3\4", *common) + title
        yield header
        yield data
        offset += len(header) + size
    yield bytes(directory)
    yield END.pack(b"PK\5\6", 0, 0, len(parts), len(parts), len(directory), offset, 0)


def names(data: bytes) -> tuple[str, ...]:
    """Return the names of the parts, as the file says; whether it is whole `unpack` finds out.

    Raises:
        ArchiveError: It does not begin like anything that `pack` writes.
    """
    found: list[str] = []
    offset = 0
    while data[offset : offset + 4] == b"PK\3\4" and len(data) >= offset + LOCAL.size:
        header = LOCAL.unpack_from(data, offset)
        size, length = header[_SIZE], header[_LENGTH]
        offset += LOCAL.size
        title = data[offset : offset + length]
        if not title.isascii() or len(found) == _MOST:
            break
        found.append(title.decode())
        offset += length + size
    if not found:
        raise _damaged()
    return tuple(found)


def unpack(data: bytes, names: Sequence[str]) -> dict[str, bytes]:
    """Return the parts of these names, in this order.

    Raises:
        ArchiveError: The file is not exactly what `pack` makes of such parts.
    """
    parts: dict[str, bytes] = {}
    offset = 0
    for name in names:
        start = offset + LOCAL.size + len(name.encode())
        if len(data) < start:
            raise _damaged()
        offset, size = start, LOCAL.unpack_from(data, offset)[_SIZE]
        parts[name] = data[start : start + size]
        offset += size
    at = 0
    for piece in _pieces(parts):
        if not data.startswith(piece, at):
            raise _damaged()
        at += len(piece)
    if at != len(data):
        raise _damaged()
    return parts


def _damaged() -> ArchiveError:
    return ArchiveError("is damaged, or something else; copy it again from where it came")


def sums(parts: Mapping[str, bytes], but: str) -> bytes:
    """Return the SHA-256 of every part but one, as the sha256sum tool writes and checks them."""
    lines = [
        f"{hashlib.sha256(data).hexdigest()}  {name}\n"
        for name, data in parts.items()
        if name != but
    ]
    return "".join(lines).encode()
