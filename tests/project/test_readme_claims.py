"""Claims of README.md, a test each."""

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache

import pytest

import orbtouch
from controller.bundles import bundle, container
from host.app.screens.teach import gesture
from host.connection.virtual_orb import VirtualOrbProcess
from tests.support import ROOT
from tetris.engine.modes import MODES

README = (ROOT / "README.md").read_text(encoding="utf-8")
TEXT = " ".join(README.split())
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROGRAMS = ("orbtouch", "controller", "host", "models", "tetris")
CODE = re.findall(r"`([^`]+)`", README)


@pytest.mark.parametrize(
    "name", ["README.md", "docs/hardware.md", "docs/hid.md", "docs/sensors.md"]
)
def test_what_was_never_plugged_in_is_said_at_the_top_and_for_every_part(name: str) -> None:
    """Whoever plugs something in changes a row, and this test."""
    text = (ROOT / name).read_text(encoding="utf-8")
    assert "Never plugged in" in (text if name == "README.md" else text.partition("\n## ")[0])
    head, _, table = text.partition("| real hardware |\n")[2].partition("\n")
    rows = table.partition("\n\n")[0].splitlines()
    assert set(head) <= set("|-")
    assert len(rows) >= 3
    assert all(row.endswith("| none yet |") and row.count("|") == head.count("|") for row in rows)


def test_the_sensor_is_a_grid_of_5_by_5_and_its_networks_are_two_and_small() -> None:
    assert "a 5×5 grid of stretchable capacitors. Two small neural networks" in TEXT
    shipped = bundle.default_path().read_bytes()
    assert orbtouch.load_network().shape == (5, 5)
    assert sorted(name for name in container.unpack(shipped) if name.endswith(".onnx")) == [
        "embedding.onnx", "location.onnx",
    ]  # fmt: skip
    assert len(shipped) < 1_000_000


def test_the_virtual_orb_is_a_process_of_its_own() -> None:
    assert "a physical simulation in a process of its own" in TEXT
    orb = VirtualOrbProcess(1)
    try:
        orb.open().close()
        assert orb.process is not None
        assert orb.process.pid != os.getpid()
    finally:
        orb.close()


def test_python_and_both_commands_are_those_of_the_project() -> None:
    assert "only Python 3.11 or newer" in TEXT
    assert PYPROJECT["project"]["requires-python"] == ">=3.11"
    assert set(PYPROJECT["project"]["scripts"]) == set(PROGRAMS)
    assert "test" in PYPROJECT["project"]["optional-dependencies"]


def test_windows_gets_the_same_two_commands() -> None:
    lines = [line.strip() for line in README.splitlines() if "pip install -e" in line]
    posix, windows = lines[:2], lines[2:]
    said = [
        line.replace("py -m", "python3 -m").replace("\\Scripts\\", "/bin/").replace('"', "'")
        for line in windows
    ]
    assert said == posix


@cache
def help_of(*words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", *words, "--help"], capture_output=True, text=True, check=True
    )
    return done.stdout


def commands() -> Iterator[str]:
    for code in CODE:
        if code.split()[0] in PROGRAMS:
            yield code


@pytest.mark.parametrize("command", sorted(set(commands())))
def test_a_command_and_its_options_are_those_of_the_program(command: str) -> None:
    program, *words = command.split()
    verbs = [word for word in words[:1] if not word.startswith("-")]
    found = help_of(program, *verbs)  # it fails for a verb that the program does not have
    for option in (word for word in words if word.startswith("--")):
        assert option in found


@pytest.mark.parametrize("option", sorted({one for one in CODE if one.startswith("--")}))
def test_an_option_and_its_value_are_those_of_a_program(option: str) -> None:
    name, value = option.split()
    helps = [help_of("controller"), help_of("host")]
    assert any(name in one for one in helps)
    sensors = {path.stem for path in (ROOT / "controller" / "sensors").glob("*.py")}
    assert value.isupper() or value in sensors or any(value in one for one in helps)


