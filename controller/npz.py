"""Arrays in and out of `.npz` files that strangers may have written: never pickle, never a bomb.

`numpy.load` trusts the sizes that a file claims and evaluates the text of its headers. Here every
size is checked before memory is asked for, headers have one form, and whatever is wrong with the
file is one `NpzError`.
"""

import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.files import open_regular
from controller.unzip import DEFLATED, PIECE, STORED, Reader, ZipError, directory

Arrays = dict[str, NDArray[Any]]
Shape = tuple[tuple[int, ...], np.dtype[Any]]
Header = tuple[tuple[int, ...], np.dtype[Any], bool]
Member = tuple[str, Reader, int]

MAX_MEMBERS: Final = 256  # arrays in one file; ours have some thirty
MAX_HEADER: Final = 4096  # bytes of an array's header; NumPy's have 118
MAX_DIMENSIONS: Final = 8  # weights of a 3D convolution have five

_NAME: Final = re.compile(r"\w[\w.-]{0,199}")
_FLAGS: Final = 0x80E  # deflate's effort, sizes after the data, UTF-8: no encryption, no patches
_HEADER: Final = re.compile(
    rb"\{\s*'descr':\s*'([^'\\]{1,16})',\s*'fortran_order':\s*(True|False),"
    rb"\s*'shape':\s*\(([0-9, ]*)\),?\s*\}\s*"
)
_PLAIN: Final = re.compile(r"[<>|=]?[biufcSU][1-9][0-9]{0,9}")  # truth, numbers and texts

# What NumPy is known to raise on what is no array.
_DAMAGE: Final = (ValueError, KeyError, IndexError, TypeError, OverflowError, RuntimeError)


class NpzError(ValueError):
    """The bytes are no archive of plain arrays, or too large a one; the message says which."""


