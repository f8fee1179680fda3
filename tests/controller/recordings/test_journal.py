"""Journals that a crash or a bad disk has cut, changed or mixed: only whole frames are read."""

import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.recognition.pipeline import CommandRecord
from controller.recordings import journal as journals
from controller.recordings import reader, writer
from controller.recordings.journal import Journal, Kind, decode
from controller.recordings.recorder import Recorder
from controller.recordings.recording import LABELLERS, Mark, Recording, RecordingError
from controller.shared import npz
from tests.support.fake_disk import BLOCK, FakeFile
from tests.support.small_journal import (
    FRAME_BYTES,
    ID,
    ORIGIN,
    UNLABELLED,
    add,
    image,
    numbers,
    written,
)

COMMAND = CommandRecord(0.7, 7, "press", 0.98, (0.5, 3.0), "left")


def whole(journal: Journal) -> Recording:
    recording = decode(bytes(journal.data)).recording
    assert recording is not None
    return recording


# --- what goes in comes out -----------------------------------------------------------------------


def test_all_that_was_recorded_is_read_again() -> None:
    journal = Journal(ORIGIN, {"debounce.mean": np.array([1.0, 0.0, 0.0])}, ID)
    journal.add_mark(0.0, "cue", "get ready")
    journal.add_frame(image(1), 0.1, 1, (1, 2, 0, -1), (0.5, 3.0))
    journal.add_command(COMMAND)
    journal.add_rest(image(0))
    journal.add_rest(image(9))  # the first one counts
    journal.add_frame(image(2), 0.3, 3, UNLABELLED, None)
    journal.add_mark(0.05, "key", "1")  # noted later than it was
    recording = whole(journal)
    assert recording.origin == replace(ORIGIN, id=ID)
    assert recording.frames.tobytes() == image(1).tobytes() + image(2).tobytes()
    assert recording.t.tolist() == [0.1, 0.3]
    assert recording.sequence.tolist() == [1, 3]
    assert [getattr(recording, name)[0] for name in LABELLERS] == [1, 2, 0, -1]
    assert recording.touch[0].tolist() == [0.5, 3.0]
    assert np.isnan(recording.touch[1]).all()
    assert recording.commands == (COMMAND,)
    assert recording.marks == (Mark(0.0, "cue", "get ready"), Mark(0.05, "key", "1"))
    assert recording.rest is not None
    assert recording.rest.tobytes() == image(0).tobytes()
    assert recording.state["debounce.mean"].tolist() == [1.0, 0.0, 0.0]


def test_frames_so_far_are_excluded() -> None:
    journal = written(10)
    journal.exclude(0.3, 0.6)  # not 0.6 itself
    journal.exclude(0.9, 99.0)
    add(journal, 11)
    excluded = np.flatnonzero(whole(journal).excluded)
    assert whole(journal).sequence[excluded].tolist() == [3, 4, 5, 9, 10]


texts = st.text(max_size=30)  # any, zeros and all


@settings(deadline=None)
@given(
    st.floats(allow_nan=True),
    st.integers(-(2**70), 2**70),
    st.lists(st.integers(-2, 3), min_size=4, max_size=4),
    st.lists(st.floats(width=32), min_size=6, max_size=6),
    st.builds(
        CommandRecord,
        st.floats(),
        st.integers(-(2**70), 2**70),
        texts,
        st.floats(),
        st.none() | st.tuples(st.floats(), st.floats()),
        texts,
    ),
    st.tuples(st.floats(), texts, texts | st.just("long" * 1000)),
    st.tuples(st.floats(), st.floats()),
)
def test_what_a_journal_takes_can_be_sealed_and_loaded_again(
    t_s: float,
    number: int,
    who: list[int],
    taxels: list[float],
    command: CommandRecord,
    mark: tuple[float, str, str],
    span: tuple[float, float],
) -> None:
    journal = Journal(ORIGIN, {}, ID)
    frame = np.array(taxels, dtype=np.float32).reshape(2, 3)
    add(journal, 1)
    adding: tuple[Callable[[], None], ...] = (
        lambda: journal.add_rest(frame),
        lambda: journal.add_frame(frame, t_s, number, who, (t_s, t_s)),
        lambda: journal.add_command(command),
        lambda: journal.add_mark(*mark),
        lambda: journal.exclude(*span),
    )
    for add_it in adding:
        with suppress(RecordingError):
            add_it()
    arrays = npz.unpack(writer.pack(whole(journal)), reader.MAX_BYTES)
    assert len(reader.parse(arrays).frames) == len(whole(journal).frames)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"frame": image(2)[:1]}, "frame 2 must be 2×3 numbers below 1e.06"),
        ({"frame": image(2) * np.nan}, "frame 2 must be 2×3 numbers"),
        ({"frame": image(2) * 1e6}, "frame 2 must be 2×3 numbers"),
        ({"t_s": 0.1}, "frame 2 at 0.1 s comes after frame 1 at 0.1 s"),
        ({"t_s": float("nan")}, "number and time must rise"),
        ({"number": 1}, "number and time must rise"),
        ({"labels": (3, -1, -1, -1)}, "has a label that the recording does not name"),
    ],
)
def test_a_frame_that_could_not_be_read_is_refused(change: dict[str, Any], complaint: str) -> None:
    journal = written(1)
    good = {"frame": image(2), "t_s": 0.2, "number": 2, "labels": UNLABELLED}
    with pytest.raises(RecordingError, match=complaint):
        journal.add_frame(**(good | change), touch=None)
    assert numbers(decode(bytes(journal.data))) == [1]


