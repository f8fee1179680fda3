"""`controller recordings`, as somebody types it."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.recordings import writer
from controller.recordings.recording import Mark, Recording
from controller.shared.files import lock
from tests.controller.recordings.test_importer import CAPFINGERID, screen
from tests.controller.recordings.test_recovery import left
from tests.support.recordings import broken, of, played

Run = Callable[..., tuple[int, str, str]]
posix = pytest.mark.skipif(os.name != "posix", reason="Windows locks whole files")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """The command: (exit status, standard output, standard error)."""

    def call(*words: object) -> tuple[int, str, str]:
        status = main(["recordings", *map(str, words)])
        out = capsys.readouterr()
        return status, out.out, out.err

    return call


def write(path: Path, recording: Recording) -> Path:
    path.write_bytes(writer.pack(recording))
    return path


def test_a_named_file_is_described(tmp_path: Path, run: Run) -> None:
    path = write(tmp_path / "one.npz", played())
    status, out, _ = run(path)
    assert status == 0
    assert "who       user 01, session 01" in out
    assert "cadence   2:00 min at 10.00 Hz (10 intended), 0 of 1200 frames missing" in out
    assert "label     null" in out
    assert "button    null" in out
    assert max(map(len, out.splitlines()[1:])) <= 80
    assert "who       " not in run(tmp_path)[1]  # of a folder's files only the verdict


def test_what_a_file_says_cannot_move_the_cursor(tmp_path: Path, run: Run) -> None:
    marks = (Mark(0.1, "note\x1b[2J", "clears the screen"),)
    path = write(tmp_path / "one.npz", of(np.ones((5, 2, 2)), marks=marks))
    _, out, _ = run(path)
    assert "\x1b" not in out
    assert "marks     note\\x1b[2J 1" in out


def test_the_exit_status_is_the_worst_verdict(tmp_path: Path, run: Run) -> None:
    good = write(tmp_path / "good.npz", played())
    assert run(good)[0] == 0
    write(tmp_path / "doubtful.npz", broken("dead:2,3"))
    status, out, _ = run(tmp_path)
    assert status == 1
    assert "doubtful: taxel row 2, column 3: dead" in out
    assert out.endswith("2 files: 1 good, 1 doubtful, 0 failed\n")
    (tmp_path / "failed.npz").write_bytes(b"nothing")
    status, out, _ = run(tmp_path)
    assert status == 2
    assert "is not a whole .npz archive" in out


def test_frames_that_stand_twice_are_named(tmp_path: Path, run: Run) -> None:
    write(tmp_path / "one.npz", played())
    write(tmp_path / "two.npz", played())
    status, out, _ = run(tmp_path)
    assert status == 1
    assert f"1200 of its frames are in {tmp_path / 'two.npz'} as well" in out


def test_arrays_of_another_sensor_become_recordings_once(tmp_path: Path, run: Run) -> None:
    np.savez_compressed(tmp_path / "frames.npz", **screen())  # type: ignore[arg-type]
    (tmp_path / "screen.toml").write_text(CAPFINGERID)
    words = ("import", tmp_path / "frames.npz", tmp_path / "screen.toml", "--out", tmp_path / "set")
    status, out, _ = run(*words)
    first, second = (tmp_path / "set" / f"sub-{u}_ses-01_run-01.npz" for u in ("03", "12"))
    assert status == 0
    facts = "5 frames, 0.3 s; touch lowers readings, as found from the frames"
    assert out == f"{first}: {facts}\n{second}: {facts}\n"
    second.unlink()  # as if it had been interrupted
    _, out, _ = run(*words)
    assert out == f"{first} is there already\n{second}: {facts}\n"
    assert len(list((tmp_path / "set").iterdir())) == 2


def test_a_journal_is_recovered_and_judged(tmp_path: Path, run: Run) -> None:
    for place in (left(tmp_path), tmp_path):
        left(tmp_path)
        _, out, _ = run(place)
        recording = tmp_path / "one.npz"
        assert out.startswith(f"recovered 30 frames (2.9 s) into {recording}\n")
        assert f"  {recording}\n  " in out
        assert [*tmp_path.iterdir()] == [recording]
        recording.unlink()


@posix
def test_a_recording_under_way_is_left_alone(tmp_path: Path, run: Run) -> None:
    journal = left(tmp_path)
    with journal.open("r+b") as file:
        lock(file)
        status, out, _ = run(tmp_path)
    assert (status, [*tmp_path.iterdir()]) == (0, [journal])
    assert "is being recorded; it is sealed when that program ends" in out


def test_a_journal_that_holds_nothing_is_told_and_kept(tmp_path: Path, run: Run) -> None:
    journal = tmp_path / "one.journal"
    journal.write_bytes(b"")
    status, out, _ = run(tmp_path)
    assert status == 2
    assert f"failed:   the journal {journal} " in out
    assert journal.exists()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("none.npz",), "the recording none.npz does not exist"),
        ((".",), "there are no recordings in ."),
    ],
)
def test_a_mistake_is_one_sentence(
    words: tuple[str, ...], complaint: str, tmp_path: Path, run: Run,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    status, out, err = run(*words)
    assert status == 2
    assert complaint in out + err