def pack(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the arrays as a compressed `.npz`; the same arrays give the same bytes."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def unpack(source: Path | bytes, limit_bytes: int, only: Iterable[str] | None = None) -> Arrays:
    """Return the arrays of an `.npz`, by name, rows first.

    Args:
        source: The file, or its content.
        limit_bytes: All arrays may have so many bytes together, and the file as well.
        only: The arrays that are wanted, of those that there are; by default all.

    Raises:
        NpzError: It is damaged, too large, or holds anything but plain arrays.
        OSError: The file cannot be read.
    """
    wanted = None if only is None else set(only)
    with _archive(source, limit_bytes) as members:
        return {
            name: _array(name, stream, size, limit_bytes)
            for name, stream, size in members
            if wanted is None or name in wanted
        }


def single(path: Path, limit_bytes: int) -> NDArray[Any]:
    """Return the array of an `.npy`.

    Raises:
        NpzError: It is damaged, too large, or anything but a plain array.
        OSError: The file cannot be read.
    """
    with _bounded(path, limit_bytes) as (file, size):
        return _array(path.stem, file, size, limit_bytes)


def shapes(source: Path | bytes, limit_bytes: int) -> dict[str, Shape]:
    """Return (shape, dtype) of every array of an `.npz`, by name, without reading what it holds.

    Raises:
        NpzError: As `unpack`.
        OSError: The file cannot be read.
    """
    with _archive(source, limit_bytes) as members:
        return {name: _header(name, stream, limit_bytes)[:2] for name, stream, _ in members}


@contextmanager
def _archive(source: Path | bytes, limit_bytes: int) -> Iterator[Iterator[Member]]:
    """Open an archive whose sizes are bounded; whatever is wrong with it is one `NpzError`."""
    with _bounded(source, limit_bytes) as (file, _):
        yield _members(file, limit_bytes)


@contextmanager
def _bounded(source: Path | bytes, limit_bytes: int) -> Iterator[tuple[IO[bytes], int]]:
    """Open a file; yield it and its size. Whatever is wrong with it is one `NpzError`."""
    with io.BytesIO(source) if isinstance(source, bytes) else open_regular(source) as file:
        size = file.seek(0, io.SEEK_END)
        if size > limit_bytes:
            raise NpzError(f"has {size} bytes, more than the {limit_bytes} allowed")
        if size == 0:
            raise NpzError("is empty")
        file.seek(0)
        try:
            yield file, size
        except (NpzError, ZipError) as error:
            raise NpzError(str(error)) from None
        except MemoryError:
            raise NpzError("needs more memory than there is") from None
        except _DAMAGE:
            raise NpzError("is not a whole .npz archive") from None


def _members(file: IO[bytes], limit_bytes: int) -> Iterator[Member]:
    """Yield (name, stream, size) of each array, after what the directory says of all is checked."""
    members, start = directory(file)
    total = sum(member.size for member in members)
    if total > limit_bytes or len(members) > MAX_MEMBERS:
        raise NpzError(
            f"unpacks to {total} bytes in {len(members)} arrays, more than the {limit_bytes} "
            f"bytes and {MAX_MEMBERS} arrays allowed"
        )
    names = [member.name.removesuffix(".npy") for member in members]
    for name, member in zip(names, members, strict=True):
        # A name never becomes a path, but it may well be printed.
        if f"{name}.npy" != member.name or not _NAME.fullmatch(name):
            raise NpzError(f"holds {member.name[:80]!r} where arrays of plain names belong")
        if member.method not in (STORED, DEFLATED) or member.flags & ~_FLAGS:
            raise NpzError(f"holds {name!r} encrypted, or packed by another method than deflate")
    if len(set(names)) < len(names):
        raise NpzError("holds two arrays of one name")
    end = 0
    for member in sorted(members, key=lambda member: member.offset):
        if member.offset < end:
            raise NpzError("holds arrays that share their bytes")
        end = member.end
    if end > start:
        raise NpzError("holds arrays that are longer than the file")
    for name, member in zip(names, members, strict=True):
        yield name, Reader(file, member), member.size


def _header(name: str, stream: Reader | IO[bytes], limit_bytes: int) -> Header:
    """Return shape, dtype, and whether columns come first; the stream is then at the data.

    NumPy would evaluate the header as Python's own text; ours is matched against the one form
    that programs write, so that there is nothing to evaluate.
    """
    magic = stream.read(8)
    if magic[:6] != b"\x93NUMPY" or magic[6:] not in (b"\x01\x00", b"\x02\x00", b"\x03\x00"):
        raise NpzError("is not a whole .npz archive")
    length = int.from_bytes(stream.read(2 if magic[6] == 1 else 4), "little")
    if length > MAX_HEADER:
        raise NpzError(f"holds {name!r} with a header of {length} bytes; {MAX_HEADER} are allowed")
    match = _HEADER.fullmatch(stream.read(length))
    if match is None:
        raise NpzError(f"holds {name!r}, which is no plain array")
    kind, order, sizes = (group.decode("latin-1") for group in match.groups())
    if kind.lstrip("<>|=") == "O":
        raise NpzError(f"holds pickled objects in {name!r}, which are never loaded")
    if not _PLAIN.fullmatch(kind):
        raise NpzError(f"holds {name!r}, which is no plain array")
    shape = tuple(int(size) for size in sizes.split(",") if size.strip())
    dtype = np.dtype(kind)
    if len(shape) > MAX_DIMENSIONS:
        raise NpzError(f"holds {name!r} of {len(shape)} dimensions; {MAX_DIMENSIONS} are allowed")
    # An array without elements needs no bytes, but its other sizes must be sane as well.
    if math.prod(max(1, size) for size in shape) * dtype.itemsize > limit_bytes:
        raise NpzError(f"holds {name!r} with data that does not fit its shape")
    return shape, dtype, order == "True"


def _array(name: str, stream: Reader | IO[bytes], size: int, limit_bytes: int) -> NDArray[Any]:
    """Return one array whose header and data agree in size; `size` is of both."""
    shape, dtype, fortran = _header(name, stream, limit_bytes)
    count = math.prod(shape) * dtype.itemsize
    if stream.tell() + count != size:
        raise NpzError(f"holds {name!r} with data that does not fit its shape")
    data = np.empty(count, dtype=np.uint8)
    for start in range(0, count, PIECE):
        piece = stream.read(min(PIECE, count - start))
        data[start : start + len(piece)] = np.frombuffer(piece, dtype=np.uint8)
    array: NDArray[Any] = np.ndarray(shape, dtype, data, order="F" if fortran else "C")
    return array.copy() if fortran else array
