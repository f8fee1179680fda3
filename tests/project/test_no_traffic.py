"""Nothing leaves the machine, and no file appears outside the folders that SECURITY.md names."""

import os
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from tests.support import ROOT
from tests.support.system_calls import contacted, trace

DEMO = str(files("assets") / "demo.npz")
PROGRAMS = {
    "controller": ["controller", "--replay", DEMO],
    "host with its virtual orb": ["host", "--headless", "--seconds", "1"],
    "host --demo": ["host", "--demo", "--headless", "--seconds", "5", "--speed", "0"],
    "models": ["models", "evaluate", "--sessions", "1", "--minutes", "0.5"],
    "tetris": ["tetris", "--bot", "--headless", "--pieces", "20"],
}
OWN = (".config/orbtouch", ".local/share/orbtouch", ".local/state/orbtouch")
MATPLOTLIB = (".cache/matplotlib", ".config/matplotlib")  # its list of fonts


def traceable() -> bool:
    """Whether strace is there and may trace (some containers forbid it)."""
    strace = shutil.which("strace")
    if strace is None:
        return False
    command = [strace, "-qq", "-o", "/dev/null", "true"]
    return subprocess.run(command, check=False).returncode == 0


needs_strace = pytest.mark.skipif(not traceable(), reason="needs Debian's strace")


def environment(home: Path, temporary: Path) -> dict[str, str]:
    """Return what a user's programs get: no CI, which silences libraries, and no display."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("XDG_", "ORT_", "SDL_", "TORCH")) and name not in ("CI", "DISPLAY")
    }
    return {
        **kept,
        "HOME": str(home),
        "TMPDIR": str(temporary),
        "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "1",
        "SDL_VIDEODRIVER": "dummy",
        "SDL_AUDIODRIVER": "dummy",
    }


def stray(
    words: list[str], tmp_path: Path, *, writable: bool = True, also: tuple[str, ...] = ()
) -> set[Path]:
    """Run one of the programs; return what it made outside its folders and the one it runs in."""
    home = tmp_path / "home" if writable else Path("/proc/home")  # root writes anywhere else
    temporary, work = tmp_path / "tmp", tmp_path / "work"
    for folder in (tmp_path / "home", temporary, work):
        folder.mkdir()
    seen = trace([sys.executable, "-m", *words], environment(home, temporary), folder=work)
    assert seen.status == 0, seen.output
    assert seen.contacts == frozenset()
    allowed = [temporary, *(home / name for name in (*OWN, *also))]
    return {
        path
        for path in seen.made - {work}
        if not any(path.is_relative_to(one) or one.is_relative_to(path) for one in allowed)
    }


@needs_strace
@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("writable", [True, False], ids=["", "HOME cannot be written"])
def test_a_program_keeps_to_its_machine_and_its_folders(
    program: str, writable: bool, tmp_path: Path
) -> None:
    assert stray(PROGRAMS[program], tmp_path, writable=writable) == set()


@needs_strace
@pytest.mark.train
def test_training_keeps_to_its_machine_and_its_folders(tmp_path: Path) -> None:
    data = str(tmp_path / "data")
    simulated = ["--users", "1", "--sessions", "2", "--minutes", "1", "--out", data]
    subprocess.run([sys.executable, "-m", "models", "simulate", *simulated], check=True)
    training = ["models", "train", data, "--out", "my.orb", "--epochs", "1", "--no-advice"]
    made = stray(training, tmp_path, also=MATPLOTLIB)
    assert {path for path in made if not path.is_relative_to(tmp_path / "work")} == set()


@needs_strace
def test_a_library_that_looks_up_names_or_leaves_files_is_seen(tmp_path: Path) -> None:
    talks = (
        "import os, socket\n"
        "for place in (('127.0.0.1', 53), ('127.0.0.1', 9)):\n"
        "    socket.socket(socket.AF_INET, socket.SOCK_DGRAM).connect(place)\n"
        "os.makedirs('.cache/maker'); os.chdir('.cache'); open('maker/id', 'w').close()\n"
    )
    seen = trace([sys.executable, "-Wignore", "-c", talks], dict(os.environ), folder=tmp_path)
    assert seen.contacts == {"127.0.0.1:53"}
    assert {tmp_path / ".cache", tmp_path / ".cache/maker/id"} <= seen.made


@pytest.mark.parametrize(
    ("arguments", "whom"),
    [
        ('3<socket:[1]>, {sa_family=AF_INET, sin_port=htons(443), sin_addr=inet_addr("192.0.2.1")}',
         {"192.0.2.1:443"}),
        ('3<socket:[1]>, {sa_family=AF_INET6, sin6_port=htons(443), sin6_flowinfo=htonl(0), '
         'inet_pton(AF_INET6, "2001:db8::1", &sin6_addr), sin6_scope_id=0}, 28) = 0',
         {"2001:db8::1:443"}),
        ('3<socket:[1]>, {sa_family=AF_INET, sin_port=htons(80), sin_addr=inet_addr("127.0.0.1")}',
         set()),
        ('3<socket:[1]>, {sa_family=AF_UNIX, sun_path="/tmp/.X11-unix/X0"}, 20) = 0', set()),
        ('3<socket:[1]>, {sa_family=AF_UNIX, '
         'sun_path="/run/systemd/resolve/io.systemd.Resolve"}, 42) = 0',
         {"/run/systemd/resolve/io.systemd.Resolve"}),
    ],
)  # fmt: skip
def test_addresses_outside_this_machine_are_told_apart(arguments: str, whom: set[str]) -> None:
    assert contacted("connect", arguments) == whom
