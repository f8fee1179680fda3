"""Zip files that strangers may have written, as far as `.npz` needs them: stored or deflated.

`zipfile` believes what a directory claims, unpacks by methods that know no bounds, and takes a
tenth of a device's start to import, since it can do so much more. Here the directory is read in one
piece of bounded size, every member in pieces as large as they are asked for, and whatever does not
fit is one `ZipError`. The records are those of the ZIP specification (APPNOTE.TXT, 4.3).
"""

from __future__ import annotations

import io
import struct
import zlib
from dataclasses import dataclass
from typing import IO, Final

STORED, DEFLATED = 0, 8
PIECE: Final = 128 << 10  # bytes that the directory may have, and that are unpacked at once

# The records: a member's local header, its entry in the directory, the end.
LOCAL: Final = struct.Struct("<4s5H3L2H")
CENTRAL: Final = struct.Struct("<4s6H3L5H2L")
END: Final = struct.Struct("<4s4H2LH")

_COMMENT: Final = 0xFFFF  # bytes at the most, behind the end record
_VERSION: Final = 45  # of the specification: what `numpy.savez` asks of a reader
_UTF_8: Final = 0x800  # a flag; without it a name is ASCII, or none of ours


class ZipError(ValueError):
    """The bytes are no whole zip file of the plain kind."""


@dataclass(frozen=True, slots=True)
class Member:
    """One entry of the directory; all of it is a claim until the member was read."""

    name: str
    method: int
    flags: int
    crc: int
    packed: int  # bytes in the file
    size: int  # bytes unpacked
    offset: int  # of the local header

    @property
    def end(self) -> int:
        """The least offset at which the next member can begin."""
        return self.offset + LOCAL.size + self.packed


def directory(file: IO[bytes]) -> tuple[list[Member], int]:
    """Return the members of a zip file, and the offset of their directory, before which they end.

    Raises:
        ZipError: There is none, or one that is larger than `PIECE`.
    """
    length = file.seek(0, io.SEEK_END)
    file.seek(max(0, length - END.size - _COMMENT))
    tail = file.read()
    at = tail.rfind(b"PK\5\6")
    if at < 0 or len(tail) - at < END.size:
        raise ZipError("is not a whole .npz archive")
    _, disk, first_disk, here, count, size, start, comment = END.unpack_from(tail, at)
    if size > PIECE:
        raise ZipError(f"has a zip directory of more than the {PIECE} bytes allowed")
    end = length - len(tail) + at
    if (disk, first_disk, here, comment) != (0, 0, count, len(tail) - at - END.size):
        raise ZipError("is not a whole .npz archive")
    if start + size != end:
        raise ZipError("is not a whole .npz archive")
    file.seek(start)
    return _entries(file.read(size), count), start


def _entries(data: bytes, count: int) -> list[Member]:
    """Return what a directory of so many entries says."""
    members, at = [], 0
    for _ in range(count):
        if len(data) - at < CENTRAL.size:
            raise ZipError("is not a whole .npz archive")
        fields = CENTRAL.unpack_from(data, at)
        magic, _, version, flags, method = fields[:5]
        crc, packed, size, name, extra, comment = fields[7:13]
        offset = fields[-1]
        at += CENTRAL.size
        title = data[at : at + name]
        at += name + extra + comment
        if magic != b"PK\1\2" or version > _VERSION:
            raise ZipError("is not a whole .npz archive")
        text = title.decode("utf-8" if flags & _UTF_8 else "ascii", "replace")
        members.append(Member(text, method, flags, crc, packed, size, offset))
    if at != len(data):
        raise ZipError("is not a whole .npz archive")
    return members


class Reader:
    """What one member holds, from its beginning, in pieces."""

    def __init__(self, file: IO[bytes], member: Member) -> None:
        """Go to a member whose method is one of ours.

        Raises:
            ZipError: It is not where the directory says.
        """
        file.seek(member.offset)
        header = file.read(LOCAL.size)
        if len(header) < LOCAL.size or not header.startswith(b"PK\3\4"):
            raise ZipError("is not a whole .npz archive")
        name, extra = LOCAL.unpack(header)[-2:]
        title = file.read(name)
        if title.decode("utf-8" if member.flags & _UTF_8 else "ascii", "replace") != member.name:
            raise ZipError("is not a whole .npz archive")
        file.seek(extra, io.SEEK_CUR)
        self._file, self._crc, self._wanted = file, 0, member.crc
        self._packed, self._left, self._size = member.packed, member.size, member.size
        self._inflate = zlib.decompressobj(-15) if member.method == DEFLATED else None

    def tell(self) -> int:
        """Return how many bytes were read."""
        return self._size - self._left

    def read(self, size: int) -> bytes:
        """Return so many bytes, fewer only at the end.

        Raises:
            ZipError: They are not what was packed, or fewer than the directory says.
        """
        out = bytearray()
        size = min(size, self._left)
        while len(out) < size:
            piece = self._piece(min(size - len(out), PIECE))
            if not piece:
                raise ZipError("is not a whole .npz archive")
            out += piece
        self._left -= size
        self._crc = zlib.crc32(out, self._crc)
        if not self._left and self._crc != self._wanted:
            raise ZipError("is not a whole .npz archive")
        return bytes(out)

    def _piece(self, most: int) -> bytes:
        """Return some bytes, unpacked; none at the end of what there is."""
        if self._inflate is None:
            return self._raw(most)
        try:
            while not self._inflate.eof:
                data = self._inflate.unconsumed_tail or self._raw(PIECE)
                piece = self._inflate.decompress(data, most)
                if piece or not data:
                    return piece
        except zlib.error:
            raise ZipError("is not a whole .npz archive") from None
        return b""

    def _raw(self, most: int) -> bytes:
        """Return the next bytes of the member as they are in the file."""
        data = self._file.read(min(most, self._packed))
        self._packed -= len(data)
        return data
