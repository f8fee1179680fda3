"""Arrays in `.npz` files of unknown origin: no pickles, and memory for what is there only.

`numpy.load` takes memory for the sizes that a file claims and evaluates the text of its headers.
Here every size is checked first, and headers have one form.
"""

import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from controller.files import open_regular
from controller.zip_limits import DAMAGE, ZipError, open_zip

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
_DAMAGE: Final = (
    *DAMAGE, ValueError, KeyError, IndexError, TypeError, OverflowError, RuntimeError
)  # fmt: skip


class NpzError(ValueError):
    """The bytes are no archive of plain arrays, or too large a one; the message has no subject."""


def pack(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the arrays as a compressed `.npz`; the same arrays give the same bytes."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def unpack(source: Path | bytes, limit_bytes: int, only: Iterable[str] | None = None) -> Arrays:
    """Return the arrays of an `.npz`, by name, rows first.

    Args:
        source: The file, or its content.
        limit_bytes: Most bytes of all arrays together, and of the file.
        only: Names of the arrays to return, if they exist; by default all.

    Raises:
        NpzError: It is damaged, too large, or holds anything but plain arrays.
        OSError: The file cannot be read.
    """
    wanted = None if only is None else set(only)
    with _open(source, limit_bytes) as file:
        return {
            name: _array(name, stream, size, limit_bytes)
            for name, stream, size in _members(file, limit_bytes)
            if wanted is None or name in wanted
        }


def single(path: Path, limit_bytes: int) -> NDArray[Any]:
    """Return the array of an `.npy`.

    Raises:
        NpzError: It is damaged, too large, or anything but a plain array.
        OSError: The file cannot be read.
    """
    with _open(path, limit_bytes) as file:
        return _array(path.stem, file, _size(file), limit_bytes)


def shapes(source: Path | bytes, limit_bytes: int) -> dict[str, Shape]:
    """Return (shape, dtype) of every array of an `.npz`, by name, without reading its data.

    Raises:
        NpzError: As `unpack`.
        OSError: The file cannot be read.
    """
    with _open(source, limit_bytes) as file:
        members = _members(file, limit_bytes)
        return {name: _header(name, stream, limit_bytes) for name, stream, _ in members}


@contextmanager
def _open(source: Path | bytes, limit_bytes: int) -> Iterator[IO[bytes]]:
    """Open a file of bounded size; whatever is wrong with it is one `NpzError`."""
    with io.BytesIO(source) if isinstance(source, bytes) else open_regular(source) as file:
        size = _size(file)
        if size > limit_bytes:
            raise NpzError(f"has {size} bytes, more than the {limit_bytes} allowed")
        if size == 0:
            raise NpzError("is empty")
        try:
            yield file
        except (NpzError, ZipError) as error:
            raise NpzError(str(error)) from None
        except MemoryError:
            raise NpzError("needs more memory than there is") from None
        except _DAMAGE:
            raise NpzError("is not a whole .npz archive") from None


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
                raise NpzError(
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
        raise NpzError("is not a whole .npz archive")
    length = int.from_bytes(stream.read(2 if magic[6] == 1 else 4), "little")
    if length > MAX_HEADER:
        raise NpzError(f"holds {name!r} with a header of {length} bytes; {MAX_HEADER} are allowed")
    match = _HEADER.fullmatch(stream.read(length))
    if match is None:
        raise NpzError(f"holds {name!r}, which is no plain array")
    kind, sizes = (group.decode("latin-1") for group in match.groups())
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
    return shape, dtype


def _array(name: str, stream: IO[bytes], size: int, limit_bytes: int) -> NDArray[Any]:
    """Return one array, rows first; its header and data must have `size` bytes together."""
    shape, dtype = _header(name, stream, limit_bytes)
    if stream.tell() + math.prod(shape) * dtype.itemsize != size:
        raise NpzError(f"holds {name!r} with data that does not fit its shape")
    stream.seek(0)
    array = npy.read_array(stream, allow_pickle=False, max_header_size=MAX_HEADER)
    return np.asarray(array, order="C")
