"""Watch a program's system calls with strace: addresses contacted, and files made.

Python's audit hooks do not see what native libraries do, so the kernel is asked.
"""

import os
import re
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import Final

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
