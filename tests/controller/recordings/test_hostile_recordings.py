"""Recordings from an enemy: each is refused with a reason, in bounded memory and time."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.__main__ import main
from controller.recordings import reader
from controller.shared import npz
from tests.support import ROOT, SUPPORT
from tests.support.hostile_npz import FILES, but, headed, one, says, zeros

MIB: Final = 16  # beyond what Python and NumPy have at the start
SECONDS: Final = 2
HEALTHY: Final = but()

linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux bounds a process's memory")


def confined(
    paths: list[Path], cwd: Path, mib: int = MIB, seconds: int = SECONDS
) -> list[dict[str, Any]]:
    """What becomes of each file in a process with so much memory and processor time."""
    bounded = SUPPORT / "bounded_reader.py"
    command = [sys.executable, str(bounded), str(mib), str(seconds), *map(str, paths)]
    search = os.pathsep.join(filter(None, (str(ROOT), os.getenv("PYTHONPATH"))))
    done = subprocess.run(
        command, cwd=cwd, env={**os.environ, "PYTHONPATH": search}, capture_output=True, text=True
    )
    assert not done.stderr  # not even a warning
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the processes run; whatever appears here beside the files was made by one."""
    return tmp_path_factory.mktemp("hostile")


@pytest.fixture(scope="module")
def became(folder: Path) -> dict[str, dict[str, Any]]:
    """What became of each hostile file."""
    paths = [folder / f"{number}.npz" for number in range(len(FILES))]
    for path, (make, _) in zip(paths, FILES.values(), strict=True):
        path.write_bytes(make())
    return dict(zip(FILES, confined(paths, folder), strict=True))


@linux
@pytest.mark.parametrize("name", FILES)
def test_a_hostile_file_is_refused_cheaply(name: str, became: dict[str, dict[str, Any]]) -> None:
    *surveyed, loaded = became[name]["said"]
    assert re.search(FILES[name][1], loaded)
    for sentence in (loaded, *surveyed):  # a survey reads less, so it may find nothing wrong
        assert sentence == "accepted" or re.fullmatch(
            r"the recording .*\.npz [ -~]{,250}", sentence
        )


@linux
def test_no_hostile_file_does_anything(became: dict[str, dict[str, Any]], folder: Path) -> None:
    assert len(became) == len(FILES)
    assert all(path.suffix == ".npz" for path in folder.iterdir())


@linux
def test_a_healthy_file_is_read_within_the_same_bounds(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    path.write_bytes(HEALTHY)
    [result] = confined([path], tmp_path)
    assert result["said"] == ["accepted", "accepted"]


@linux
def test_the_largest_file_needs_little_more_memory_than_it_holds(tmp_path: Path) -> None:
    path = tmp_path / "large.npz"
    path.write_bytes(zeros((5_360_000, 5, 5)))
    # Half a gigabyte that nobody used before can cost a virtual machine seconds.
    [result] = confined([path], tmp_path, mib=(reader.MAX_BYTES >> 20) + MIB, seconds=20)
    assert re.search("has no 't'", result["said"][1])
    assert result["mib"] > 500


@linux
def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path) -> None:
    pipe, link, loop, sparse, empty = (
        tmp_path / name for name in ("pipe.npz", "link.npz", "loop.npz", "sparse.npz", "empty.npz")
    )
    os.mkfifo(pipe)
    link.symlink_to("/dev/zero")
    loop.symlink_to(loop)
    for path, size in ((sparse, 10 << 30), (empty, 400 << 20)):
        with path.open("wb") as file:
            file.truncate(size)  # takes no room on the disk
    expected = {
        pipe: "is not a file",
        link: "is not a file",
        Path("/dev/zero"): "is not a file",
        tmp_path: "is not a file",
        loop: "does not exist",
        tmp_path / "absent.npz": "does not exist",
        tmp_path / ("a" * 300): "cannot be read: file name too long",
        sparse: "has 10737418240 bytes, more than the 536870912 allowed",
        empty: "is not a whole .npz archive",
    }
    for path, result in zip(expected, confined(list(expected), tmp_path), strict=True):
        assert all(expected[path] in sentence for sentence in result["said"])


@given(text=st.text(max_size=100) | st.from_regex(r"\{'descr': '.*', 'fortran_order': .*\(.*\}"))
def test_any_array_header_is_refused_or_an_array(text: str) -> None:
    data = one(headed(text.encode(errors="replace")[:4000], bytes(100)))
    try:
        arrays = npz.unpack(data, 10_000)
    except npz.ZipError:
        return
    assert arrays["frames"].nbytes == 100


def test_recordings_are_printed_escaped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(says(schema="\x1b]0;title\x07\u202e"))
    assert main(["--replay", str(path)]) == 2
    told = capsys.readouterr().err
    assert "has form \\x1b]0;title\\x07\\u202e, this program reads" in told
    assert told.removesuffix("\n").isprintable()
