"""The recorder: the loop never waits for the disk, and no failure of it loses a session."""

import contextlib
import logging
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.capture.session_recorder import RunFiles
from controller.recognition.pipeline import CommandRecord
from controller.recordings import journal_file, reader, recorder, writer
from controller.recordings.journal import decode
from controller.recordings.journal_file import JournalFile
from controller.recordings.recorder import Recorder, refuse_taken
from controller.recordings.recording import Mark, RecordingError
from controller.shared import files
from tests.support import ROOT
from tests.support.fake_disk import FakeFile
from tests.support.small_journal import ORIGIN, image, numbers
from tests.support.waiting import until

COMMAND = CommandRecord(0.2, 2, "press", 0.98, (0.5, 3.0), "left")


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the thread take its turns without rest."""
    monkeypatch.setattr(recorder, "SYNC_S", 0.001)
    monkeypatch.setattr(recorder, "RETRY_S", 0.001)


def add(to: Recorder, first: int, last: int) -> None:
    for number in range(first, last + 1):
        to.journal.add_frame(image(number), number / 10, number)


def on_disk(file: FakeFile) -> list[int]:
    """The frames that a power cut would leave."""
    return numbers(decode(bytes(file.kept)))


# --- as it should be ------------------------------------------------------------------------------


def test_a_closed_session_is_one_file_that_says_everything(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    session = Recorder(path, ORIGIN, {"debounce.mean": np.array([1.0, 0.0])})
    assert [p.name for p in tmp_path.iterdir()] == ["one.journal"]
    session.journal.add_mark(0.0, "cue", "get ready")
    session.journal.add_rest(image(0))
    session.journal.add_frame(image(1), 0.1, 1, (1, 2, -1, 1))
    session.journal.add_frame(image(2), 0.2, 2, touch=(0.5, 3.0))
    session.journal.add_command(COMMAND)
    session.journal.exclude(0.15, 9.0)
    assert session.problem == ""
    assert not session.journal.full
    assert session.close() == path
    assert session.close() is None  # only once
    assert [p.name for p in tmp_path.iterdir()] == ["one.npz"]
    loaded = reader.load(path)
    assert loaded.origin == session.origin == replace(ORIGIN, id=session.origin.id)
    assert len(session.origin.id) == 32
    assert loaded.button.tolist() == [2, -1]
    assert loaded.cue.tolist() == [1, -1]
    assert loaded.excluded.tolist() == [False, True]
    assert loaded.commands == (COMMAND,)
    assert loaded.marks == (Mark(0.0, "cue", "get ready"),)
    assert loaded.rest is not None


def test_the_journal_precedes_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(journal_file, "sync_folder", synced.append)
    session = Recorder(tmp_path / "one.npz", ORIGIN, {})
    assert synced == [tmp_path]
    decoded = decode((tmp_path / "one.journal").read_bytes())
    assert decoded.recording is None  # the header alone is there
    assert decoded.whole_bytes == len(session.journal.data)
    session.close()


def test_frames_reach_the_disk_while_the_session_runs(tmp_path: Path) -> None:
    file = FakeFile()
    session = Recorder(tmp_path / "one.npz", ORIGIN, {}, create=lambda path: file)
    add(session, 1, 20)
    file.until(lambda: on_disk(file) == list(range(1, 21)))
    add(session, 21, 25)
    file.until(lambda: on_disk(file) == list(range(1, 26)))
    assert session.close() == tmp_path / "one.npz"
    assert file.removed


def test_a_journal_that_is_being_written_is_left_alone_by_recovery(tmp_path: Path) -> None:
    session = Recorder(tmp_path / "one.npz", ORIGIN, {})
    add(session, 1, 3)
    [journal] = journal_file.leftovers(tmp_path)
    with pytest.raises(journal_file.LockedError, match="is being recorded"):
        journal_file.recover(journal)
    with pytest.raises(RecordingError, match="being recorded, or a crash left it"):
        Recorder(tmp_path / "one.npz", ORIGIN, {})
    session.close()


def test_a_process_that_is_killed_leaves_its_journal_to_recovery(tmp_path: Path) -> None:
    script = """
import os, signal, sys
from pathlib import Path
from controller.recordings import recorder
from tests.controller.recordings.test_recorder import ORIGIN, Recorder, add
recorder.SYNC_S = 0.001
session = Recorder(Path(sys.argv[1]), ORIGIN, {})
add(session, 1, 50)
while session._synced < len(session.journal.data):
    pass
