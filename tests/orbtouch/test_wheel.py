"""The wheel in an environment of its own: examples and plug-in packages run in an empty folder.

Other packages are those of this environment, so nothing is downloaded; ours are in the wheel only.
"""

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from tests.support import ROOT, SUPPORT

pytestmark = pytest.mark.slow
PIP = ("-m", "pip", "-q", "--disable-pip-version-check")
INSTALL = ("install", "--no-deps", "--no-build-isolation", "--no-index")


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an environment with the wheel and without the clone."""
    pytest.importorskip("hatchling")
    work = tmp_path_factory.mktemp("wheel")
    venv.create(work / "env", with_pip=False)
    bin_folder = "Scripts" if sys.platform == "win32" else "bin"
    own = work / "env" / bin_folder / "python"
    site = sysconfig.get_path("purelib", vars={"base": str(work / "env")})
    # A .pth file inside that folder, such as the clone's, is not read
    Path(site, "others.pth").write_text(sysconfig.get_path("purelib"))
    build = ("wheel", "--no-deps", "--no-build-isolation", "-w", work, ROOT)
    subprocess.run([sys.executable, *PIP, *build], check=True)
    (wheel,) = work.glob("orbtouch-*.whl")
    subprocess.run([own, *PIP, *INSTALL, "--ignore-installed", wheel], check=True)
    return own


def run(python: Path, folder: Path, *words: str | Path) -> str:
    """Run Python in a folder; return what it printed."""
    given = os.environ | {"SDL_VIDEODRIVER": "dummy"}
    given.pop("PYTHONPATH", None)
    done = subprocess.run(
        [python, *words], cwd=folder, env=given, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def examples(python: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The examples, as `orbtouch examples OUT` copies them."""
    folder = tmp_path_factory.mktemp("copied")
    run(python, folder, "-m", "orbtouch", "examples", "out")
    return folder / "out"


def test_the_clone_is_not_seen(python: Path, tmp_path: Path) -> None:
    code = "import controller, models, orbtouch; print(controller, models, orbtouch)"
    assert f"{ROOT}{os.sep}" not in run(python, tmp_path, "-c", code)


@pytest.mark.parametrize(
    ("name", "words", "needs"),
    [
        ("template", (), ()),
        ("forest", ("--headless", "--seconds", "1"), ("sklearn",)),
        pytest.param("gru", (), ("torch",), marks=pytest.mark.train),
        pytest.param("own_csv", (), ("torch", "pandas"), marks=pytest.mark.train),
    ],
)
def test_an_example_runs_in_an_empty_folder(
    name: str, words: tuple[str, ...], needs: tuple[str, ...],
    python: Path, examples: Path, tmp_path: Path,
) -> None:  # fmt: skip
    for need in needs:
        pytest.importorskip(need)
    short = SUPPORT / "short_example.py"
    printed = run(python, tmp_path, short, examples / f"{name}.py", *words)
    assert "interval: 95 % by resampling recordings" in printed
    assert name != "own_csv" or (tmp_path / "own.orb").is_file()


def test_a_sensor_and_a_target_are_installed_and_run(
    python: Path, examples: Path, tmp_path: Path
) -> None:
    pytest.importorskip("setuptools")
    packages = (examples / "own-sensor", examples / "own-target")
    subprocess.run([python, *PIP, *INSTALL, *packages], check=True)
    names = (
        "from orbtouch import plugins; print(plugins.names('sensors'), plugins.names('targets'))"
    )
    assert run(python, tmp_path, "-c", names) == "['drum'] ['lamp']\n"
    told = run(python, tmp_path, "-m", "orbtouch", "doctor", "--sensor", "drum")
    assert "12 of 12 move" in told
    words = ("play", "--target", "lamp", "--headless", "--seconds", "1")
    run(python, tmp_path, "-m", "orbtouch", *words)
