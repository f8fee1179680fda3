"""Memory of processes, as Linux counts it."""

from pathlib import Path


def memory_mib(field: str = "VmRSS", pid: int | str = "self") -> float:
    """Return one of the sizes in /proc/PID/status, MiB.

    Raises:
        LookupError: The process has ended, or has no such size.
        OSError: There is no such process.
    """
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith(f"{field}:"):
            return int(line.split()[1]) / 1024
    raise LookupError(field)
