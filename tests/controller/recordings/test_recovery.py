"""Recovery: a journal that a crash left becomes its recording, and nothing is lost on the way."""

import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from controller.recordings import journal_file, reader
from controller.recordings.journal import decode
from controller.recordings.journal_file import leftovers, recover
from controller.recordings.recorder import Recorder
from controller.recordings.recording import RecordingError
from tests.support.small_journal import FRAME_BYTES, ID, ORIGIN, image, numbers, written


def left(folder: Path, frames: int = 30, name: str = "one", damaged: bool = False) -> Path:
    """A journal as a crash leaves it; where it is damaged, the fifth frame from the end was hit."""
    journal = written(frames)
    if damaged:
        journal.data[-5 * FRAME_BYTES + 30] ^= 1
    path = folder / f"{name}.journal"
    path.write_bytes(journal.data)
    return path


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_journal_becomes_its_recording_and_is_removed(tmp_path: Path) -> None:
    journal = left(tmp_path)
    assert leftovers(tmp_path) == [journal]
    recovered = recover(journal)
    assert recovered.path == tmp_path / "one.npz"
    assert recovered.line == f"recovered 30 frames (2.9 s) into {recovered.path}"
    assert names(tmp_path) == ["one.npz"]
    loaded = reader.load(recovered.path)
    assert loaded.frames[29].tobytes() == image(30).tobytes()
    assert loaded.origin.id == ID


def test_a_journal_with_damage_is_kept_beside_what_was_whole(tmp_path: Path) -> None:
    recovered = recover(left(tmp_path, damaged=True))
    assert names(tmp_path) == ["one.journal.damaged", "one.npz"]
    kept = tmp_path / "one.journal.damaged"
    assert recovered.line == (
        f"recovered 25 frames (2.4 s) into {tmp_path / 'one.npz'}; its last {5 * FRAME_BYTES} "
        f"bytes follow a damaged record; the journal is kept as {kept}"
    )
    assert reader.load(tmp_path / "one.npz").sequence.tolist() == list(range(1, 26))
    recover(left(tmp_path, 40, damaged=True))  # the next one damaged has a name of its own
    assert {"one.journal-2.damaged", "one.journal.damaged"} < set(names(tmp_path))


def test_what_a_crash_tore_is_no_damage(tmp_path: Path) -> None:
    journal = left(tmp_path)
    journal.write_bytes(journal.read_bytes()[:-50])
    recover(journal)
    assert names(tmp_path) == ["one.npz"]


def test_a_name_that_another_session_took_is_left(tmp_path: Path) -> None:
    (tmp_path / "one.npz").write_text("precious")
    assert recover(left(tmp_path)).path == tmp_path / "one-2.npz"
    assert recover(left(tmp_path)).path == tmp_path / "one-2.npz"  # once is enough
    assert recover(left(tmp_path, frames=31)).path == tmp_path / "one-3.npz"  # holds more
    assert (tmp_path / "one.npz").read_text() == "precious"


def test_the_next_name_is_none_that_is_being_recorded(tmp_path: Path) -> None:
    (tmp_path / "one_run-01.npz").write_text("precious")
    (tmp_path / "one_run-02.journal").touch()
    assert recover(left(tmp_path, name="one_run-01")).path == tmp_path / "one_run-03.npz"


def test_a_journal_without_a_frame_is_removed(tmp_path: Path) -> None:
    recovered = recover(left(tmp_path, frames=0))
    assert recovered.path is None
    assert recovered.line == f"{tmp_path / 'one.journal'} held no frame"
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "is empty; it is kept as it is"),
        (bytes(9000), "has no whole header; it is kept"),
        (bytes(written(30).data[4:]), "has no whole header; it is kept"),
    ],
)
def test_an_unreadable_journal_is_kept(tmp_path: Path, content: bytes, complaint: str) -> None:
    path = tmp_path / "one.journal"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=rf"the journal .*one\.journal {complaint}"):
        recover(path)
    assert path.read_bytes() == content
    assert names(tmp_path) == ["one.journal"]


def test_only_plain_files_are_journals(tmp_path: Path) -> None:
    (tmp_path / "folder.journal").mkdir()
    real = left(tmp_path)
    (tmp_path / "link.journal").symlink_to(real)
    assert leftovers(tmp_path) == [real]
    assert leftovers(tmp_path / "absent") == []
    for name in ("folder.journal", "link.journal", "absent.journal"):
        with pytest.raises(RecordingError, match="is not a file"):
            recover(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no pipes with names")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.journal")
    assert leftovers(tmp_path) == []
    with pytest.raises(RecordingError, match="is not a file"):
        recover(tmp_path / "pipe.journal")


