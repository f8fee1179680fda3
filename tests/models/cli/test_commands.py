"""The command line of the training machine: one sentence for what is wrong, one way to end it."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from controller import __version__
from models import cli as commands
from models.__main__ import main
from models.data.recipe import STEPS
from tests.support import ROOT
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture, Patch

DOCS = ROOT / "docs"


def test_a_misspelt_command_is_answered_with_the_nearest(capsys: Capture) -> None:
    assert refused(capsys, "trian") == "there is no command 'trian'; did you mean `models train`?"
    assert refused(capsys, "x").endswith(f"there are {', '.join(commands.COMMANDS)}")


def test_the_version_is_the_program_s(capsys: Capture) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == f"models {__version__}\n"


@pytest.mark.parametrize("command", commands.COMMANDS)
def test_no_help_shows_a_doubled_sign(command: str, capsys: Capture) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    assert "%%" not in capsys.readouterr().out


def test_pages_say_how_long_networks_train() -> None:
    for page in ("people.md", "sweeps.md"):
        told = (DOCS / page).read_text(encoding="utf-8")
        assert set(re.findall(r"the recipe's [0-9]+,000", told)) <= {f"the recipe's {STEPS:,}"}


@pytest.mark.train
def test_a_bundle_to_write_ends_in_orb_and_has_a_folder(tmp_path: Path, capsys: Capture) -> None:
    absent = str(tmp_path / "absent" / "x.orb")
    words = ["train", "d", "--from", "models/orbtouch.orb", "--epochs", "0"]
    for out in (".", "x.txt", "orb"):
        expected = f"{out!r} is no name of a bundle; name one that ends in .orb"
        assert refused(capsys, *words, "--out", out) == expected
    assert "is no directory; make it first" in refused(capsys, *words, "--out", absent)
    thesis = tmp_path / "thesis.orb"
    thesis.write_text("of years")
    assert "is there and no bundle" in refused(capsys, *words, "--out", str(thesis))
    assert thesis.read_text() == "of years"


def test_where_there_are_no_recordings_is_said(tmp_path: Path, capsys: Capture) -> None:
    said = refused(capsys, "evaluate", "models/orbtouch.orb", str(tmp_path))
    assert said.startswith(f"there are no recordings in {tmp_path}; make some with")


# Interrupts itself when it is about to import a module.
INTERRUPTED = """
import os, signal, sys
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from models.__main__ import main
sys.exit(main(["evaluate", "--sessions", "1", "--minutes", "1"]))
"""


@pytest.mark.skipif(os.name != "posix", reason="no such signals")
@pytest.mark.parametrize(
    "module",
    [
        "models.cli._command_line",
        "argparse",
        "controller.shared.errors",
        "models.cli",
        "numpy._core.multiarray",
        "onnxruntime.capi._pybind_state",
    ],
)
def test_ctrl_c_while_a_module_is_imported_ends_it_without_a_traceback(module: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, module],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 130
    assert "Traceback" not in done.stderr


def test_ctrl_c_says_what_is_whole(monkeypatch: Patch, capsys: Capture, tmp_path: Path) -> None:
    def interrupted(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("models.data.simulate.generate", interrupted)
    assert main(["simulate", "--out", str(tmp_path)]) == 130
    assert capsys.readouterr().err == ("models: interrupted; the same command goes on from here\n")
    monkeypatch.setattr("controller.bundles.bundle.read", interrupted)
    assert main(["evaluate", "--sessions", "1"]) == 130
    assert capsys.readouterr().err == "models: interrupted; every file written is whole\n"
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
