"""Recordings that the host on the link starts, and how all of them are deleted."""

from pathlib import Path

from controller.recordings.journal_file import JournalFile
from controller.runtime.link_recording import LinkRecording
from controller.runtime.worker import Worker


def test_delete_all_leaves_nothing_but_the_recording_under_way(tmp_path: Path) -> None:
    for name in ("one.npz", "crashed.journal", ".two.npz.0123abcd"):
        (tmp_path / name).write_bytes(b"of a person")
    running = JournalFile(tmp_path / "now.journal")
    recordings = LinkRecording(tmp_path, Worker())
    assert recordings.delete() == 2  # and what replaces a file is no recording
    assert [path.name for path in tmp_path.iterdir()] == ["now.journal"]
    running.close()
    assert recordings.delete() == 1
    assert not list(tmp_path.iterdir())


def test_where_nothing_was_recorded_nothing_is_deleted(tmp_path: Path) -> None:
    assert LinkRecording(tmp_path / "none", Worker()).delete() == 0