os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))
"""
    path = tmp_path / "one.npz"
    subprocess.run([sys.executable, "-c", script, path], cwd=ROOT, timeout=60)
    [journal] = journal_file.leftovers(tmp_path)
    assert journal_file.recover(journal).path == path
    assert reader.load(path).sequence.tolist() == list(range(1, 51))


# --- a disk with trouble --------------------------------------------------------------------------


def test_a_full_disk_is_reported_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "controller")
    file = FakeFile()
    session = Recorder(tmp_path / "one.npz", ORIGIN, {}, create=lambda path: file)
    file.room = len(file.seen) + 1000  # in the middle of a record
    add(session, 1, 100)
    until(lambda: session.problem != "")
    assert "no space left on device; make room, or look" in session.problem
    add(session, 101, 120)
    file.room = 1 << 40
    file.until(lambda: on_disk(file) == list(range(1, 121)))
    until(lambda: session.problem == "")
    session.close()
    told = [r.message for r in caplog.records]
    assert len(told) == 2
    assert "cannot write" in told[0]
    assert "is up to date again" in told[1]
    assert len(reader.load(tmp_path / "one.npz").frames) == 120


def test_a_disk_that_takes_little_at_a_time_gets_it_all(tmp_path: Path) -> None:
    class Slow(FileIO):
        def write(self, data: Any, /) -> int:
            return super().write(data[:7])

    file = JournalFile(tmp_path / "one.journal")
    file._file.close()
    file._file = Slow(tmp_path / "one.journal", "r+")
    file.write(0, bytes(range(100)))
    file.close()
    assert (tmp_path / "one.journal").read_bytes() == bytes(range(100))


def test_a_disk_that_is_too_slow_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = iter(range(0, 10_000, 3))  # every look at the clock is 3 s after the one before
    monkeypatch.setattr(recorder, "monotonic", lambda: float(next(ticks)))
    session = Recorder(tmp_path / "one.npz", ORIGIN, {})
    add(session, 1, 3)
    until(lambda: "the disk took 3.0 s" in session.problem)
    session.close()


def test_a_disk_that_is_full_from_the_start_is_refused(tmp_path: Path) -> None:
    file = FakeFile()
    file.room = 100
    with pytest.raises(RecordingError, match=r"cannot write .*one\.journal: no space left"):
        Recorder(tmp_path / "one.npz", ORIGIN, {}, create=lambda path: file)
    assert file.removed


# --- places that are taken, gone or full ----------------------------------------------------------


def test_a_file_that_exists_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    (tmp_path / "one.npz").write_text("precious")
    with pytest.raises(RecordingError, match="exists and is kept"):
        refuse_taken(tmp_path / "one.npz")
    with pytest.raises(RecordingError, match="cannot write into"):
        refuse_taken(tmp_path / "absent" / "two.npz")
    refuse_taken(tmp_path / "two.npz")
    assert [p.name for p in tmp_path.iterdir()] == ["one.npz"]


def test_five_programs_that_begin_at_once_get_a_file_each(tmp_path: Path) -> None:
    """All have looked for a free name before any of them has taken one."""
    everyone = threading.Barrier(5)

    def record(path: Path) -> Recorder:
        with contextlib.suppress(threading.BrokenBarrierError):
            everyone.wait(20.0)
        everyone.abort()  # the second choice is made without the others
        return Recorder(path, ORIGIN, {})

    starts = [RunFiles(tmp_path, "ab", "20200101") for _ in range(5)]
    with ThreadPoolExecutor(5) as pool:
        begun = list(pool.map(lambda runs: runs.begin(record), starts))
    for number, session in enumerate(begun):
        add(session, 1, number + 1)
        session.close()
    names = [f"sub-ab_ses-20200101_run-0{number}.npz" for number in range(1, 6)]
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    assert sorted(len(reader.load(tmp_path / name).t) for name in names) == [1, 2, 3, 4, 5]


def test_a_file_that_was_named_comes_first(tmp_path: Path) -> None:
    runs = RunFiles(tmp_path / "mine.npz", "", "20200101")
    (tmp_path / "mine-2.npz").write_text("precious")

    def record(path: Path) -> Recorder:
        return Recorder(path, ORIGIN, {})

    runs.begin(record).close()  # nothing was recorded
    made = []
    for _ in range(2):
        session = runs.begin(record)
        add(session, 1, 3)
        made.append(session.close())
    assert made == [tmp_path / "mine.npz", tmp_path / "mine-3.npz"]
    with pytest.raises(RecordingError, match="exists and is kept as it is"):
        RunFiles(tmp_path / "mine.npz", "", "20200101")


def test_a_name_that_was_taken_meanwhile_is_left(tmp_path: Path) -> None:
    path = tmp_path / "sub-ab_ses-20200101_run-01.npz"
    session = Recorder(path, ORIGIN, {})
    add(session, 1, 3)
    path.write_text("precious")
    with pytest.raises(RecordingError, match=r"appeared meanwhile; recorded into .*run-02\.npz"):
        session.close()
    assert path.read_text() == "precious"
    assert len(reader.load(tmp_path / "sub-ab_ses-20200101_run-02.npz").frames) == 3
    assert not journal_file.leftovers(tmp_path)


def spoil(
    monkeypatch: pytest.MonkeyPatch, folder: Path, becomes: Callable[[bytes], bytes | None]
) -> None:
    """Let what is sealed into a folder become something else; None: there is no room."""
    real = files.atomic_write

    def write(path: Path, data: bytes, **options: bool) -> None:
        content = becomes(data) if path.parent == folder else data
        if content is None:
            raise OSError(28, "No space left on device")
        real(path, content, **options)

    monkeypatch.setattr(writer, "atomic_write", write)


@pytest.fixture
def rescue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where temporary files go."""
    folder = tmp_path / "rescue"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