def test_an_impossible_origin_or_state_is_refused_before_the_first_frame() -> None:
    with pytest.raises(RecordingError, match="impossible things about its origin"):
        Journal(replace(ORIGIN, rows=0), {}, ID)
    with pytest.raises(RecordingError, match="state is not all numbers"):
        Journal(ORIGIN, {"mean": np.array([np.inf])}, ID)
    with pytest.raises(RecordingError, match="state is too large"):
        Journal(ORIGIN, {"mean": np.zeros(2 << 20)}, ID)


def test_a_journal_is_full_long_before_it_takes_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journals, "MAX_BYTES", len(written(20).data))
    journal = written(3)
    assert not journal.full
    for number in range(4, 21):
        add(journal, number)
    assert journal.full
    with pytest.raises(RecordingError, match="the journal is full"):
        add(journal, 21)
    assert numbers(decode(bytes(journal.data))) == list(range(1, 21))


def test_the_example_of_a_journal_lies_on_the_disk_as_described() -> None:
    """Kind, length and CRC-32 before each content."""
    data = bytes(written(1).data)
    assert data[:1] == bytes([Kind.HEADER])
    frame = data[-FRAME_BYTES:]
    assert frame[0] == Kind.FRAME
    assert int.from_bytes(frame[1:5], "little") == 41 + 2 * 3 * 4
    assert frame[9 + 41 :] == image(1).tobytes()


# --- crashes and bad disks ------------------------------------------------------------------------


def ends(journal: Journal) -> list[int]:
    """Where the frames end, in bytes."""
    return list(range(len(written(0).data) + FRAME_BYTES, len(journal.data) + 1, FRAME_BYTES))


def test_a_journal_cut_anywhere_is_a_beginning_of_the_recording() -> None:
    journal = written(30)
    data = bytes(journal.data)
    for cut in range(len(written(0).data), len(data) + 1):
        decoded = decode(data[:cut])
        whole_frames = sum(end <= cut for end in ends(journal))
        assert numbers(decoded) == list(range(1, 1 + whole_frames))
        assert cut - decoded.whole_bytes < decoded.frame_bytes == FRAME_BYTES


@given(st.data())
def test_after_a_flipped_bit_nothing_is_read(data: st.DataObject) -> None:
    journal = written(95)
    content = bytearray(journal.data)
    place = data.draw(st.integers(len(written(0).data), len(content) - 1))
    content[place] ^= 1 << data.draw(st.integers(0, 7))
    decoded = decode(bytes(content))
    before = sum(end <= place for end in ends(journal))
    assert numbers(decoded) == list(range(1, 1 + before))
    assert decoded.whole_bytes == [len(written(0).data), *ends(journal)][before]


@settings(deadline=None)
@given(st.permutations(range(8)), st.integers(0, BLOCK))
def test_blocks_that_changed_places_are_no_frames(order: list[int], phase: int) -> None:
    journal = written(500)
    data, start = bytes(journal.data), len(written(0).data) + phase
    blocks = [data[start + k * BLOCK : start + (k + 1) * BLOCK] for k in range(8)]
    moved = data[:start] + b"".join(blocks[k] for k in order) + data[start + 8 * BLOCK :]
    same = next((i for i, (a, b) in enumerate(zip(data, moved, strict=True)) if a != b), len(data))
    found = numbers(decode(moved))
    assert len(found) == sum(end <= same for end in ends(journal))


