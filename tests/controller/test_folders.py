"""Folders of a user's own files."""

import sys
from pathlib import Path

import platformdirs
import pytest

from controller import folders


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere these folders are others")
@pytest.mark.parametrize("given", ["", "data", "./data", None])
def test_a_relative_xdg_folder_is_ignored_as_the_specification_says(
    given: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_DATA_HOME", "XDG_STATE_HOME", "XDG_RUNTIME_DIR"):
        if given is None:
            monkeypatch.delenv(name, raising=False)
        else:
            monkeypatch.setenv(name, given)
    found = [folders.data(), folders.state(), folders.runtime()]
    assert all(folder.is_relative_to(tmp_path) for folder in found)


def test_a_relative_answer_of_platformdirs_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr(platformdirs, "user_data_path", lambda *_, **__: Path("data/orbtouch"))
    assert folders.data() == Path.home() / ".local/share/orbtouch"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere these folders are others")
def test_an_absolute_xdg_folder_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("XDG_DATA_HOME", "XDG_STATE_HOME", "XDG_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    found = [folders.data(), folders.state(), folders.runtime()]
    assert found == [
        tmp_path / f"XDG_{kind}" / "orbtouch" for kind in ("DATA_HOME", "STATE_HOME", "RUNTIME_DIR")
    ]
