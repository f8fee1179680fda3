"""Special files, and how to run a command that is given one, in bounded time and memory.

Devices are links in a folder of the test's own, so that a command that replaces the file by
mistake replaces the link. All of it needs Linux.
"""

import io
import os
import resource
import signal
import socket
from collections.abc import Callable, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Final

from tests.support.processes import memory_mib

PATIENCE_S: Final = 120  # an upper bound: milliseconds, and the import of PyTorch once
MEMORY: Final = 2 << 30  # bytes that a command may ask for on top of what the tests have

TEXTS: Final[dict[str, bytes]] = {
    "empty": b"",
    "binary": b"\xff\xfe\x00\x01" * 100,
    "dots": b"x" + b".a" * 30_000 + b" = 1",  # tomllib alone takes 3.5 GB
    "brackets": b"x = " + b"[" * 50_000,
    "json": b"[" * 50_000,
    "digits": b"x = " + b"9" * 5_000,
    "sequences": b'x = "\\u001b]0;title\\u0007"\n\x1b]0;title\x07 = 1',
}
_LINKS: Final[dict[str, str]] = {
    "endless": "/dev/zero",
    "full": "/dev/full",
    "null": "/dev/null",
    "unreadable": "/proc/self/mem",  # a regular file that even root cannot read
    "loop": "special",  # to itself
    "dangling": "nowhere",
}
KINDS: Final = ("missing", "folder", "pipe", "socket", "sparse", "locked", *_LINKS, *TEXTS)


class HangError(BaseException):
    """A command did not end in time. Not an Exception: the command would report it as its own."""


@dataclass(frozen=True)
class Answer:
    """The end of a command: its exit status, and what it printed on standard error and output."""

    status: int
    error: str
    output: str

    def refused_by(self, program: str) -> bool:
        """Whether this is one sentence by a program, printable, with status 1 or 2."""
        lines = self.error.splitlines()
        return (
            self.status in (1, 2)
            and len(lines) == 1
            and lines[0].startswith(f"{program}: ")
            and lines[0].isprintable()
        )


def make(kind: str, folder: Path, name: str = "special") -> Path:
    """Make a file of one of `KINDS` in a folder, and return its path."""
    path = folder / name
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as server, chdir(folder):  # long paths do not fit
            server.bind(name)
    elif kind == "sparse":
        with path.open("wb") as file:
            file.truncate(8 << 30)
    elif kind == "locked":  # to all but root, to whom it is an empty file
        path.touch(0o000)
    elif kind in _LINKS:
        path.symlink_to(name if kind == "loop" else _LINKS[kind])
    elif kind in TEXTS:
        path.write_bytes(TEXTS[kind])
    return path


def answer(main: Callable[[list[str]], int], words: Sequence[str]) -> Answer:
    """Run a command in this process; return its answer, or raise HangError or MemoryError."""

    def late(number: int, frame: FrameType | None) -> None:
        raise HangError(f"{' '.join(words)} did not end in {PATIENCE_S} s")

    errors, output = io.StringIO(), io.StringIO()
    limits = resource.getrlimit(resource.RLIMIT_AS)
    before = signal.signal(signal.SIGALRM, late)
    mapped = int(memory_mib("VmSize") * 2**20)  # bytes
    resource.setrlimit(resource.RLIMIT_AS, (mapped + MEMORY, limits[1]))
    signal.alarm(PATIENCE_S)
    try:
        with redirect_stderr(errors), redirect_stdout(output):
            try:
                status = main(list(words))
            except SystemExit as end:  # argparse's way
                status = end.code if isinstance(end.code, int) else 1
    finally:
        signal.alarm(0)
        resource.setrlimit(resource.RLIMIT_AS, limits)
        signal.signal(signal.SIGALRM, before)
    return Answer(status, errors.getvalue(), output.getvalue())
