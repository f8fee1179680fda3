"""Zip and `.npz` files of unknown origin: no pickles, and memory only for what is there.

`zipfile` takes memory for every entry of a directory of any size, and believes what it claims;
`numpy.load` takes memory for the sizes that a file claims and evaluates the text of its headers.
Here every claim is checked first, and headers have one form.
"""

import io
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from controller.shared import blocks
from controller.shared.files import open_regular

MAX_DIRECTORY: Final = 128 << 10  # bytes
# What `zipfile` is known to raise on damage, also while a member is read.
DAMAGE: Final = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError)


_END: Final = struct.Struct("<4s4H2LH")  # the end record: APPNOTE.TXT, 4.3.16
_LOCATOR: Final = 20  # bytes of the zip64 locator that may lie before it and replaces it
_LOCAL_HEADER: Final = 30  # bytes of a member's local header, without its name
_METHODS: Final = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # `zipfile` bounds their output
_FLAGS: Final = 0x80E  # deflate's effort, sizes after the data, UTF-8: no encryption, no patches
_RATIO: Final = 1032  # most that deflate gains

Arrays = dict[str, NDArray[Any]]
Shape = tuple[tuple[int, ...], np.dtype[Any]]
Member = tuple[str, IO[bytes], int]  # name, content, bytes of the content

MAX_MEMBERS: Final = 256  # arrays in one file; ours have some thirty
MAX_HEADER: Final = 4096  # bytes of an array's header; NumPy's have 118
MAX_DIMENSIONS: Final = 8  # weights of a 3D convolution have five

_NAME: Final = re.compile(r"(\w[\w.-]{0,199})\.npy")
_HEADER: Final = re.compile(
    rb"\{\s*'descr':\s*'([^'\\]{1,16})',\s*'fortran_order':\s*(?:True|False),"
    rb"\s*'shape':\s*\(([0-9, ]*)\),?\s*\}\s*"
)
_PLAIN: Final = re.compile(r"[<>|=]?[biufcSU][1-9][0-9]{0,9}")  # truth, numbers and texts

# What `zipfile` and NumPy are known to raise on what is no array.
_DAMAGE: Final = (*DAMAGE, ValueError, KeyError, IndexError, TypeError, OverflowError, RuntimeError)


class ZipError(ValueError):
    """The file is damaged, exceeds a limit, or holds something else; the message has no subject."""


def open_zip(file: IO[bytes], limit_bytes: int, max_members: int) -> zipfile.ZipFile:
    """Open a zip file of any origin with members that are stored or deflated, each with own bytes.

    Raises:
        ZipError: It has more bytes unpacked or members than allowed, or is packed in another way.
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
        end = member.header_offset + _LOCAL_HEADER + member.compress_size
    if end > opened.start_dir:
        raise ZipError("holds members that are longer than the file")
    if len({member.filename for member in members}) < len(members):
        raise ZipError("holds two members of one name")


def pack(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the arrays as a compressed `.npz`; the same arrays give the same bytes."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def unpack(
    source: Path | bytes,
    limit_bytes: int,
    only: Iterable[str] | None = None,
    mapped: Collection[str] = (),
) -> Arrays:
    """Return the arrays of an `.npz`, by name, rows first; `only` those named, if they exist.

    Those `mapped` lie in temporary files, for passes by `controller.shared.blocks`.

    Raises:
        ZipError: It is damaged, larger than the limit, or holds anything but plain arrays.
        OSError: The file cannot be read.
    """
    wanted = None if only is None else set(only)
    with _open(source, limit_bytes) as file:
        return {
            name: _array(name, stream, size, limit_bytes, mapped=name in mapped)
            for name, stream, size in _members(file, limit_bytes)
            if wanted is None or name in wanted
        }


def single(path: Path, limit_bytes: int) -> NDArray[Any]:
    """Return the array of an `.npy`; ZipError and OSError as from `unpack`."""
    with _open(path, limit_bytes) as file:
        return _array(path.stem, file, _size(file), limit_bytes)


def shapes(source: Path | bytes, limit_bytes: int) -> dict[str, Shape]:
    """Return (shape, dtype) of every array of an `.npz`, by name, without reading its data."""
    with _open(source, limit_bytes) as file:
        members = _members(file, limit_bytes)
        return {name: _header(name, stream, limit_bytes) for name, stream, _ in members}


@contextmanager
def _open(source: Path | bytes, limit_bytes: int) -> Iterator[IO[bytes]]:
    """Open a file of bounded size; whatever is wrong with it is one `ZipError`."""
    with io.BytesIO(source) if isinstance(source, bytes) else open_regular(source) as file:
        size = _size(file)
        if size > limit_bytes:
            raise ZipError(f"has {size} bytes, more than the {limit_bytes} allowed")
        if size == 0:
            raise ZipError("is empty")
        try:
            yield file
        except ZipError:
            raise
        except MemoryError:
            raise ZipError("needs more memory than there is") from None
        except _DAMAGE:
            raise ZipError("is not a whole .npz archive") from None


def _size(file: IO[bytes]) -> int:
    """Return the bytes of a file; it is then at its beginning."""
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    return size


def _members(file: IO[bytes], limit_bytes: int) -> Iterator[Member]:
    """Yield each array's name, stream and bytes, after what the directory claims is checked."""
    with open_zip(file, limit_bytes, MAX_MEMBERS) as archive:
        for member in archive.infolist():
            # A name never becomes a path, but it may well be printed.
            name = _NAME.fullmatch(member.orig_filename)
            if name is None:
                raise ZipError(
                    f"holds {member.orig_filename[:80]!r} where arrays of plain names belong"
                )
            with archive.open(member) as stream:
                yield name[1], stream, member.file_size