def test_a_recording_is_replayed_by_the_command_of_the_table() -> None:
    assert "`controller --replay assets/demo.npz`" in README
    words = [sys.executable, "-m", "controller", "--replay", "assets/demo.npz"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    assert len(done.stdout.splitlines()) > 100


def test_there_are_ten_modes() -> None:
    assert "play, in ten modes" in TEXT
    assert len(MODES) == 10


def test_gestures_command_what_the_table_says() -> None:
    for words in ("a press left, right, below is left, right, down", "| pinch |", "| drop |"):
        assert words in TEXT
    mapping = bundle.read(bundle.default_path()).mapping
    presses = [mapping.command("press", at) for at in ((0.0, 2.0), (4.0, 2.0), (2.0, 0.0))]
    assert presses == ["left", "right", "down"]
    others = [mapping.command(label, None) for label in ("pinch", "twist_cw", "twist_ccw")]
    assert others == ["drop", "rotate_cw", "rotate_ccw"]


def test_a_gesture_is_taught_with_five_examples() -> None:
    assert "five examples, some seconds of learning, and what it costs" in TEXT
    assert gesture.ENOUGH == 5


def test_what_is_in_italics_in_the_table_is_in_the_window() -> None:
    words = [
        (ROOT / "assets" / package / "languages" / "en.toml").read_text(encoding="utf-8")
        for package in ("host", "tetris")
    ]
    rows = [line for line in README.splitlines() if line.startswith("| ")]
    for item in re.findall(r"(?<!\*)\*([^*]+)\*(?!\*)", "\n".join(rows)):
        assert any(f'"{item}"' in text for text in words), item


def test_every_sensor_that_it_names_has_a_sketch_or_a_driver() -> None:
    assert "Arduino, MPR121, Muca, Trill" in TEXT
    for name in ("mpr121", "muca", "trill"):
        assert list((ROOT / "firmware" / name).glob("**/*.ino")), name


def test_every_link_leads_to_a_file_and_a_heading() -> None:
    for target in re.findall(r'(?:\]\(|src=")([^)"\s]+)', README):
        path, _, anchor = target.partition("#")
        assert (ROOT / path).is_file(), target
        text = (ROOT / path).read_text(encoding="utf-8") if anchor else ""
        headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
        assert not anchor or anchor in {re.sub(r"[^\w -]", "", one).lower().replace(" ", "-")
                                        for one in headings}, target  # fmt: skip


def test_every_folder_of_the_table_is_there() -> None:
    folders = [code for code in CODE if code.endswith("/")]
    assert {"controller/", "host/", "tetris/", "models/", "assets/", "tests/"} <= set(folders)
    assert all((ROOT / folder).is_dir() for folder in folders)
    assert (ROOT / "tests" / "host").is_dir()  # pytest tests/host


def test_the_game_knows_nothing_of_orbs() -> None:
    assert "the game, which knows nothing of orbs" in TEXT
    code = "import sys, tetris.__main__, tetris.cli, tetris.window.app; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {"tetris", "pygame"} <= set(done.stdout.split())
    assert not {"controller", "host", "models", "orbtouch"} & set(done.stdout.split())


def test_the_telemetry_of_onnx_runtime_is_off_wherever_it_is_imported() -> None:
    assert "ONNX Runtime's own telemetry is switched off" in TEXT
    code = (
        "import os; import controller.bundles.inference.onnxruntime_engine; "
        "print(os.environ['ORT_DISABLE_TELEMETRY'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "1"


def test_the_licence_is_named_alike_everywhere() -> None:
    assert "[MIT](LICENSE)" in README
    assert (ROOT / "LICENSE").read_text(encoding="utf-8").startswith("MIT License")
    assert PYPROJECT["project"]["license"] == "MIT"


@pytest.mark.slow
def test_the_shipped_bundle_is_evaluated_by_the_command_of_the_table() -> None:
    assert "`models evaluate --sessions 2`" in README
    words = [sys.executable, "-m", "models", "evaluate", "--sessions", "2", "--minutes", "1"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "press" in done.stdout
