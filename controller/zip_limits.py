"""Zip files of unknown origin, opened with `zipfile` after a size check of their directory.

`zipfile` takes memory for every entry of a directory of any size, and believes what it claims. So
the end record is checked first, and all claims before any member is unpacked.
"""

import io
import struct
import zipfile
import zlib
from typing import IO, Final

MAX_DIRECTORY: Final = 128 << 10  # bytes
# What `zipfile` is known to raise on damage, also while a member is read.
DAMAGE: Final = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError)


_END: Final = struct.Struct("<4s4H2LH")  # the end record: APPNOTE.TXT, 4.3.16
_LOCATOR: Final = 20  # bytes of the zip64 locator that may lie before it and replaces it
_HEADER: Final = 30  # bytes of a member's local header, without its name
_METHODS: Final = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # `zipfile` bounds their output
_FLAGS: Final = 0x80E  # deflate's effort, sizes after the data, UTF-8: no encryption, no patches
_RATIO: Final = 1032  # most that deflate gains


class ZipError(ValueError):
    """The file exceeds a limit, or is packed in another way; the message has no subject."""


def open_zip(file: IO[bytes], limit_bytes: int, max_members: int) -> zipfile.ZipFile:
    """Open a zip file with members that are stored or deflated, each with bytes of its own.

    Args:
        file: Of any origin.
        limit_bytes: Most bytes of all members together, unpacked.
        max_members: Most entries of the directory.

    Raises:
        ZipError: It exceeds a limit, or is packed in another way.
        DAMAGE: It is damaged; reading a member raises these, too.
    """
    _check_end(file)
    opened = zipfile.ZipFile(file)
    _check_members(opened, limit_bytes, max_members)
    return opened


def _check_end(file: IO[bytes]) -> None:
    """Check that a small directory lies right before an end record without a comment."""
    length = file.seek(0, io.SEEK_END)
    file.seek(max(0, length - _END.size - _LOCATOR))
    tail = file.read()
    magic, *disks, count, size, start, comment = _END.unpack(tail[-_END.size :])
    whole = (magic, disks, comment) == (b"PK\5\6", [0, 0, count], 0)
    if not whole or start + size + _END.size != length or tail.startswith(b"PK\6\7"):
        raise zipfile.BadZipFile
    if size > MAX_DIRECTORY:
        raise ZipError(f"has a zip directory of more than the {MAX_DIRECTORY} bytes allowed")


def _check_members(opened: zipfile.ZipFile, limit_bytes: int, max_members: int) -> None:
    """Check what the directory claims of sizes, methods and places."""
    members = opened.infolist()
    total = sum(member.file_size for member in members)
    if total > limit_bytes or len(members) > max_members:
        raise ZipError(
            f"unpacks to {total} bytes in {len(members)} members, more than the {limit_bytes} "
            f"bytes and {max_members} members allowed"
        )
    end = 0
    for member in sorted(members, key=lambda member: member.header_offset):
        name = member.orig_filename[:80]
        if member.compress_type not in _METHODS or member.flag_bits & ~_FLAGS:
            raise ZipError(f"holds {name!r} encrypted, or packed by another method than deflate")
        if member.header_offset < end:
            raise ZipError("holds members that share their bytes")
        if member.file_size > _RATIO * member.compress_size:
            raise ZipError(f"holds {name!r} with fewer bytes than it claims")
        end = member.header_offset + _HEADER + member.compress_size
    if end > opened.start_dir:
        raise ZipError("holds members that are longer than the file")
    if len({member.filename for member in members}) < len(members):
        raise ZipError("holds two members of one name")
