"""Zip files of unknown origin: what NumPy reads, or a refusal at little cost."""

import io
import struct
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.shared import npz
from tests.support.hostile_npz import archive, headed, member, npy

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
    except npz.ZipError:
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
        with pytest.raises(npz.ZipError, match="zip directory of more than"):
            npz.unpack(data, 1 << 30)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 1 << 20


def test_a_second_end_record_that_zipfile_would_prefer_is_refused() -> None:
    whole = FILES[0]
    locator = struct.pack("<4sLQL", b"PK\6\7", 0, 0, 1)
    with pytest.raises(npz.ZipError, match="not a whole"):
        npz.unpack(whole[:-22] + locator + whole[-22:], LIMIT)
    size, start = struct.unpack("<LL", whole[-10:-2])
    end = whole[-22:-10] + struct.pack("<LLH", size + len(locator), start, 0)
    with pytest.raises(npz.ZipError, match="not a whole"):
        npz.unpack(whole[:-22] + locator + end, LIMIT)


def directory(size: int) -> bytes:
    """A zip file with a directory of this size."""
    extra = size - 2 * (46 + len(b"a.npy"))
    half = member(b"a.npy", extra=bytes(extra // 2))
    return archive(half, member(b"b.npy", extra=bytes(extra - extra // 2)))


def apart(distance: int) -> bytes:
    """Two members without data, so far from each other."""
    data = bytearray(archive(member(b"a"), member(b"b")))
    struct.pack_into("<L", data, len(data) - 22 - 5, distance)
    return bytes(data)


ZIPS: Final[dict[str, Any]] = {  # each as it may just be, and by one more as it may not
    "members": lambda more: archive(*[member(b"%d" % one) for one in range(3 + more)]),
    "bytes unpacked": lambda more: archive(member(data=bytes(LIMIT + more))),
    "a directory": lambda more: directory(npz.MAX_DIRECTORY + more),
    "a gain": lambda more: archive(member(packed=bytes(2), method=8, size=2 * 1032 + more)),
    "an end": lambda more: archive((member(b"a", b"xy")[0], *member(b"a", bytes(3 + more))[1:])),
    "members side by side": lambda more: apart(30 - more),
}


@pytest.mark.parametrize("what", ZIPS)
def test_a_zip_file_may_reach_a_limit_and_not_exceed_it(what: str) -> None:
    npz.open_zip(io.BytesIO(ZIPS[what](0)), LIMIT, 3)
    with pytest.raises(npz.ZipError):
        npz.open_zip(io.BytesIO(ZIPS[what](1)), LIMIT, 3)


def padded(length: int) -> bytes:
    return b"{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }".ljust(length)


HEADERS: Final[dict[str, Any]] = {
    "bytes of a header": lambda more: headed(padded(npz.MAX_HEADER + more), bytes(8)),
    "dimensions": lambda more: npy(f"({'1,' * (8 + more)})", data=bytes(4)),
    "bytes of an array": lambda more: npy(f"({10 + more},)", data=bytes(40)),
    "bytes of an array without elements": lambda more: npy(f"(0, {10 + more})"),
    "letters of a text": lambda more: npy("(1,)", f"'<U{10 + more}'", data=bytes(40)),
}


@pytest.mark.parametrize("what", HEADERS)
def test_an_array_may_reach_a_limit_and_not_exceed_it(what: str) -> None:
    npz._header("x", io.BytesIO(HEADERS[what](0)), 40)
    with pytest.raises(npz.ZipError):
        npz._header("x", io.BytesIO(HEADERS[what](1)), 40)


def test_each_size_of_file_content_and_name_is_bounded() -> None:
    stored, deflated = FILES
    assert len(npz.unpack(stored, len(stored))) == len(npz.shapes(stored, len(stored))) == 3
    with pytest.raises(npz.ZipError, match="more than the"):
        npz.unpack(stored, len(stored) - 1)
    with zipfile.ZipFile(io.BytesIO(deflated)) as file:
        whole = sum(one.file_size for one in file.infolist())
    assert len(npz.unpack(deflated, whole)) == 3
    with pytest.raises(npz.ZipError, match=f"unpacks to {whole} bytes"):
        npz.unpack(deflated, whole - 1)
    data = npy("(2,)", data=bytes(8))
    (name,) = npz.unpack(archive(member(b"a" * 200 + b".npy", data)), LIMIT)
    assert name == "a" * 200
    with pytest.raises(npz.ZipError, match="plain names belong"):
        npz.unpack(archive(member(b"a" * 201 + b".npy", data)), LIMIT)


def test_every_change_of_the_end_record_is_refused_and_nothing_is_an_archive_too() -> None:
    for bit in range(8 * 22):
        changed = bytearray(FILES[0])
        changed[-22 + bit // 8] ^= 1 << bit % 8
        with pytest.raises(npz.ZipError, match="not a whole"):
            npz.unpack(bytes(changed), LIMIT)
    assert npz.unpack(b"PK\5\6" + bytes(18), LIMIT) == {}
    with pytest.raises(npz.ZipError, match="is empty"):
        npz.unpack(b"", LIMIT)


def test_arrays_are_listed_or_read_by_name_and_their_rows_come_first(tmp_path: Path) -> None:
    data = npz.pack({"a": np.asfortranarray(np.eye(3)[:2]), "b": np.zeros(4, np.int8)})
    assert npz.shapes(data, LIMIT) == {"a": ((2, 3), np.dtype("f8")), "b": ((4,), np.dtype("i1"))}
    read = npz.unpack(data, LIMIT, only=["a", "c"])
    assert list(read) == ["a"]
    assert read["a"].flags.c_contiguous
    assert npz.unpack(data, LIMIT, only=()) == {}
    np.save(tmp_path / "one.npy", np.eye(2))
    assert np.array_equal(npz.single(tmp_path / "one.npy", LIMIT), np.eye(2))
    with pytest.raises(npz.ZipError, match="data that does not fit its shape"):
        npz.unpack(archive(member(data=npy("(2,)", data=bytes(9)))), LIMIT)


def test_of_the_name_of_a_member_80_characters_are_told() -> None:
    data = archive(member(b"a" * 90, method=99))
    with pytest.raises(npz.ZipError, match=f"holds '{'a' * 80}' encrypted, or packed"):
        npz.unpack(data, LIMIT)
