"""The whole way of a new gesture: taught, trained, played, and it does what it was taught for."""

import shutil
from pathlib import Path

import pytest

from controller.__main__ import main
from controller.bundles import bundle
from controller.recognition.mapping import ALWAYS
from tests.support import ROOT

pytestmark = pytest.mark.train


def test_a_gesture_that_was_taught_is_in_the_bundle_with_its_command(tmp_path: Path) -> None:
    from models.__main__ import main as models

    mine, made = tmp_path / "mine", tmp_path / "mine.orb"
    shutil.copytree(ROOT / "examples" / "knock", mine)
    for number in ("1", "2"):
        taught = ("--out", str(mine), "--session", number, "--repetitions", "2")
        assert main(["teach", *taught]) == 0
    assert models(["train", str(mine), "--out", str(made), "--epochs", "1"]) == 0
    loaded = bundle.read(made)
    assert loaded.labels == ("null", "press", "pinch", "twist_cw", "twist_ccw", "knock")
    assert loaded.mapping.command("knock", None) == "hold"
    assert loaded.mapping.commands == (*ALWAYS, "hold")
    assert loaded.mapping.command("press", (3.0, 3.0)) == "right"  # its place: the lent network
