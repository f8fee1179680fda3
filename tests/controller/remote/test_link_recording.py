"""Recordings that the host on the link starts, and how all of them are deleted."""

import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from controller.adapt.examples import Example
from controller.recordings import journal_file
from controller.recordings.journal_file import JournalFile
from controller.recordings.recorder import Recorder
from controller.recordings.recording import Provenance, RecordingError
from controller.remote import link_recording
from controller.remote.examples import ExampleStore, PendingExample
from tests.support.killed import at_each_call

IMAGES = np.ones((30, 5, 5), np.float32)


def test_delete_all_leaves_nothing_but_the_recording_under_way(tmp_path: Path) -> None:
    for name in ("one.npz", "crashed.journal", ".two.npz.0123abcd"):
        (tmp_path / name).write_bytes(b"of a person")
    running = JournalFile(tmp_path / "now.journal")
    assert link_recording.delete(tmp_path) == 2  # and what replaces a file is no recording
    assert [path.name for path in tmp_path.iterdir()] == ["now.journal"]
    running.close()
    assert link_recording.delete(tmp_path) == 1
    assert not list(tmp_path.iterdir())


def test_where_nothing_was_recorded_nothing_is_deleted(tmp_path: Path) -> None:
    assert link_recording.delete(tmp_path / "none") == 0


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork")
@pytest.mark.parametrize("recovered", [False, True])
def test_nothing_of_a_recording_is_left_wherever_its_program_was_killed(
    tmp_path: Path, recovered: bool
) -> None:
    origin = Provenance("test", 5, 5, 10.0, 10.0, ("null", "press"), "", "", "")
    killed = 0

    def work() -> None:
        recorder = Recorder(tmp_path / "one.npz", origin, {})
        for number in range(1, 4):
            recorder.journal.add_frame(IMAGES[0], number / 10.0, number)
        recorder.close()

    for _ in at_each_call(work, lambda: link_recording.delete(tmp_path)):
        killed += 1
        for journal in journal_file.leftovers(tmp_path) if recovered else ():
            with suppress(RecordingError):  # it holds no frame yet
                journal_file.recover(journal)
        link_recording.delete(tmp_path)
        assert not list(tmp_path.iterdir())
    assert killed > 8


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork")
def test_nothing_of_an_example_is_left_wherever_its_program_was_killed(tmp_path: Path) -> None:
    example = PendingExample(7, Example("swipe", IMAGES, span=(10.0, 20.0)), 10.0)
    store, killed = ExampleStore(tmp_path, (5, 5), 10.0), 0
    for _ in at_each_call(lambda: store.keep(example), store.delete):
        killed += 1
        assert set(ExampleStore(tmp_path, (5, 5), 10.0).pending) <= {7}
        store.delete()
        assert not list(tmp_path.iterdir())
    assert killed > 5


def test_examples_of_another_grid_are_deleted_too(tmp_path: Path) -> None:
    example = PendingExample(7, Example("swipe", IMAGES, span=(10.0, 20.0)), 10.0)
    ExampleStore(tmp_path, (5, 5), 10.0).keep(example)
    other = ExampleStore(tmp_path, (4, 4), 10.0)
    assert not other.pending
    assert other.delete() == 1
    assert not list(tmp_path.iterdir())
