"""`controller recordings`, as somebody types it."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from controller.__main__ import main
from controller.recordings import reader, writer
from controller.recordings.recording import Mark, Recording
from tests.controller.recordings.test_importer import CAPFINGERID, screen
from tests.support.recordings import broken, of, played

Run = Callable[..., tuple[int, str, str]]


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


def test_info_says_who_when_what_and_draws_it(tmp_path: Path, run: Run) -> None:
    path = write(tmp_path / "one.npz", played())
    status, out, _ = run("info", path)
    assert status == 0
    assert "who       user 01, session 01" in out
    assert "length    2:00 min, 1200 frames at 10.00 Hz (10 intended), 0 missing" in out
    assert "label     null" in out
    assert "button    null" in out
    lines = out.splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("  press  "))
    assert lines[head].split() == ["press", "pinch", "twist_cw", "twist_ccw"]
    assert all(len(line.split("|")[1]) == 10 for line in lines[head + 1 : head + 6])
    assert "█" in out
    assert max(map(len, lines[1:])) <= 80


def test_info_as_json_is_a_line_for_each_file(tmp_path: Path, run: Run) -> None:
    paths = [write(tmp_path / f"{seed}.npz", played(seed=seed)) for seed in (0, 1)]
    _, out, _ = run("info", "--json", *paths)
    first, second = (json.loads(line) for line in out.splitlines())
    assert (first["path"], second["path"]) == tuple(map(str, paths))
    assert first["said"][0]["events"]["press"] > 5


def test_what_a_file_says_cannot_move_the_cursor(tmp_path: Path, run: Run) -> None:
    marks = (Mark(0.1, "note\x1b[2J", "clears the screen"),)
    path = write(tmp_path / "one.npz", of(np.ones((5, 2, 2)), marks=marks))
    _, out, _ = run("info", path)
    assert "\x1b" not in out
    assert "marks     note\\x1b[2J 1" in out


def test_the_exit_status_of_check_is_the_worst_verdict(tmp_path: Path, run: Run) -> None:
    good = write(tmp_path / "good.npz", played())
    assert run("check", good)[0] == 0
    write(tmp_path / "doubtful.npz", broken("dead:2,3"))
    status, out, _ = run("check", tmp_path)
    assert status == 1
    assert "doubtful: taxel row 2, column 3: dead" in out
    assert out.endswith("2 files: 1 good, 1 doubtful, 0 failed\n")
    (tmp_path / "failed.npz").write_bytes(b"nothing")
    status, out, _ = run("check", tmp_path)
    assert status == 2
    assert "is not a whole .npz archive" in out


def test_check_names_journals_and_frames_that_stand_twice(tmp_path: Path, run: Run) -> None:
    write(tmp_path / "one.npz", played())
    write(tmp_path / "two.npz", played())
    (tmp_path / "three.journal").write_bytes(b"")
    status, out, _ = run("check", tmp_path)
    assert status == 1
    assert f"1200 of its frames are in {tmp_path / 'two.npz'} as well" in out
    assert f"controller recordings recover {tmp_path / 'three.journal'}" in out


def test_check_as_json_is_a_line_for_each_file(tmp_path: Path, run: Run) -> None:
    write(tmp_path / "one.npz", broken("dead:2,3"))
    status, out, _ = run("check", "--json", tmp_path)
    told = json.loads(out)
    assert (status, told["verdict"], told["useless"]) == (1, "doubtful", [[2, 3]])
    assert told["cadence"]["measured_hz"] == pytest.approx(10.0)


def test_no_file_is_ever_replaced(tmp_path: Path, run: Run) -> None:
    path = write(tmp_path / "one.npz", played())
    (tmp_path / "precious.npz").write_text("precious")
    for words in (
        ("trim", path, "--to", 5, "--out", tmp_path / "precious.npz"),
        ("relabel", path, "--to", 5, "--label", "press", "--out", path),
    ):
        status, out, err = run(*words)
        assert (status, out) == (2, "")
        assert "exists and is kept as it is" in err
    assert (tmp_path / "precious.npz").read_text() == "precious"
    assert path.read_bytes() == writer.pack(played())


def test_a_piece_and_a_correction_are_new_files(tmp_path: Path, run: Run) -> None:
    path = write(tmp_path / "one.npz", played())
    piece, mended = tmp_path / "piece.npz", tmp_path / "mended.npz"
    assert run("trim", path, "--from", 10, "--to", 20, "--out", piece) == (0, f"{piece}\n", "")
    assert run("relabel", piece, "--from", 12, "--to", 13, "--label", "pinch", "--exclude",
               "--out", mended)[0] == 0  # fmt: skip
    loaded = reader.load(mended)
    assert loaded.excluded.sum() == 10
    assert [mark.kind for mark in loaded.marks] == ["trim", "relabel"]
    assert len(loaded.origin.id) == 32
    assert loaded.origin.id != reader.load(piece).origin.id


def test_arrays_of_another_sensor_become_recordings_once(tmp_path: Path, run: Run) -> None:
    np.savez_compressed(tmp_path / "frames.npz", **screen())  # type: ignore[arg-type]
    (tmp_path / "screen.toml").write_text(CAPFINGERID)
    words = ("import", tmp_path / "frames.npz", tmp_path / "screen.toml", "--out", tmp_path / "set")
    status, out, _ = run(*words)
    first, second = (tmp_path / "set" / f"sub-{u}_ses-01_run-01.npz" for u in ("03", "12"))
    assert status == 0
    assert out == f"{first}: 5 frames, 0.3 s\n{second}: 5 frames, 0.3 s\n"
    second.unlink()  # as if it had been interrupted
    _, out, _ = run(*words)
    assert out == f"{first} is there already\n{second}: 5 frames, 0.3 s\n"
    assert len(list((tmp_path / "set").iterdir())) == 2


def test_where_no_journal_is_left_recover_says_so(tmp_path: Path, run: Run) -> None:
    status, out, _ = run("recover", tmp_path)
    assert (status, out) == (0, f"no journal is left in {tmp_path}; nothing to recover\n")


def test_a_journal_that_holds_nothing_is_told_and_kept(tmp_path: Path, run: Run) -> None:
    journal = tmp_path / "one.journal"
    journal.write_bytes(b"")
    status, _, err = run("recover", tmp_path)
    assert status == 1
    assert err.startswith(f"controller: the journal {journal} ")
    assert journal.exists()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("info", "none.npz"), "the recording none.npz does not exist"),
        (("check", "."), "there are no recordings in ."),
        (("trim", "one.npz", "--out", "piece"), "end its name in .npz"),
        (("trim", "none.npz", "--out", "piece.npz"), "does not exist"),
    ],
)
def test_a_mistake_is_one_sentence(
    words: tuple[str, ...], complaint: str, tmp_path: Path, run: Run,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert complaint in err
    assert err.count("\n") == 1