def rescued(folder: Path) -> int:
    """Return the frames of the one session in a temporary folder, which is private."""
    (file,) = folder.glob("orbtouch-*/one.npz")
    assert file.parent.stat().st_mode & 0o077 == 0
    return len(reader.load(file).frames)


@pytest.mark.parametrize(
    ("becomes", "complaint"),
    [
        (lambda data: None, "no space left on device; the session is kept in"),
        (lambda data: data[:-1], "cannot be read again; the session is kept in"),
    ],
    ids=["a full disk", "a file that is read back short"],
)
def test_a_session_that_cannot_be_sealed_is_kept_elsewhere(
    becomes: Callable[[bytes], bytes | None], complaint: str,
    tmp_path: Path, rescue: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    file = FakeFile()
    session = Recorder(tmp_path / "one.npz", ORIGIN, {}, create=lambda path: file)
    add(session, 1, 5)
    spoil(monkeypatch, tmp_path, becomes)
    with pytest.raises(RecordingError, match=complaint):
        session.close()
    assert rescued(rescue) == 5
    assert on_disk(file) == [1, 2, 3, 4, 5]
    assert file.closed
    assert not file.removed


def test_without_space_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writer, "atomic_write", full)
    session = Recorder(tmp_path / "one.npz", ORIGIN, {})
    add(session, 1, 5)
    with pytest.raises(RecordingError, match=r"took is in .*one\.journal: make room, `controller"):
        session.close()
    monkeypatch.undo()
    assert journal_file.recover(tmp_path / "one.journal").path == tmp_path / "one.npz"
    assert len(reader.load(tmp_path / "one.npz").frames) == 5


def test_a_disk_that_hangs_is_not_waited_for_at_the_end(
    tmp_path: Path, rescue: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "HANG_S", 0.01)
    file = FakeFile()
    session = Recorder(tmp_path / "one.npz", ORIGIN, {}, create=lambda path: file)
    file.answers.clear()
    add(session, 1, 5)
    with pytest.raises(RecordingError, match="does not answer; the session is kept in"):
        session.close()
    file.answers.set()
    assert rescued(rescue) == 5


# --- names ----------------------------------------------------------------------------------------


def test_runs_are_counted_on_whatever_of_them_is_left(tmp_path: Path) -> None:
    def following() -> str:
        return writer.next_free(tmp_path, "anna", "20200131").name

    assert following() == "sub-anna_ses-20200131_run-01.npz"
    (tmp_path / "sub-anna_ses-20200131_run-01.journal").touch()
    assert following() == "sub-anna_ses-20200131_run-02.npz"
    (tmp_path / "sub-anna_ses-20200131_run-09.npz").touch()
    (tmp_path / "sub-Anna_ses-20200131_run-10.npz").touch()  # the same file on some systems
    (tmp_path / "sub-annabel_ses-20200131_run-30.npz").touch()
    assert following() == "sub-anna_ses-20200131_run-11.npz"
    (tmp_path / "sub-anna_ses-20200131_run-99.journal.damaged").touch()
    assert following() == "sub-anna_ses-20200131_run-100.npz"
    absent = writer.next_free(tmp_path / "absent", "a", "1")
    assert absent.name == "sub-a_ses-1_run-01.npz"


@pytest.mark.parametrize("name", ["", "a b", "../a", "a_b", "ä", "a" * 65])
def test_an_id_is_letters_and_digits(tmp_path: Path, name: str) -> None:
    with pytest.raises(RecordingError, match=r"letters \(a to z\) and digits"):
        writer.next_free(tmp_path, name, "20200131")
    with pytest.raises(RecordingError, match=r"letters \(a to z\) and digits"):
        writer.next_free(tmp_path, "anna", name)
