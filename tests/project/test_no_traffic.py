"""Nothing leaves the machine, and no file appears outside the folders that SECURITY.md names."""

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from ipaddress import ip_address
from pathlib import Path
from typing import Final

import pytest

from tests.support import ROOT

# Python's audit hooks do not see what native libraries do, so the kernel is asked: strace.
_CONTACTS: Final = ("connect", "sendto", "sendmsg", "sendmmsg")
_MAKERS: Final = (
    "open", "openat", "openat2", "creat", "mkdir", "mkdirat", "mknod", "mknodat", "link", "linkat",
    "symlink", "symlinkat", "rename", "renameat", "renameat2",
)  # fmt: skip
_CALL: Final = re.compile(r"(\w+)\((.*)")
_ADDRESS: Final = re.compile(
    r"sin6?_port=htons\((\d+)\).*?(?:inet_addr\(\"|inet_pton\(AF_INET6, \")([^\"]+)"
)
_PLACE: Final = re.compile(r'(?:(?:AT_FDCWD|\d+)<([^>]*)>, )?"((?:[^"\\]|\\.)*)"')
PATIENCE_S: Final = 60.0  # an upper bound; everything here takes seconds
_RESOLVER: Final = re.compile(r'sun_path="([^"]*[Rr]esolve[^"]*)"')  # of systemd, for names
_DNS: Final = 53  # the port at which names are looked up, on this machine or elsewhere

DEMO = str(files("assets") / "demo.npz")
PROGRAMS = {
    "controller": ["controller", "--replay", DEMO],
    "host with its virtual orb": ["host", "--headless", "--seconds", "1"],
    "host --phone": ["host", "--headless", "--seconds", "1", "--phone", "127.0.0.1:0"],
    "host --demo": ["host", "--demo", "--headless", "--seconds", "5"],
    "models": ["models", "evaluate", "--sessions", "1", "--minutes", "0.5"],
    "tetris": ["tetris", "--bot", "--headless", "--pieces", "20"],
}
OWN = (".config/orbtouch", ".local/share/orbtouch", ".local/state/orbtouch")
MATPLOTLIB = (".cache/matplotlib", ".config/matplotlib")  # its list of fonts


@dataclass(frozen=True, slots=True)
class Trace:
    """What a program did."""

    status: int  # its exit status
    output: str  # its standard output and error
    # addresses outside this machine and name servers anywhere, "ADDRESS:PORT" or the path of a
    # socket
    contacts: frozenset[str]
    made: frozenset[Path]  # files and folders that it made or tried to make, but for devices


def trace(command: Sequence[str], environment: dict[str, str], folder: Path) -> Trace:
    """Run a program to its end under strace, all its threads and children included."""
    with tempfile.TemporaryDirectory() as logs:
        calls = ",".join(f"?{name}" for name in (*_CONTACTS, *_MAKERS))
        strace = ["strace", "-ff", "-qq", "-y", "--seccomp-bpf", "-s", "4096", "-e", "signal=none"]
        watched = [*strace, "-e", f"trace={calls}", "-o", f"{logs}/log", *command]
        status, output = _run(watched, environment, folder)
        contacts: set[str] = set()
        made: set[Path] = set()
        for log in Path(logs).iterdir():
            for line in log.read_text(errors="replace").splitlines():
                if (call := _CALL.match(line)) is not None:
                    contacts |= contacted(call[1], call[2])
                    made |= _made(call[1], call[2], folder)
    return Trace(status, output, frozenset(contacts), frozenset(made))


def _run(command: Sequence[str], environment: dict[str, str], folder: Path) -> tuple[int, str]:
    """Return a program's exit status and output; start it again if strace loses a child."""
    for _ in range(2):  # one run in about a hundred ended without strace noticing it
        with subprocess.Popen(
            command, env=environment, cwd=folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
        ) as process:  # fmt: skip
            try:
                output, _ = process.communicate(timeout=PATIENCE_S)
                return process.returncode, output
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
    raise TimeoutError(f"{command[-1]} does not end within {PATIENCE_S:g} s")


def contacted(name: str, arguments: str) -> set[str]:
    """Return whom a call contacts that is not this machine, or looks up names."""
    if name not in _CONTACTS:
        return set()
    outside = {
        f"{address}:{port}"
        for port, address in _ADDRESS.findall(arguments)
        if int(port) == _DNS or not ip_address(address).is_loopback
    }
    return outside | set(_RESOLVER.findall(arguments))


def _made(name: str, arguments: str, folder: Path) -> set[Path]:
    if name not in _MAKERS or (name.startswith("open") and "O_CREAT" not in arguments):
        return set()
    places = [Path(at or folder, file) for at, file in _PLACE.findall(arguments)]
    found = {Path(os.path.normpath(place)) for place in places[-1:]}
    return {place for place in found if not place.is_relative_to("/dev") or "shm" in place.parts}


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
    training = ["models", "train", data, "--out", "my.orb", "--epochs", "1"]
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
