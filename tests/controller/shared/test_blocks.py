"""Long arrays are passed over in blocks, in memory or mapped from a file."""

import errno
import io
import os
from itertools import pairwise

import numpy as np
import pytest

from controller.shared import blocks

ROWS = np.random.default_rng(3).normal(size=(1000, 4, 3)).astype(np.float32)  # 48 bytes each


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 48 * 70)


def stored() -> np.ndarray:
    """The same rows in a temporary file."""
    return blocks.mapped(io.BytesIO(ROWS.tobytes()), ROWS.dtype, ROWS.shape)


def test_blocks_cover_an_array_each_with_the_rows_before_it() -> None:
    parts = [np.arange(1000)[part] for part in blocks.blocks(ROWS, before=1)]
    assert np.array_equal(np.unique(np.concatenate(parts)), np.arange(1000))
    assert all(before[-1] == after[0] for before, after in pairwise(parts))
    assert max(map(len, parts)) == 71
    assert list(blocks.blocks(ROWS[:0])) == []


@pytest.mark.parametrize("rows", [ROWS, ROWS[:999], stored()])
def test_the_median_is_numpy_s(rows: np.ndarray) -> None:
    assert np.array_equal(blocks.median(rows), np.median(rows, axis=0))


def test_a_mapped_array_keeps_its_numbers_when_its_pages_are_given_back() -> None:
    rows = stored()
    copy = blocks.like(rows)
    assert isinstance(copy, np.memmap)
    for part in blocks.blocks(rows, copy):
        copy[part] = rows[part]
    assert np.array_equal(copy, ROWS)
    assert not isinstance(blocks.like(ROWS), np.memmap)


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="room is not asked for there")
def test_a_full_disk_is_an_error_before_anything_is_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(*arguments: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(OSError, match="No space left"):
        blocks.like(stored())
