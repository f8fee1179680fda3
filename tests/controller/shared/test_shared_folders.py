"""Folders that several programs change, and what killed programs leave in them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from controller.shared import files
from controller.shared.files import atomic_write

HOLDER = """
import sys
from pathlib import Path
from controller.shared.files import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_another_program_waits_for_the_lock_and_a_killed_one_frees_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path)], stdin=pipe, stdout=pipe
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        monkeypatch.setattr(files, "WAIT_S", 0.0)
        with pytest.raises(OSError, match="another program changes it"), files.locked(tmp_path):
            pass
        holder.kill()
        holder.wait()
        with files.locked(tmp_path):
            assert not files.is_free(tmp_path / files.LOCK)


def test_temporary_files_of_killed_programs_are_swept_and_nothing_else(tmp_path: Path) -> None:
    kept = {"mine.orb", "example-3.npz", ".hidden", "notes.0123abcd", "taught-me.orb"}
    left = {".mine.orb.0123abcd", ".run.npz.89abcdef", "taught-77.orb", "corrected-1.orb"}
    for name in kept | left:
        (tmp_path / name).touch()
    assert files.sweep(tmp_path) == 0  # they may be in use
    for name in kept | left:
        os.utime(tmp_path / name, (0, 0))
    assert files.sweep(tmp_path) == len(left)
    assert {path.name for path in tmp_path.iterdir()} == kept


def test_what_an_interrupted_write_leaves_is_swept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(path: Path, target: Path) -> None:
        raise SystemExit

    monkeypatch.setattr(Path, "replace", killed)
    monkeypatch.setattr(Path, "unlink", lambda *_, **__: None)
    with pytest.raises(SystemExit):
        atomic_write(tmp_path / "x.toml", b"data")
    monkeypatch.undo()
    assert files.sweep(tmp_path, age_s=0.0) == 1
    assert not list(tmp_path.iterdir())
