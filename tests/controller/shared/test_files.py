"""Files: only regular ones are read, and none is ever half written."""

import errno
import os
import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from controller.shared import files
from controller.shared.files import atomic_write, read_bytes, read_text


@pytest.fixture
def specials(tmp_path: Path) -> Iterator[list[Path]]:
    """A pipe, a socket, a folder and devices that never end."""
    pipe, name = tmp_path / "pipe", tmp_path / "socket"
    os.mkfifo(pipe)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(name))
        yield [pipe, name, tmp_path, Path("/dev/zero"), Path("/dev/full"), Path("/dev/null")]


@pytest.mark.skipif(os.name != "posix", reason="no such files")
def test_special_files_are_neither_read_nor_replaced(specials: list[Path]) -> None:
    for path in specials:
        with pytest.raises(OSError) as caught:
            read_bytes(path, 100)
        assert caught.value.strerror
        with pytest.raises(OSError):
            atomic_write(path, b"")
        assert not path.is_file()


def test_a_file_is_read_up_to_its_limit(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"12345")
    assert read_bytes(file, 5) == b"12345"
    with pytest.raises(OSError, match="it has more than 4 bytes"):
        read_bytes(file, 4)
    os.truncate(file, 8 << 30)  # sparse, and costs nothing
    with pytest.raises(OSError, match="more than 100 bytes"):
        read_bytes(file, 100)


def test_text_is_utf_8_with_or_without_a_mark(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes("\ufeffé".encode())
    assert read_text(file, 100) == "é"
    file.write_bytes(b"\xff")
    with pytest.raises(OSError, match="not text in UTF-8"):
        read_text(file, 100)


def test_a_failed_write_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "file"
    atomic_write(file, b"old")

    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left") as caught:
        atomic_write(file, b"new")
    assert caught.value.filename == str(file)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert file.read_bytes() == b"old"


def test_a_name_that_is_taken_stays_where_asked(tmp_path: Path) -> None:
    file = tmp_path / "new" / "file"
    atomic_write(file, b"old", replace=False)
    with pytest.raises(FileExistsError):
        atomic_write(file, b"new", replace=False)
    assert file.read_bytes() == b"old"
    assert [path.name for path in file.parent.iterdir()] == ["file"]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere these folders are others")
@pytest.mark.parametrize("given", ["", "./data", "{}/own"])
def test_a_relative_xdg_folder_is_ignored_as_the_specification_says(
    given: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_DATA_HOME", "XDG_STATE_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.setenv(name, given.format(tmp_path))
    folders = (files.data_folder, files.state_folder, files.config_folder)
    found = [folder() for folder in folders]
    assert all(folder.is_relative_to(tmp_path) for folder in found)
    assert found.count(tmp_path / "own" / "orbtouch") == (3 if given.startswith("{") else 0)


@pytest.mark.skipif(os.name != "posix", reason="no permissions of this kind")
def test_permissions_follow_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        atomic_write(tmp_path / "shared", b"")
        atomic_write(tmp_path / "own", b"", private=True)
        os.umask(0)
        atomic_write(tmp_path / "open", b"")
    finally:
        os.umask(before)
    assert (tmp_path / "shared").stat().st_mode & 0o777 == 0o640
    assert (tmp_path / "own").stat().st_mode & 0o777 == 0o600
    assert (tmp_path / "open").stat().st_mode & 0o777 == 0o666


@pytest.mark.skipif(os.name != "posix", reason="no folder can be put on the disk")
def test_a_file_that_was_written_is_on_the_disk_with_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[bool] = []
    monkeypatch.setattr(os, "fsync", lambda handle: synced.append(os.fstat(handle).st_nlink > 1))
    atomic_write(tmp_path / "durable", b"a")
    assert synced == [False, True]  # the file, then its folder
    with pytest.raises(FileNotFoundError):
        atomic_write(tmp_path / "none" / "file", b"a", folders=False)
