"""Where a user's own files are: what platformdirs says, asked or not."""

import sys

import platformdirs
import pytest

from controller import folders

HOMES = ("/home/ann", "/", "/home/ann/", "", "ann", None)
GIVEN = ("", "/data", "/data/", "data", " ", None)


@pytest.mark.parametrize("home", HOMES)
@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("platform", ["linux", "darwin"])
def test_folders_are_those_of_platformdirs(
    home: str | None, given: str | None, platform: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("HOME", home), ("XDG_DATA_HOME", given), ("XDG_STATE_HOME", given)):
        if value is None:
            monkeypatch.delenv(name, raising=False)
        else:
            monkeypatch.setenv(name, value)
    theirs = platformdirs.user_data_path, platformdirs.user_state_path
    expected = [ask("orbtouch", appauthor=False) for ask in theirs]
    monkeypatch.setattr(sys, "platform", platform)
    assert [folders.data(), folders.state()] == expected
