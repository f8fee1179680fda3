"""Salvage: out of a journal that a bad disk or a stranger has changed comes nothing wrong."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.recordings import journal as journals
from controller.recordings import journal_records
from controller.recordings.journal import AMEND, BLOCK
from controller.recordings.journal_records import Kind, encode
from controller.recordings.journal_repair import decode
from controller.recordings.recording import RecordingError
from tests.support.small_journal import KEY, numbers, written

# --- bad disks ------------------------------------------------------------------------------------


@given(st.data())
def test_a_flipped_bit_costs_one_record_and_what_a_crash_may_cost(data: st.DataObject) -> None:
    content = bytearray(written(95).data)
    content[data.draw(st.integers(0, len(content) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    found = numbers(decode(bytes(content)))
    assert sum(number <= 90 for number in found) >= 89
    assert all(b > a for a, b in pairwise(found))


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 20_000), st.binary(max_size=600)), max_size=8))
def test_damage_is_passed_over_and_counted(damage: list[tuple[int, bytes]]) -> None:
    journal = written(200)
    good, head = bytes(journal.data), journal.head
    content = bytearray(good)
    for place, noise in damage:
        start = head + place % (len(good) - head)
        content[start : start + len(noise)] = noise[: len(content) - start]
    decoded = decode(bytes(content))
    report = decoded.report
    assert (report.damaged_bytes > 0 or report.cut_bytes > 0) == (content != good)
    lost = 200 - len(numbers(decoded))
    assert lost <= report.lost_records + report.left_out + report.cut_bytes // 86 + 1


@pytest.mark.parametrize("copy", [0, 1])
def test_either_header_will_do(copy: int) -> None:
    journal = written(30)
    content = bytearray(journal.data)
    assert journal.head % (2 * BLOCK) == 0  # so the copies share no block of the disk
    start = copy * journal.head // 2
    content[start : start + BLOCK] = bytes(BLOCK)
    decoded = decode(bytes(content))
    assert numbers(decoded) == list(range(1, 31))
    assert (decoded.report.damaged_bytes, decoded.report.lost_records) == (
        BLOCK,
        2,
    )  # and what fills the block


def test_a_long_journal_has_later_headers_for_when_both_first_ones_are_gone() -> None:
    journal = written(200)
    content = bytes(journal.head) + bytes(journal.data[journal.head :])
    assert numbers(decode(content)) == list(range(1, 201))


def test_without_a_header_nothing_is_read() -> None:
    journal = written(30)
    for content in (bytes(journal.head) + journal.data[journal.head :], b"", bytes(9000)):
        with pytest.raises(RecordingError, match=r"no header that is whole|is empty"):
            decode(content)


@settings(deadline=None)
@given(st.permutations(range(8)), st.integers(0, BLOCK))
def test_blocks_that_changed_places_are_never_taken_for_frames(
    order: list[int], phase: int
) -> None:
    journal = written(500)
    data, start = bytes(journal.data), journal.head + phase
    blocks = [data[start + k * BLOCK : start + (k + 1) * BLOCK] for k in range(8)]
    moved = data[:start] + b"".join(blocks[k] for k in order) + data[start + 8 * BLOCK :]
    found = set(numbers(decode(moved)))
    frames = (record for record in journal_records.scan(data, KEY) if record.kind is Kind.FRAME)
    for number, record in enumerate(frames, 1):
        intact = data[record.start : record.end] == moved[record.start : record.end]
        assert (number in found) == intact


def test_blocks_of_an_earlier_journal_are_never_taken_for_frames() -> None:
    """As when a file grows over blocks that another one was deleted from."""
    mine, other = bytes(written(60).data), bytes(written(400, key=bytes(16)).data)
    stale = mine + other[len(mine) :]
    assert numbers(decode(stale)) == list(range(1, 61))
    head = written(0).head
    mixed = other[: head // 2] + mine[head // 2 :]  # even in place of a header
    assert numbers(decode(mixed)) == list(range(1, 61))


# --- journals of strangers ------------------------------------------------------------------------


@given(st.binary(max_size=300), st.integers(0, 3))
def test_noise_is_refused(noise: bytes, at: int) -> None:
    with pytest.raises(RecordingError):
        decode(noise[:at] + journal_records.MAGIC + noise)


def forged(*rows: tuple[Kind, bytes]) -> bytes:
    """A journal with proven records that hold what ours never do."""
    journal = written(3)
    number = 99
    for kind, content in rows:
        number += 1
        journal.data += encode(kind, number, content, len(journal.data), KEY)
    return bytes(journal.data) + encode(
        Kind.SYNCED, 1000, len(journal.data).to_bytes(8, "little"), len(journal.data), KEY
    )


@pytest.mark.parametrize(
    "row",
    [
        (Kind.FRAME, b""),
        (Kind.FRAME, bytes(64)),
        (Kind.FRAME, b"\xff" * 65),
        (Kind.FRAME, bytes(65)),  # time goes back
        (Kind.COMMAND, b"{"),
        (Kind.COMMAND, b"[1, 1, 1, 1, 1, 1]"),
        (Kind.COMMAND, b'[1, 1e999, "", 1, null, ""]'),
        (Kind.COMMAND, b'[1, 99999999999999999999, "", 1, null, ""]'),
        (Kind.COMMAND, b'[NaN, 1, "", 1, null, ""]'),
        (Kind.COMMAND, b'[1, 1, "", 1, [1], ""]'),
        (Kind.COMMAND, b'[1, 1, "", 1, {"a": 1}, ""]'),
        (Kind.MARK, b'[1, "a"]'),
        (Kind.MARK, b'[[], "a", "b"]'),
        (Kind.MARK, b'["1", "a", "b"]'),
        (Kind.MARK, b'[true, null, "b"]'),
        (Kind.MARK, b"[" * 60_000),
        (Kind.MARK, b"1" * 60_000),
        (Kind.MARK, b"\xff"),
        (Kind.REST, b"abc"),
        (Kind.REST, b"\xff" * 24),
        (Kind.AMEND, b""),
        (Kind.AMEND, AMEND.pack(200, 0.0, 9.0, 0)),
        (Kind.AMEND, AMEND.pack(0, 0.0, 9.0, 3)),
    ],
)
def test_records_that_are_proven_and_make_no_sense_are_refused(row: tuple[Kind, bytes]) -> None:
    with pytest.raises(RecordingError):
        decode(forged(row))


def test_a_proven_record_with_an_old_number_is_passed_over() -> None:
    journal = written(3)
    row = bytes(journal.data[-73:-8])  # of the last frame
    journal.data += encode(Kind.FRAME, 4, row, len(journal.data), KEY)
    journal.synced(len(journal.data))
    decoded = decode(bytes(journal.data))
    assert numbers(decoded) == [1, 2, 3]
    assert decoded.report.damaged_bytes == 86


@pytest.mark.parametrize(
    "content", [KEY, KEY + bytes(4), KEY + b"\xff" * 4, KEY + b"\2\0\0\0PK" + bytes(90)]
)
def test_a_proven_header_that_says_nothing_is_refused(content: bytes) -> None:
    data = encode(Kind.HEADER, 0, content, 0, KEY)
    data += encode(Kind.FRAME, 1, bytes(65), len(data), KEY)
    with pytest.raises(RecordingError):
        decode(data)


def test_a_file_full_of_what_only_looks_like_records_is_given_up() -> None:
    """Each claims 64 KiB, so proving them all would take years."""
    liar = (
        journal_records.MAGIC
        + bytes([Kind.FRAME])
        + (7).to_bytes(4, "little")
        + (60_000).to_bytes(4, "little")
    )
    journal = written(3)
    with pytest.raises(RecordingError, match="only looks like records"):
        decode(bytes(journal.data) + liar * 80_000)


def test_a_file_larger_than_any_journal_is_not_read() -> None:
    with pytest.raises(RecordingError, match="more than the 67108864 allowed"):
        decode(bytes(journals.MAX_BYTES + 1))


def test_a_journal_of_too_many_records_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    data = bytes(written(30).data)
    monkeypatch.setattr("controller.recordings.journal_repair.MAX_RECORDS", 20)
    with pytest.raises(RecordingError, match="more than the 20 records"):
        decode(data)
