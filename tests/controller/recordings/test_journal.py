"""The journal: whatever a crash or a bad disk leaves of one, nothing wrong is read out of it."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller import npz
from controller.recognition.pipeline import CommandRecord
from controller.recordings import journal as journals
from controller.recordings import journal_records, reader, writer
from controller.recordings.journal import AMENDABLE, NOWHERE, Journal
from controller.recordings.journal_records import Kind
from controller.recordings.journal_repair import decode
from controller.recordings.recorder_thread import JournalThread
from controller.recordings.recording import LABELLERS, Mark, Recording, RecordingError
from tests.support.fake_disk import FakeFile
from tests.support.small_journal import KEY, NOBODY, ORIGIN, add, image, numbers, written

COMMAND = CommandRecord(0.7, 7, "press", 0.98, (0.5, 3.0), "left")


def whole(journal: Journal) -> Recording:
    recording = decode(bytes(journal.data)).recording
    assert recording is not None
    return recording


# --- what goes in comes out -----------------------------------------------------------------------


def test_all_that_was_recorded_is_read_again() -> None:
    journal = Journal(ORIGIN, {"debounce.mean": np.array([1.0, 0.0, 0.0])}, KEY)
    journal.mark(0.0, "cue", "get ready")
    journal.frame(image(1), 0.1, 1, (1, 2, 0, -1), True, (0.5, 3.0))
    journal.command(COMMAND)
    journal.rest(image(0))
    journal.rest(image(9))  # the first one counts
    journal.frame(image(2), 0.3, 3, NOBODY, False, NOWHERE)
    journal.mark(0.05, "key", "1")  # noted later than it was
    recording = whole(journal)
    assert recording.origin == replace(ORIGIN, id=KEY.hex())
    assert recording.frames.tobytes() == image(1).tobytes() + image(2).tobytes()
    assert recording.t.tolist() == [0.1, 0.3]
    assert recording.sequence.tolist() == [1, 3]
    assert [getattr(recording, name)[0] for name in LABELLERS] == [1, 2, 0, -1]
    assert recording.excluded.tolist() == [True, False]
    assert recording.touch[0].tolist() == [0.5, 3.0]
    assert np.isnan(recording.touch[1]).all()
    assert recording.commands == (COMMAND,)
    assert recording.marks == (Mark(0.0, "cue", "get ready"), Mark(0.05, "key", "1"))
    assert recording.rest is not None
    assert recording.rest.tobytes() == image(0).tobytes()
    assert recording.state["debounce.mean"].tolist() == [1.0, 0.0, 0.0]


def test_a_label_is_amended_in_the_frames_so_far() -> None:
    journal = written(10)
    journal.amend("key", 0.3, 0.6, 2)  # not 0.6 itself
    journal.amend("key", 0.5, 99.0, 1)
    journal.amend("excluded", 0.9, 99.0, 1)
    add(journal, 11)
    assert whole(journal).key.tolist() == [-1, -1, 2, 2, 1, 1, 1, 1, 1, 1, -1]
    assert whole(journal).excluded.tolist() == [False] * 8 + [True, True, False]


amendments = st.tuples(
    st.sampled_from(AMENDABLE), st.floats(-1, 3), st.floats(-1, 3), st.integers(0, 1)
)


@given(st.lists(amendments, max_size=12))
def test_of_amendments_that_overlap_the_later_one_counts(
    several: list[tuple[str, float, float, int]],
) -> None:
    journal = written(20)
    expected = {name: getattr(whole(journal), name).copy() for name in AMENDABLE}
    t = np.arange(1, 21) / 10
    for column, from_s, to_s, value in several:
        journal.amend(column, from_s, to_s, value)
        expected[column][(t >= from_s) & (t < to_s)] = value
    for name, column in expected.items():
        np.testing.assert_array_equal(getattr(whole(journal), name), column)


def test_two_journals_of_the_same_frames_have_nothing_but_their_ids_to_tell_them_apart() -> None:
    assert len(written(20).data) == len(written(20, key=bytes(16)).data)
    assert written(20).data != written(20, key=bytes(16)).data


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
    st.tuples(st.sampled_from([*AMENDABLE, "t"]), st.floats(), st.floats(), st.integers(-3, 4)),
)
def test_what_a_journal_takes_can_be_sealed_and_loaded_again(
    t_s: float,
    number: int,
    who: list[int],
    taxels: list[float],
    command: CommandRecord,
    mark: tuple[float, str, str],
    amend: tuple[str, float, float, int],
) -> None:
    journal = Journal(ORIGIN, {}, KEY)
    frame = np.array(taxels, dtype=np.float32).reshape(2, 3)
    add(journal, 1)
    with suppress(RecordingError):
        journal.rest(frame)
    with suppress(RecordingError):
        journal.frame(frame, t_s, number, who, False, (t_s, t_s))
    with suppress(RecordingError):
        journal.command(command)
    with suppress(RecordingError):
        journal.mark(*mark)
    with suppress(RecordingError):
        journal.amend(*amend)
    arrays = npz.unpack(writer.pack(whole(journal)), reader.MAX_BYTES)
    assert len(reader.parse(arrays).frames) == journal.frames


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"frame": image(2)[:1]}, "frame 2 must be 2×3 numbers below 1e.06"),
        ({"frame": image(2) * np.nan}, "frame 2 must be 2×3 numbers"),
        ({"frame": image(2) * 1e6}, "frame 2 must be 2×3 numbers"),
        ({"t_s": 0.1}, "frame 2 at 0.1 s comes after frame 1 at 0.1 s"),
        ({"t_s": float("nan")}, "number and time must rise"),
        ({"number": 1}, "number and time must rise"),
        ({"who": (3, -1, -1, -1)}, "has a label that the recording does not name"),
    ],
)
def test_a_frame_that_could_not_be_read_again_is_refused_at_once(
    change: dict[str, Any], complaint: str
) -> None:
    journal = written(1)
    good = {"frame": image(2), "t_s": 0.2, "number": 2, "who": NOBODY}
    with pytest.raises(RecordingError, match=complaint):
        journal.frame(**(good | change), excluded=False, touch=NOWHERE)
    assert numbers(decode(bytes(journal.data))) == [1]


def test_an_origin_or_state_that_no_recording_can_have_is_refused_before_the_first_frame() -> None:
    with pytest.raises(RecordingError, match="impossible things about its origin"):
        Journal(replace(ORIGIN, rows=0), {}, KEY)
    with pytest.raises(RecordingError, match="state is not all numbers"):
        Journal(ORIGIN, {"mean": np.array([np.inf])}, KEY)
    with pytest.raises(RecordingError, match="remembers too much"):
        Journal(ORIGIN, {"mean": np.zeros(2 << 20)}, KEY)


def test_a_journal_is_full_long_before_it_takes_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journals, "MAX_RECORDS", 24)
    # Two headers and what fills their blocks are four records.
    journal = written(7, sync_every=99)
    assert not journal.full
    add(journal, 8)
    assert journal.full
    for number in range(9, 21):
        add(journal, number)
    with pytest.raises(RecordingError, match="the journal is full"):
        add(journal, 21)
    assert numbers(decode(bytes(journal.data))) == list(range(1, 21))


def test_the_example_of_a_journal_lies_on_the_disk_as_described(tmp_path: Path) -> None:
    """13 bytes, a payload and 8 bytes for each record; the headers fill whole blocks."""
    journal = written(1)
    data = bytes(journal.data)
    assert data[:5] == b"\xc2OJ\x1b\x01"
    assert data[13:29] == KEY
    frame = data[journal.head :]
    assert frame[:4] == journal_records.MAGIC
    assert frame[4] == Kind.FRAME
    assert (
        int.from_bytes(frame[5:9], "little") == 4
    )  # after the headers and what fills their blocks
    assert int.from_bytes(frame[9:13], "little") == 41 + 2 * 3 * 4
    assert frame[13 + 41 : -8] == image(1).tobytes()


# --- crashes --------------------------------------------------------------------------------------


def test_a_journal_cut_anywhere_is_a_beginning_of_the_recording() -> None:
    journal = written(30)
    data = bytes(journal.data)
    ends = [r.end for r in journal_records.scan(data, KEY) if r.kind is Kind.FRAME]
    for cut in range(journal.head, len(data) + 1):
        decoded = decode(data[:cut])
        assert numbers(decoded) == list(range(1, 1 + sum(end <= cut for end in ends)))
        assert decoded.report.damaged_bytes == 0


def test_after_the_last_confirmed_offset_the_first_gap_is_the_end() -> None:
    data = bytearray(written(95).data)
    ends = [r.end for r in journal_records.scan(bytes(data), KEY) if r.kind is Kind.FRAME]
    data[ends[90] - 20] ^= 1  # in frame 91; the disk confirmed frame 90
    decoded = decode(bytes(data))
    assert numbers(decoded) == list(range(1, 91))
    assert decoded.report.left_out == 4  # frames 92 to 95 are whole, and after a gap
    assert decoded.report.cut_bytes == len(data) - (ends[90] - 86)
    assert decoded.report.damaged_bytes == 0


def test_a_frame_that_comes_while_the_disk_works_waits_for_the_next_turn() -> None:
    journal, file = Journal(ORIGIN, {}, KEY), FakeFile()
    keeper = JournalThread(journal, file)
    keeper.turn()
    add(journal, 1)
    file.meanwhile = lambda: add(journal, 2)
    keeper.turn()
    assert numbers(decode(bytes(file.kept))) == [1]
    file.meanwhile = lambda: None
    keeper.turn()
    assert numbers(decode(bytes(file.kept))) == [1, 2]
    syncs = file.syncs
    keeper.turn()
    assert file.syncs == syncs  # nothing is new


steps = st.lists(
    st.one_of(
        st.tuples(st.just("frames"), st.integers(1, 60)),
        st.tuples(st.just("turn"), st.integers(1, 5000)),  # bytes that one write takes
        st.tuples(st.just("no room"), st.integers(0, 9000)),
        st.tuples(st.just("no sync"), st.just(0)),
        st.tuples(st.just("write back"), st.integers(0, 2**32)),
    ),
    max_size=12,
)


@settings(deadline=None, max_examples=150)
@given(steps, st.integers(0, 2**32))
def test_whatever_the_disk_does_a_power_cut_leaves_all_that_was_confirmed(
    plan: list[tuple[str, int]], seed: int
) -> None:
    journal, file = Journal(ORIGIN, {}, KEY), FakeFile()
    keeper = JournalThread(journal, file)
    keeper.turn()

    def some(count: int) -> None:
        for _ in range(count):
            add(journal, journal.frames + 1)

    file.meanwhile = lambda: some(60)  # the loop goes on: more than a block
    confirmed = 0
    for step, amount in plan:
        if step == "frames":
            some(amount)
        elif step == "write back":  # the system brings some blocks to the disk, in any order
            rng = np.random.default_rng(amount)
            file.write_back([b for b in sorted(file.dirty) if rng.random() < 0.5])
        else:
            file.bite = amount if step == "turn" else 1 << 40
            file.room = len(file.seen) + amount if step == "no room" else 1 << 40
            file.fails = step == "no sync"
            before = journal.frames
            with suppress(OSError):
                keeper.turn()
                confirmed = before
    rng = np.random.default_rng(seed)
    file.write_back([b for b in sorted(file.dirty) if rng.random() < 0.5])
    decoded = decode(bytes(file.kept))
    found = numbers(decoded)
    assert found == list(range(1, len(found) + 1))  # a beginning
    assert len(found) >= confirmed  # with all that was confirmed
    assert decoded.report.damaged_bytes == 0  # and what is missing is not blamed on the disk
