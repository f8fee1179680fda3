"""Checks of the computer: the inference engine, disk and a link, one row each."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from controller.diagnostics.report import Row, Verdict
from controller.links import LinkError, open_link
from controller.shared.notices import notice
from controller.shared.protocol.messages import DEADMAN_MS, HEARTBEAT_MS, VERSION, Welcome

_PROBE_S: Final = 60.0  # importing takes 7 s on the slowest machine tried
_PROBE: Final = (
    "import sys\n"
    "from controller.bundles import bundle\n"
    "from controller.bundles.inference.networks import Recognizer\n"
    "from pathlib import Path\n"
    "print(Recognizer(bundle.read(Path(sys.argv[1]))).engine)\n"
)
_OTHER: Final = notice("other_version", "pip install 'onnxruntime==1.20.1'")
_LITTLE: Final = 200e6  # bytes free: a session of ten minutes takes some 3 MB
_GRID: Final = (1, 1, 10.0, 10.0)
_TIMES: Final = (HEARTBEAT_MS, DEADMAN_MS)
_WELCOME: Final = Welcome(
    VERSION, 1, "doctor", "OrbTouch", False, *_GRID, *_TIMES, ("null",), ("pause",)
)


def runtime(bundle: Path, python: str = sys.executable) -> Row:
    """Return how ONNX Runtime does: imported and asked in a child, as it crashes on some boards.

    It has to give the golden answers of the bundle's networks.
    """
    name = "onnxruntime"
    try:
        done = subprocess.run(
            [python, "-c", _PROBE, str(bundle)],
            capture_output=True,
            text=True,
            timeout=_PROBE_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        found = notice("hangs", _PROBE_S)
        return Row(name, Verdict.FAULT, found, _OTHER, "runtime_hangs")
    if done.returncode < 0:
        found = notice("crashes", -done.returncode)
        return Row(name, Verdict.FAULT, found, _OTHER, "runtime_crashes")
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return Row(name, Verdict.FAULT, last, notice("reinstall"), "runtime_fails")
    return Row(name, Verdict.GOOD, notice("golden", done.stdout.strip(), bundle.name))


def disk(folder: Path) -> Row:
    """Return whether a folder can be written to and has room."""
    place = next((p for p in (folder, *folder.parents) if p.is_dir()), Path())
    try:
        free = shutil.disk_usage(place).free
        with tempfile.TemporaryFile(dir=place, buffering=0) as file:
            file.write(b"doctor")
            os.fsync(file.fileno())
    except OSError as error:
        found = notice("unwritable", place, error.strerror or error)
        return Row("disk", Verdict.FAULT, found, notice("unwritable_advice"), "disk")
    found = notice("free", free / 1e9, place)
    if free < _LITTLE:
        return Row("disk", Verdict.DOUBTFUL, found, notice("room"), "disk")
    return Row("disk", Verdict.GOOD, found)


def link(url: str) -> Row:
    """Return whether a link, named as of `controller --link`, can be opened."""
    try:
        open_link(url, _WELCOME).close()
    except LinkError as error:
        return Row("link", Verdict.FAULT, str(error), "Choose another --link.", "link")
    return Row("link", Verdict.GOOD, f"{url} can be opened")
