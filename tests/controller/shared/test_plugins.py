"""Parts of other packages: the template in examples/ is installed with pip, and used."""

import importlib
import re
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any, cast

import pygame
import pytest

import orbtouch.plugins
from controller import links
from controller.cli import doctor
from controller.diagnostics.frame_source import FrameReader
from controller.sensors import base as sensors
from controller.sensors.geometry import SensorError
from controller.shared import plugins
from controller.shared.protocol.messages import Command
from host import taps, targets
from host.connection.receiver import Delivered
from tests.support import ROOT

PIP = ("-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--no-index")


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the templates' packages, as pip installs them, without the network."""
    pytest.importorskip("setuptools")
    work = tmp_path_factory.mktemp("plugin")
    where, sources = work / "site", [work / "own-sensor", work / "own-target"]
    for source in sources:
        shutil.copytree(ROOT / "examples" / source.name, source)
    command = [sys.executable, *PIP, "--target", str(where), *map(str, sources)]
    subprocess.run(command, check=True, timeout=300)
    return where


@pytest.fixture
def drum(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package on the path."""
    monkeypatch.syspath_prepend(str(installed))
    importlib.invalidate_caches()


@pytest.mark.usefixtures("drum")
def test_the_template_s_sensor_is_read() -> None:
    sensor = sensors.load("drum:strength=300", 10.0)
    assert (sensor.rate_hz, sensor.signal.unit, sensor.signal.sign) == (10.0, "counts", 1)
    assert sensor.read(6.1).max() == 300.0


@pytest.mark.usefixtures("drum")
def test_the_template_s_sensor_can_be_tried(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]

    def sleep(seconds: float) -> None:
        now[0] += seconds

    read = partial(FrameReader, clock=lambda: now[0], sleep=sleep)
    monkeypatch.setattr(doctor, "FrameReader", read)
    doctor.main(["--sensor", "drum"])
    printed = capsys.readouterr().out
    assert re.search("rest +good +0 counts, about zero", printed)
    assert re.search("touch +good +the reading rises", printed)
    assert re.search(r"taxels +good +12 of 12 move", printed)


@pytest.mark.usefixtures("drum")
def test_the_template_s_target_takes_commands() -> None:
    lamp: Any = targets.load("lamp")
    surface = pygame.Surface((2, 2))
    lamp.tick(1.0, [Delivered(Command("drop", "pinch", 0.9, None, 7), 1000)])
    lamp.draw(surface)
    assert surface.get_at((0, 0)) == pygame.Color("red")
    lamp.tick(2.5)
    lamp.draw(surface)
    assert surface.get_at((0, 0)) == pygame.Color("black")


@pytest.mark.usefixtures("drum")
def test_its_options_are_checked_as_those_of_other_sensors() -> None:
    with pytest.raises(SensorError, match="strength = -1 must be above 0"):
        sensors.load("drum:strength=-1")
    with pytest.raises(SensorError, match="drum has no option 'size'; it has strength"):
        sensors.load("drum:size=1")
    with pytest.raises(SensorError, match=r"there is no sensor 'drums'; there are .*, drum$"):
        sensors.load("drums")


def package(folder: Path, group: str, name: str, module: str) -> None:
    """Put a package with one module and one entry point into a folder, as an installer does."""
    (folder / f"{name}_part.py").write_text(module)
    about = folder / f"{name}_part-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}-part\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[orbtouch.{group}]\n{name} = {name}_part\n")


def test_links_targets_and_taps_are_found_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package(tmp_path, "links", "pigeon", "def create(url, welcome, access): return url\n")
    package(tmp_path, "targets", "chess", "def create(options): return 'chess'\n")
    package(tmp_path, "taps", "paper", "def create(address): return address\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    welcome = cast(Any, None)  # the links of this test do not look at it
    assert links.open_link("pigeon:home", welcome) == "pigeon:home"  # type: ignore[comparison-overlap]
    assert targets.load("chess") == "chess"  # type: ignore[comparison-overlap]
    assert taps.open_tap("paper://a4") == "a4"  # type: ignore[comparison-overlap]


def test_a_part_that_cannot_be_imported_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package(tmp_path, "sensors", "broken", "import nothing_of_that_name\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    expected = "broken_part, sensors 'broken', cannot be imported: No module named"
    with pytest.raises(plugins.PluginError, match=expected):
        sensors.load("broken")


@pytest.mark.parametrize(
    "module", ["raise SystemExit('\\033[2Jgone\\n')", "raise OSError('\\033[2Jgone\\n')"]
)
def test_a_part_that_ends_or_paints_is_answered_in_a_line(
    module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package(tmp_path, "sensors", "rude", module)
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    monkeypatch.delitem(sys.modules, "rude_part", raising=False)
    with pytest.raises(plugins.PluginError) as told:
        sensors.load("rude")
    assert str(told.value) == (r"rude_part, sensors 'rude', cannot be imported: \x1b[2Jgone\n")


def test_a_part_that_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package(tmp_path, "targets", "lost", "def create(options): raise OSError('\\033[2Jno lamp')\n")
    package(tmp_path, "taps", "empty", "")
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    with pytest.raises(plugins.PluginError) as told:
        targets.load("lost")
    assert str(told.value) == r"lost_part, targets 'lost', fails: \x1b[2Jno lamp"
    with pytest.raises(plugins.PluginError, match="empty_part, taps 'empty', has no 'create'"):
        taps.open_tap("empty://")


def test_parts_are_listed_without_being_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package(tmp_path, "sensors", "shy", "raise RuntimeError")
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    assert "shy" in orbtouch.plugins.names("sensors")
    assert "shy_part" not in sys.modules


def test_every_public_name_of_parts_is_there_and_described() -> None:
    for name in orbtouch.plugins.__all__:
        assert getattr(orbtouch.plugins, name).__doc__, name


def test_templates_import_what_is_public_only() -> None:
    own = ("controller", "host", "models", "tetris")
    for file in (ROOT / "examples").glob("own-*/*/*.py"):
        imported = re.findall(r"^(?:from|import) ([\w.]+)", file.read_text(), re.MULTILINE)
        assert not [name for name in imported if name.split(".")[0] in own], file


@pytest.mark.parametrize("words", ["--version", "--help", "--sensor virtual --link zzz:1"])
def test_nobody_looks_for_parts_that_nobody_asked_for(words: str) -> None:
    """The list of what is installed is read for unknown names only, so a start costs nothing."""
    code = (
        "import sys; from controller.__main__ import main\n"
        "try: main(sys.argv[1:])\n"
        "except SystemExit: pass\n"
        "print('importlib.metadata' in sys.modules)\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code, *words.split()], text=True, capture_output=True, check=True
    )
    assert ran.stdout.splitlines()[-1] == str("zzz" in words)
