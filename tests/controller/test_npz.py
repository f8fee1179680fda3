"""Zip files of unknown origin: what NumPy reads, or a refusal at little cost."""

import io
import struct
import tracemalloc
import zipfile
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller import npz

ARRAYS: Final[dict[str, Any]] = {
    "x": np.arange(40, dtype=np.float32).reshape(5, 8),
    "longer_name": np.zeros((30, 3)),
    "said": np.array("grün"),
}
LIMIT: Final = 1 << 20


def saved(save: Any) -> bytes:
    """The arrays as NumPy writes them."""
    buffer = io.BytesIO()
    save(buffer, **ARRAYS)
    return buffer.getvalue()


FILES: Final = [saved(np.savez), saved(np.savez_compressed)]


def theirs(data: bytes) -> dict[str, Any]:
    """What NumPy reads."""
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


@pytest.mark.parametrize("data", FILES, ids=["stored", "deflated"])
def test_arrays_that_numpy_saved_are_read(data: bytes) -> None:
    read = npz.unpack(data, LIMIT)
    assert list(read) == list(ARRAYS)
    assert all(np.array_equal(read[name], array) for name, array in ARRAYS.items())


@settings(deadline=None, max_examples=300)
@given(
    st.sampled_from(FILES),
    st.lists(st.tuples(st.integers(0, 5000), st.integers(0, 255)), min_size=1, max_size=3),
    st.sampled_from((b"", b"\0", b"PK\5\6", bytes(30))),
    st.integers(0, 5000),
)
def test_damage_is_refused_or_makes_no_difference(
    data: bytes, changed: list[tuple[int, int]], more: bytes, at: int
) -> None:
    damaged = bytearray(data)
    for place, value in changed:
        damaged[place % len(data)] = value
    damaged[at % len(data) : at % len(data)] = more
    try:
        read = npz.unpack(bytes(damaged), LIMIT)
    except npz.NpzError:
        return
    expected = theirs(bytes(damaged))
    assert set(read) == set(expected)
    assert all(np.array_equal(read[name], array) for name, array in expected.items())


def test_a_directory_of_thirty_thousand_members_is_refused_before_it_is_read() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as out:
        for number in range(30_000):
            out.writestr(f"a{number}.npy", b"")
    data = file.getvalue()
    tracemalloc.start()
    try:
        with pytest.raises(npz.NpzError, match="zip directory of more than"):
            npz.unpack(data, 1 << 30)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 1 << 20


def test_a_second_end_record_that_zipfile_would_prefer_is_refused() -> None:
    whole = FILES[0]
    locator = struct.pack("<4sLQL", b"PK\6\7", 0, 0, 1)
    with pytest.raises(npz.NpzError, match="not a whole"):
        npz.unpack(whole[:-22] + locator + whole[-22:], LIMIT)
    size, start = struct.unpack("<LL", whole[-10:-2])
    end = whole[-22:-10] + struct.pack("<LLH", size + len(locator), start, 0)
    with pytest.raises(npz.NpzError, match="not a whole"):
        npz.unpack(whole[:-22] + locator + end, LIMIT)
