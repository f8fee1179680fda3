"""Targets by name."""

from pathlib import Path

import pytest

from controller.shared.errors import UserError
from host import targets
from host.app.application import OrbApp
from host.targets import TargetOptions


def test_targets_are_found_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert targets.names() == ("gamepad", "keyboard", "tetris")
    assert isinstance(targets.load("tetris", TargetOptions(sound=False)), OrbApp)
    with pytest.raises(UserError, match="there is no target 'chess'"):
        targets.load("chess")
