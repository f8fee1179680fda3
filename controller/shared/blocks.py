"""Passes over long arrays in blocks, with a mapped array's pages given back after each.

An array of hours of frames lies in a temporary file, and only the block at hand in memory.
"""

import mmap
import os
import shutil
import tempfile
from collections.abc import Iterator
from typing import IO, Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

BLOCK_BYTES: Final = 1 << 20  # that are read at once


def blocks(array: NDArray[Any], *others: NDArray[Any], before: int = 0) -> Iterator[slice]:
    """Yield slices of rows that cover an array, each with some rows `before` its own.

    The pages of `others`, which are read or written by the same slices, are given back as well.
    """
    rows = max(1, BLOCK_BYTES // max(1, array[:1].nbytes))
    for first in range(0, len(array), rows):
        yield slice(max(0, first - before), first + rows)
        for one in (array, *others):
            _release(one)


def mapped(stream: IO[bytes], dtype: DTypeLike, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return the array in a stream's next bytes, in a temporary file; it is not empty.

    Raises:
        OSError: There is no room for it.
    """
    with tempfile.TemporaryFile() as file:
        shutil.copyfileobj(stream, file)
        file.flush()
        return np.memmap(file, dtype, "r", 0, shape)


def like(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array of the form of another one, in a temporary file if that one is mapped.

    Raises:
        OSError: There is no room for it.
    """
    if not isinstance(array, np.memmap):
        return np.empty_like(array)
    with tempfile.TemporaryFile() as file:
        if hasattr(os, "posix_fallocate"):  # else a full disk ends the program at a later write
            os.posix_fallocate(file.fileno(), 0, array.nbytes)
        return np.memmap(file, array.dtype, "w+", 0, array.shape)


def median(array: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the median over the rows of an array, (rows, ...), as `numpy.median` of axis 0."""
    flat = array.reshape(len(array), -1)
    result = np.empty(flat.shape[1], dtype=array.dtype)
    width = max(1, BLOCK_BYTES // max(1, flat[:, :1].nbytes))  # columns at once
    for left in range(0, flat.shape[1], width):
        right = slice(left, left + width)
        some = np.empty((len(flat), len(result[right])), dtype=array.dtype)
        for part in blocks(flat):
            some[part] = flat[part, right]
        result[right] = np.median(some, axis=0, overwrite_input=True)
    return result.reshape(array.shape[1:])


def _release(array: NDArray[Any]) -> None:
    """Give the pages of a mapped array back, where the system can; its file keeps them."""
    pages = getattr(array, "_mmap", None)
    if pages is not None and hasattr(mmap, "MADV_DONTNEED"):
        pages.madvise(mmap.MADV_DONTNEED)
