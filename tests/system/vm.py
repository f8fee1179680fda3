"""Boot the image, let the guest run cases, and read what it found.

The guest sees two folders of this machine: /repo, a copy of the working tree, and /out, where it
leaves NAME.json and NAME.log of every case. Its console goes to console.log beside them.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from .image import DEFAULT, ImageError, image

TREE: Final = Path(__file__).resolve().parents[2]
PARTS: Final = ("controller", "host", "tetris", "models", "orbtouch", "assets", "tests")
CASES: Final = Path(__file__).parent / "cases"
# Emulated in software: /dev/kvm is often there and does not work, in containers and other
# machines' guests. Set to "kvm" where it does: the whole run then takes well under a minute.
ACCELERATOR: Final = os.environ.get("ORBTOUCH_VM_ACCELERATOR", "tcg,thread=multi")
# Every deadline, in here and in the guest, is so much longer: for machines with other work to do.
PATIENCE: Final = float(os.environ.get("ORBTOUCH_VM_PATIENCE", "1"))
BOOT_S: Final = 60 * PATIENCE
CASE_S: Final = 130 * PATIENCE  # the guest ends them a little earlier
MEMORY_MB: Final = 1536


@dataclass(frozen=True)
class Result:
    """What came of a case."""

    name: str  # the case
    ok: bool  # whether it went as it should
    seconds: float  # how long it took, on the guest's clock
    found: tuple[str, ...]  # what was seen, line by line
    rows: tuple[dict[str, Any], ...]  # what was measured: what, n, p50_ms, p99_ms
    log: str  # all that it printed, and the daemons with it


def names() -> list[str]:
    """Return the cases, in the order of their names."""
    return sorted(path.stem for path in CASES.glob("[a-z]*.py"))


def run(cases: Sequence[str], keep: Path | None = None, suite: str = DEFAULT) -> dict[str, Result]:
    """Boot once, run the cases one after the other, and return what came of each, or ImageError."""
    built = image(suite)
    with tempfile.TemporaryDirectory(prefix="orbtouch-system-") as name:
        out, repo = keep or Path(name) / "out", Path(name) / "repo"
        out.mkdir(parents=True, exist_ok=True)
        for case in ("console", *cases):
            for old in out.glob(f"{case}.*"):
                old.unlink()
        _stage(repo)
        (out / "cases").write_text(" ".join(cases))
        (out / "patience").write_text(f"{PATIENCE}")
        _boot(built, repo, out, BOOT_S + CASE_S * len(cases))
        console = (out / "console.log").read_text(errors="replace")
        if "guest ready" not in console:
            raise ImageError(f"the virtual machine did not come up: {console[-400:]!r}")
        return {name: _result(out, name) for name in cases}


def _result(out: Path, name: str) -> Result:
    log = out / f"{name}.log"
    text = log.read_text(errors="replace") if log.exists() else ""
    try:
        said: dict[str, Any] = json.loads((out / f"{name}.json").read_text())
    except (OSError, ValueError):
        return Result(name, False, 0.0, ("it left no result",), (), text)
    told = tuple(said["found"]), tuple(said["rows"])
    return Result(name, said["ok"], said["seconds"], *told, text)


def _stage(into: Path) -> None:
    """Copy what the guest needs, without what Python and editors leave behind."""
    ignore = shutil.ignore_patterns("__pycache__", ".*", "*.png", "test_*")
    shutil.rmtree(into, ignore_errors=True)
    for part in PARTS:
        shutil.copytree(TREE / part, into / part, ignore=ignore)
    shutil.copy(TREE / "pyproject.toml", into)


def _boot(built: Path, repo: Path, out: Path, seconds: float) -> None:
    command = [
        "qemu-system-x86_64", "-accel", ACCELERATOR, "-cpu", "max", "-smp", "2",
        "-m", str(MEMORY_MB), "-machine", "q35", "-nodefaults", "-no-user-config", "-nographic",
        "-no-reboot", "-kernel", str(built / "vmlinuz"), "-initrd", str(built / "initrd.gz"),
        "-append", "console=ttyS0 quiet panic=-1 mitigations=off random.trust_cpu=on",
        "-serial", "stdio", "-device", "virtio-rng-pci",
        "-drive", f"file={built / 'root.squashfs'},format=raw,if=virtio,readonly=on",
        "-virtfs", f"local,path={repo},mount_tag=repo,security_model=none,id=repo,readonly=on",
        "-virtfs", f"local,path={out},mount_tag=out,security_model=none,id=out",
    ]  # fmt: skip
    with (out / "console.log").open("wb") as console:
        machine = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=console, stderr=subprocess.STDOUT
        )
        try:
            machine.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            console.write(b"\nthe virtual machine was ended: it took too long\n")
        finally:
            machine.kill()
            machine.wait()
