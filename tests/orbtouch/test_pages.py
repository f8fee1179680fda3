"""Pages, examples and wirings that ship are read by name, with or without a clone."""

import re
import tomllib
from pathlib import Path

import pytest

from controller.sensors import base as sensors
from controller.sensors.geometry import SensorError
from controller.sensors.hardware import description, wiring
from orbtouch.__main__ import main
from tests.support import ROOT

Capture = pytest.CaptureFixture[str]
PAGES = {page.stem for page in (ROOT / "docs").glob("*.md")}


def test_a_page_is_printed_by_its_name_or_its_file(capsys: Capture) -> None:
    for name in ("teach", "docs/teach.md"):
        assert main(["docs", name]) == 0
        assert capsys.readouterr().out == (ROOT / "docs" / "teach.md").read_text(encoding="utf-8")


def test_all_pages_are_listed_with_their_titles(capsys: Capture) -> None:
    assert main(["docs"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert {line.split()[0] for line in lines} == PAGES
    assert "sensors         Use another sensor" in lines


def test_a_misspelt_page_is_answered_with_the_nearest(capsys: Capture) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["docs", "sensor"])
    assert "did you mean sensors?" in capsys.readouterr().err


def test_every_page_that_a_message_names_is_there() -> None:
    texts = [
        path.read_text(encoding="utf-8")
        for package in ("controller", "host", "models", "tetris", "orbtouch", "assets")
        for suffix in ("py", "toml")
        for path in (ROOT / package).rglob(f"*.{suffix}")
    ]
    named = set(re.findall(r"orbtouch docs ([a-z-]+)", " ".join(texts)))
    assert len(named) >= 20
    assert named <= PAGES


def test_examples_sketches_and_a_recording_are_copied(tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "mine"
    assert main(["examples", str(out)]) == 0
    for file in ("README.md", "game.py", "own-sensor/pyproject.toml", "firmware/muca/muca.ino"):
        assert (out / file).is_file()
    assert (out / "demo.npz").read_bytes() == (ROOT / "assets" / "demo.npz").read_bytes()
    assert main(["examples", str(out)]) == 2
    assert "is there already" in capsys.readouterr().err


def test_what_ships_beside_the_packages_is_in_the_wheel() -> None:
    table = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = table["tool"]["hatch"]["build"]["targets"]["wheel"]
    for folder in ("docs", "examples", "firmware"):
        assert folder in wheel["only-include"]
        assert wheel["sources"][folder] == f"assets/{folder}"


def test_a_sketch_s_description_is_named_without_its_file() -> None:
    assert wiring.read(Path("builtin:orb")) == wiring.Wiring()
    muca = description.read(Path("builtin:muca"), "lines")
    assert (muca.rows, muca.columns) == (21, 12)
    with pytest.raises(SensorError, match="no builtin:mucka; there are esp32_touch"):
        sensors.load("lines:wiring=builtin:mucka")