def test_a_journal_kept_as_damaged_can_be_tried_again_and_stays(tmp_path: Path) -> None:
    recover(left(tmp_path, damaged=True))
    kept = tmp_path / "one.journal.damaged"
    (tmp_path / "one.npz").unlink()
    assert recover(kept).path == tmp_path / "one.npz"
    assert names(tmp_path) == ["one.journal.damaged", "one.npz"]


def test_what_the_disk_reads_before_a_bad_block_is_recovered() -> None:
    class BadDisk(io.BytesIO):
        def read(self, size: int | None = -1, /) -> bytes:
            if self.tell() + (size or 0) > bad:
                raise OSError(5, "Input/output error")
            return super().read(size)

    data = bytes(written(400).data)
    bad = 5 * 4096
    read = journal_file._read(BadDisk(data), len(data))
    assert read == data[:bad]
    assert len(numbers(decode(read))) > 200


class PowerCutError(BaseException):
    """The computer is off: nothing that would tidy up can run."""


CALLS: list[tuple[Any, str]] = [
    (os, "link"), (os, "unlink"), (os, "rename"), (os, "fsync"), (os, "chmod"), (os, "open"),
]  # fmt: skip


@contextmanager
def cut_before(call: int, monkeypatch: pytest.MonkeyPatch, happened: list[str]) -> Iterator[None]:
    """Cut the power before the n-th call that changes the disk; note the calls before it."""

    def guard(name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def guarded(*args: Any, **kwargs: Any) -> Any:
            if len(happened) >= call:
                raise PowerCutError
            happened.append(name)
            return real(*args, **kwargs)

        return guarded

    with monkeypatch.context() as patch:
        for module, name in CALLS:
            patch.setattr(module, name, guard(name, getattr(module, name)))
        with suppress(PowerCutError):
            yield


@pytest.mark.parametrize(
    ("damaged", "links"), [(False, True), (False, False), (True, True), (True, False), (None, True)]
)
def test_a_power_cut_anywhere_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damaged: bool | None, links: bool
) -> None:
    """In the recovery of a journal, or (damaged is None) when a recorder seals its own."""

    def no_links(*_: Any) -> None:
        raise OSError(1, "Operation not permitted")

    if not links:  # as on a memory stick
        monkeypatch.setattr(os, "link", no_links)
    frames = 25 if damaged else 30
    for call in range(1000):
        folder = tmp_path / str(call)
        folder.mkdir()
        finished, session = False, None
        if damaged is None:
            session = Recorder(folder / "one.npz", ORIGIN, {})
            for number in range(1, 31):
                session.journal.add_frame(image(number), number / 10, number)
            session.sync()  # all is on the disk, so the thread has nothing more to do
        else:
            journal = left(folder, damaged=damaged)
        with cut_before(call, monkeypatch, []):
            finished = bool(session.close() if session else recover(journal))
        if session:
            session._file.close()  # as the end of a process does
        sealed = folder / "one.npz"
        kept = [p for p in folder.iterdir() if ".journal" in p.name]
        assert kept or len(reader.load(sealed).frames) == frames  # at any moment
        if sealed.exists():  # under its name a file is whole, or is not there
            assert len(reader.load(sealed).frames) == frames
        for path in leftovers(folder):
            recover(path)
        found = [p for p in folder.iterdir() if not p.name.startswith(".")]
        expected = ["one.journal.damaged", "one.npz"] if damaged else ["one.npz"]
        assert sorted(p.name for p in found) == expected
        assert len(reader.load(sealed).frames) == frames
        if finished:
            break
    assert call > 5  # there was something to interrupt


def test_the_journal_goes_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    happened: list[str] = []
    with cut_before(99, monkeypatch, happened):
        recover(left(tmp_path))
    # Written aside and synced, named, the other name removed, names synced; then the journal.
    calls = [call for call in happened if call in ("fsync", "link", "unlink")]
    assert calls == ["fsync", "link", "unlink", "fsync", "unlink", "fsync"]


def test_a_sealed_journal_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def replace(file: object) -> None:
        journal.unlink()
        journal.write_text("the next one of this name")

    journal = left(tmp_path)
    monkeypatch.setattr(journal_file, "lock", replace)
    with pytest.raises(RecordingError, match="has been sealed meanwhile"):
        recover(journal)
    assert journal.read_text() == "the next one of this name"
