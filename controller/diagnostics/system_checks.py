"""The computer: the inference engine, disk, clock, and a link. Each check is one row."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from controller.diagnostics.report import Row, Verdict
from controller.links import LinkError, open_link
from controller.protocol.messages import DEADMAN_MS, HEARTBEAT_MS, VERSION, Welcome

_PROBE_S: Final = 60.0  # importing takes 7 s on the slowest machine tried
_PROBE: Final = (
    "import sys\n"
    "from controller.bundles import bundle\n"
    "from controller.bundles.inference.networks import Recognizer\n"
    "from pathlib import Path\n"
    "print(Recognizer(bundle.read(Path(sys.argv[1]))).engine)\n"
)
_OTHER: Final = "Try another version: pip install 'onnxruntime==1.20.1'"
_LITTLE: Final = 200e6  # bytes free: a session of ten minutes takes some 3 MB
_BEATS: Final = 40  # wake-ups of the clock check
_BEAT_S: Final = 0.02
_LATE_S: Final = (0.005, 0.05)  # the worst wake-up: doubtful, and half of a frame at 10 Hz
_WELCOME: Final = Welcome(
    VERSION, 1, "doctor", "OrbTouch", False, 1, 1, 10.0, 10.0, HEARTBEAT_MS, DEADMAN_MS,
    ("null",), ("pause",),
)  # fmt: skip


def runtime(bundle: Path, python: str = sys.executable) -> Row:
    """Return how ONNX Runtime does: imported and asked in a child, as it crashes on some boards.

    It has to give the golden answers of the bundle's networks.
    """
    name = "onnxruntime"
    try:
        done = subprocess.run(
            [python, "-c", _PROBE, str(bundle)],
            capture_output=True, text=True, timeout=_PROBE_S, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        found = f"no answer within {_PROBE_S:.0f} s"
        return Row(name, Verdict.FAULT, found, _OTHER, "runtime_hangs")
    if done.returncode < 0:
        found = f"crashes (signal {-done.returncode})"
        return Row(name, Verdict.FAULT, found, _OTHER, "runtime_crashes")
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        advice = "pip install --force-reinstall onnxruntime, or choose another --bundle"
        return Row(name, Verdict.FAULT, last, advice, "runtime_fails")
    return Row(name, Verdict.GOOD, f"{done.stdout.strip()} gives {bundle.name}'s golden answers")


def disk(folder: Path) -> Row:
    """Return whether a folder can be written to and has room."""
    place = next((p for p in (folder, *folder.parents) if p.is_dir()), Path())
    try:
        free = shutil.disk_usage(place).free
        with tempfile.TemporaryFile(dir=place, buffering=0) as file:
            file.write(b"doctor")
            os.fsync(file.fileno())
    except OSError as error:
        found = f"cannot write to {place}: {error.strerror or error}"
        advice = "Make the folder writable, or start the program as its owner."
        return Row("disk", Verdict.FAULT, found, advice, "disk")
    found = f"{free / 1e9:.1f} GB free at {place}"
    if free < _LITTLE:
        advice = "Make room: a long session takes tens of MB."
        return Row("disk", Verdict.DOUBTFUL, found, advice, "disk")
    return Row("disk", Verdict.GOOD, found)


def clock(
    now: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
) -> Row:
    """Return how late this computer wakes a program that has set its alarm."""
    start_s = now()
    late_s = []
    for beat in range(1, _BEATS + 1):
        due_s = start_s + beat * _BEAT_S
        sleep(max(0.0, due_s - now()))
        late_s.append(now() - due_s)
    late_s.sort()
    found = f"wakes {1e3 * late_s[_BEATS // 2]:.1f} ms late, at worst {1e3 * late_s[-1]:.1f} ms"
    advice = "End other programs, or run the controller as its service, which goes before others."
    if late_s[-1] < _LATE_S[0]:
        return Row("clock", Verdict.GOOD, found)
    worse = Verdict.FAULT if late_s[_BEATS // 2] > _LATE_S[1] else Verdict.DOUBTFUL
    return Row("clock", worse, found, advice, "late")


def link(url: str) -> Row:
    """Return whether a link, named as of `controller --link`, can be opened."""
    try:
        open_link(url, _WELCOME).close()
    except LinkError as error:
        return Row("link", Verdict.FAULT, str(error), "Choose another --link.", "link")
    return Row("link", Verdict.GOOD, f"{url} can be opened")
