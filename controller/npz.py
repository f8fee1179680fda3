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
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]
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


def unpack(source: Path | bytes, limit_bytes: int) -> Arrays:
    """Return all arrays of an `.npz`, by name.

    Args:
        source: The file, or its content.
        limit_bytes: The arrays may have so many bytes together, and the file as well.

    Raises:
        NpzError: It is damaged, too large, or holds anything but plain arrays.
        OSError: The file cannot be read.
    """
    size = len(source) if isinstance(source, bytes) else source.stat().st_size
    if size > limit_bytes:
        raise NpzError(f"has {size} bytes, more than the {limit_bytes} allowed")
    if size == 0:
        raise NpzError("is empty")
    with io.BytesIO(source) if isinstance(source, bytes) else source.open("rb") as file:
        try:
            return _members(file, limit_bytes)
        except NpzError:
            raise
        except _DAMAGE:
            raise NpzError("is not a whole .npz archive") from None


def _members(file: BinaryIO, limit_bytes: int) -> Arrays:
    """Return the arrays of an open archive, sizes checked first."""
    arrays: Arrays = {}
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
        total = sum(member.file_size for member in members)
        if total > limit_bytes or len(members) > MAX_MEMBERS:
            raise NpzError(
                f"unpacks to {total} bytes in {len(members)} arrays, more than the {limit_bytes} "
                f"bytes and {MAX_MEMBERS} arrays allowed"
            )
        for member in members:
            name = member.filename.removesuffix(".npy")
            if name == member.filename or name in arrays:
                raise NpzError(f"holds {member.filename!r} where arrays of their own names belong")
            with archive.open(member) as stream:
                arrays[name] = _array(name, stream, member.file_size)
    return arrays


def _array(name: str, stream: Any, size: int) -> NDArray[Any]:
    """Return one array whose header and data agree in size; `size` bounds both."""
    version = npy.read_magic(stream)
    header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, fortran, dtype = header(stream)
    if dtype.hasobject:
        raise NpzError(f"holds pickled objects in {name!r}, which are never loaded")
    data = stream.read(size)
    if min(shape, default=0) < 0 or len(data) != math.prod(shape) * dtype.itemsize:
        raise NpzError(f"holds {name!r} with data that does not fit its shape")
    return np.ndarray(shape, dtype, data, order="F" if fortran else "C").copy()