def _header(name: str, stream: IO[bytes], limit_bytes: int) -> Shape:
    """Return shape and dtype; the stream is then at the data.

    NumPy evaluates the header as Python's own text. So it is matched before against the one form
    that programs write, in which there is nothing to evaluate.
    """
    magic = stream.read(8)
    if magic[:6] != b"\x93NUMPY" or magic[6:] not in (b"\x01\x00", b"\x02\x00", b"\x03\x00"):
        raise ZipError("is not a whole .npz archive")
    length = int.from_bytes(stream.read(2 if magic[6] == 1 else 4), "little")
    if length > MAX_HEADER:
        raise ZipError(f"holds {name!r} with a header of {length} bytes; {MAX_HEADER} are allowed")
    match = _HEADER.fullmatch(stream.read(length))
    if match is None:
        raise ZipError(f"holds {name!r}, which is no plain array")
    kind, sizes = (group.decode("latin-1") for group in match.groups())
    if kind.lstrip("<>|=") == "O":
        raise ZipError(f"holds pickled objects in {name!r}, which are never loaded")
    if not _PLAIN.fullmatch(kind):
        raise ZipError(f"holds {name!r}, which is no plain array")
    shape = tuple(int(size) for size in sizes.split(",") if size.strip())
    dtype = np.dtype(kind)
    if len(shape) > MAX_DIMENSIONS:
        raise ZipError(f"holds {name!r} of {len(shape)} dimensions; {MAX_DIMENSIONS} are allowed")
    # An array without elements needs no bytes, but its other sizes must be sane as well.
    if math.prod(max(1, size) for size in shape) * dtype.itemsize > limit_bytes:
        raise ZipError(f"holds {name!r} with data that does not fit its shape")
    return shape, dtype


def _array(
    name: str, stream: IO[bytes], size: int, limit_bytes: int, *, mapped: bool = False
) -> NDArray[Any]:
    """Return one array, rows first; its header and data must have `size` bytes together."""
    shape, dtype = _header(name, stream, limit_bytes)
    begin = stream.tell()
    if begin + math.prod(shape) * dtype.itemsize != size:
        raise ZipError(f"holds {name!r} with data that does not fit its shape")
    stream.seek(0)
    if mapped and b"'fortran_order': False" in stream.read(begin) and size > begin:
        return blocks.mapped(stream, dtype, shape)
    stream.seek(0)
    array = npy.read_array(stream, allow_pickle=False, max_header_size=MAX_HEADER)
    return np.asarray(array, order="C")
