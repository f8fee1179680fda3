"""Arrays in and out of `.npz` files that strangers may have written: never pickle, never a bomb.

`numpy.load` trusts the sizes that a file claims. Here every size is checked before memory is
asked for, and whatever is wrong with the file is one `NpzError`.
"""

import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]
Shape = tuple[tuple[int, ...], np.dtype[Any]]
Member = tuple[str, IO[bytes], int]
MAX_MEMBERS = 256  # arrays in one file; ours have some twenty

# What zipfile, zlib and NumPy's header parser are known to raise on bytes that are no archive.
_DAMAGE = (
    zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, NotImplementedError,
    RuntimeError, ValueError, KeyError, IndexError, TypeError, OverflowError, EOFError, SyntaxError,
    RecursionError, MemoryError,
)  # fmt: skip


class NpzError(ValueError):
    """The bytes are no archive of plain arrays, or too large a one; the message says which."""


def pack(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the arrays as a compressed `.npz`; the same arrays give the same bytes."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def unpack(source: Path | bytes, limit_bytes: int, only: Iterable[str] | None = None) -> Arrays:
    """Return the arrays of an `.npz`, by name.

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
            name: _array(name, stream, size)
            for name, stream, size in members
            if wanted is None or name in wanted
        }


def shapes(source: Path | bytes, limit_bytes: int) -> dict[str, Shape]:
    """Return (shape, dtype) of every array of an `.npz`, by name, without reading what it holds.

    Raises:
        NpzError: As `unpack`.
        OSError: The file cannot be read.
    """
    with _archive(source, limit_bytes) as members:
        return {name: _header(name, stream)[:2] for name, stream, _ in members}


@contextmanager
def _archive(source: Path | bytes, limit_bytes: int) -> Iterator[Iterator[Member]]:
    """Open an archive whose sizes are bounded; whatever is wrong with it is one `NpzError`."""
    size = len(source) if isinstance(source, bytes) else source.stat().st_size
    if size > limit_bytes:
        raise NpzError(f"has {size} bytes, more than the {limit_bytes} allowed")
    if size == 0:
        raise NpzError("is empty")
    with io.BytesIO(source) if isinstance(source, bytes) else source.open("rb") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                yield _members(archive, limit_bytes)
        except NpzError:
            raise
        except _DAMAGE:
            raise NpzError("is not a whole .npz archive") from None


def _members(archive: zipfile.ZipFile, limit_bytes: int) -> Iterator[Member]:
    """Yield (name, stream, size) of each array, sizes checked first."""
    members = archive.infolist()
    total = sum(member.file_size for member in members)
    if total > limit_bytes or len(members) > MAX_MEMBERS:
        raise NpzError(
            f"unpacks to {total} bytes in {len(members)} arrays, more than the {limit_bytes} "
            f"bytes and {MAX_MEMBERS} arrays allowed"
        )
    seen = set()
    for member in members:
        name = member.filename.removesuffix(".npy")
        if name == member.filename or name in seen:
            raise NpzError(f"holds {member.filename!r} where arrays of their own names belong")
        seen.add(name)
        with archive.open(member) as stream:
            yield name, stream, member.file_size


def _header(name: str, stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any], bool]:
    """Return shape, dtype, and whether columns come first; the stream is then at the data."""
    version = npy.read_magic(stream)
    header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, fortran, dtype = header(stream)
    if dtype.hasobject:
        raise NpzError(f"holds pickled objects in {name!r}, which are never loaded")
    return shape, dtype, fortran


def _array(name: str, stream: IO[bytes], size: int) -> NDArray[Any]:
    """Return one array whose header and data agree in size; `size` bounds both."""
    shape, dtype, fortran = _header(name, stream)
    data = stream.read(size)
    if min(shape, default=0) < 0 or len(data) != math.prod(shape) * dtype.itemsize:
        raise NpzError(f"holds {name!r} with data that does not fit its shape")
    return np.ndarray(shape, dtype, data, order="F" if fortran else "C").copy()