def test_blocks_of_an_earlier_journal_are_never_taken_for_frames() -> None:
    """As when a file grows over blocks that another one was deleted from."""
    mine, other = bytes(written(60).data), bytes(written(400, ID[::-1]).data)
    assert len(written(0).data) == len(written(0, ID[::-1]).data)
    assert numbers(decode(mine + other[len(mine) :])) == list(range(1, 61))


# --- hostile journals -----------------------------------------------------------------------------


WHOLE = bytes(written(30).data)
BODY = WHOLE[len(written(0).data) :]


@pytest.mark.parametrize("content", [BODY, b"", bytes(9000), WHOLE[:40], b"PK" + bytes(90)])
def test_without_a_header_nothing_is_read(content: bytes) -> None:
    with pytest.raises(RecordingError, match=r"no whole header|is empty"):
        decode(content)
    journal = written(0)
    journal.data.clear()
    journal._crc = 0
    journal._append(Kind.HEADER, content)
    with pytest.raises(RecordingError):
        decode(bytes(journal.data))


@given(st.binary(max_size=300), st.sampled_from([b"", b"\x01"]))
def test_noise_is_refused(noise: bytes, start: bytes) -> None:
    with pytest.raises(RecordingError):
        decode(start + noise)


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
        (Kind.MARK, b'[true, null, "b"]'),
        (Kind.MARK, b"[" * 60_000),
        (Kind.MARK, b"1" * 60_000),
        (Kind.MARK, b"\xff"),
        (Kind.REST, b"abc"),
        (Kind.REST, b"\xff" * 24),
        (Kind.EXCLUDE, b""),
    ],
)
def test_records_that_pass_and_make_no_sense_are_refused(row: tuple[Kind, bytes]) -> None:
    journal = written(3)
    journal._append(*row)
    with pytest.raises(RecordingError):
        decode(bytes(journal.data))


def test_a_file_larger_than_any_journal_is_not_read() -> None:
    with pytest.raises(RecordingError, match="more than the 67108864 allowed"):
        decode(bytes(journals.MAX_BYTES + 1))


def test_a_journal_of_too_many_rows_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    journal = written(3)
    for number in range(20):
        journal.add_mark(number, "key", "pause")
    monkeypatch.setattr(journals, "MAX_ROWS", 19)
    with pytest.raises(RecordingError, match="more than the 19 marks and commands"):
        decode(bytes(journal.data))


# --- the disk -------------------------------------------------------------------------------------


class Threadless(Recorder):
    """A recorder that syncs only when it is told to."""

    def _run(self) -> None:
        pass


@pytest.fixture(scope="module")
def place() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder) / "one.npz"


def record(session: Recorder, number: int) -> None:
    session.journal.add_frame(image(number), number / 10, number)


steps = st.lists(
    st.one_of(
        st.tuples(st.just("frames"), st.integers(1, 60)),
        st.tuples(st.just("sync"), st.just(0)),
        st.tuples(st.just("no room"), st.integers(0, 9000)),
        st.tuples(st.just("no sync"), st.just(0)),
        st.tuples(st.just("write back"), st.integers(0, 2**32)),
    ),
    max_size=12,
)


@settings(deadline=None, max_examples=150)
@given(steps, st.integers(0, 2**32))
def test_a_power_cut_leaves_all_that_was_confirmed(
    place: Path, plan: list[tuple[str, int]], seed: int
) -> None:
    file = FakeFile()
    session = Threadless(place, ORIGIN, {}, create=lambda path: file)
    frames = 0

    def some(count: int) -> None:
        nonlocal frames
        for _ in range(count):
            frames += 1
            record(session, frames)

    file.meanwhile = lambda: some(60)  # the loop goes on: more than a block
    confirmed = 0
    for step, amount in plan:
        if step == "frames":
            some(amount)
        elif step == "write back":  # the system brings some blocks to the disk, in any order
            rng = np.random.default_rng(amount)
            file.write_back([b for b in sorted(file.dirty) if rng.random() < 0.5])
        else:
            file.room = len(file.seen) + amount if step == "no room" else 1 << 40
            file.fails = step == "no sync"
            before = frames
            with suppress(OSError):
                session.sync()
                confirmed = before
    rng = np.random.default_rng(seed)
    file.write_back([b for b in sorted(file.dirty) if rng.random() < 0.5])
    found = numbers(decode(bytes(file.kept)))
    assert found == list(range(1, len(found) + 1))  # a beginning
    assert len(found) >= confirmed  # with all that was confirmed
