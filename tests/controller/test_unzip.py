"""Zip files of strangers: what `zipfile` and NumPy would read, or a refusal."""

import io
import zipfile
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller import npz
from controller.unzip import PIECE, Reader, ZipError, directory

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


@settings(deadline=None)
@given(
    st.binary(max_size=2000),
    st.integers(1, 100),
    st.sampled_from((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)),
    st.lists(st.integers(0, 3 * PIECE), min_size=1),
)
def test_a_member_is_read_in_pieces_of_any_size(
    some: bytes, often: int, method: int, sizes: list[int]
) -> None:
    whole = some * often * 2
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as out:
        out.comment = b"by hand"
        out.writestr("before.bin", b"abc")
        out.writestr("whole.bin", whole)
    members, _ = directory(file)
    stream, read = Reader(file, members[1]), b""
    for size in sizes:
        piece = stream.read(size)
        assert len(piece) == min(size, len(whole) - len(read))
        read += piece
        assert stream.tell() == len(read)
    assert read + stream.read(len(whole)) == whole


def test_a_changed_byte_of_a_member_is_noticed_at_its_end() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as out:
        out.writestr("a.bin", b"capacitance")
    file = io.BytesIO(file.getvalue().replace(b"capacitance", b"capacitancy"))
    stream = Reader(file, directory(file)[0][0])
    assert stream.read(3) == b"cap"
    with pytest.raises(ZipError, match="not a whole"):
        stream.read(100)
