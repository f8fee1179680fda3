"""Processes: their memory, as Linux counts it, and their lines."""

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def memory_mib(field: str = "VmRSS", pid: int | str = "self") -> float:
    """Return one of the sizes in /proc/PID/status, MiB; LookupError, OSError: there is none."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith(f"{field}:"):
            return int(line.split()[1]) / 1024
    raise LookupError(field)


class LineProcess:
    """A process that is spoken to line by line."""

    def __init__(self, command: Sequence[str], **options: Any) -> None:
        # the process itself
        self.process: subprocess.Popen[str] = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1, **options
        )

    def say(self, line: object) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")

    def line(self) -> str:
        """Return its next line, waiting for it; RuntimeError: it has ended."""
        assert self.process.stdout is not None
        if line := self.process.stdout.readline():
            return line.strip()
        raise RuntimeError(f"{self.process.args!r} has ended; see its message above")

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()
