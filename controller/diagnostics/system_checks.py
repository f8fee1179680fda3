"""The computer: libraries, disk, permissions, clock. Each check is one row or a few."""

import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from controller.diagnostics.report import Row, Verdict
from controller.errors import how_to_install

_PROBE_S: Final = 60.0  # importing takes 7 s on the slowest machine tried
_PROBE: Final = (
    "import sys\n"
    "from controller.bundles import bundle\n"
    "from controller.bundles.inference.networks import Recognizer\n"
    "from pathlib import Path\n"
    "print(Recognizer(bundle.read(Path(sys.argv[1])), 'onnxruntime').engine)\n"
)
_LIBRARIES: Final = (("numpy", "numpy"), ("pyserial", "serial"), ("platformdirs", "platformdirs"))
_PI_LIBRARIES: Final = (("gpiozero", "gpiozero"), ("lgpio", "lgpio"), ("spidev", "spidev"))
_LITTLE: Final = 200e6  # bytes free: a session of ten minutes takes some 3 MB
_NOTHING: Final = 10e6
_BEATS: Final = 40  # wake-ups of the clock check
_BEAT_S: Final = 0.02
_LATE_S: Final = (0.005, 0.05)  # the worst wake-up: doubtful, and half of a frame at 10 Hz


def libraries(bundle: Path, *, pi: bool) -> Iterator[Row]:
    """Yield a row on each library; ONNX Runtime is tried in a process of its own.

    Args:
        bundle: The networks that it shall run: it has to give their golden answers.
        pi: Whether the libraries of a real orb are needed.
    """
    for name, module in (*_LIBRARIES, *(_PI_LIBRARIES if pi else ())):
        if importlib.util.find_spec(module) is None:
            advice = (
                how_to_install("pi") if (name, module) in _PI_LIBRARIES else f"pip install {name}"
            )
            yield Row(name, Verdict.FAULT, "not installed", advice, "library")
        else:
            yield Row(name, Verdict.GOOD, _version(name))
    yield runtime(bundle)


def runtime(bundle: Path, python: str = sys.executable) -> Row:
    """Return how ONNX Runtime does: imported and asked in a child, as it crashes on some boards."""
    name = "onnxruntime"
    try:
        done = subprocess.run(
            [python, "-c", _PROBE, str(bundle)],
            capture_output=True, text=True, timeout=_PROBE_S, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return Row(
            name, Verdict.FAULT, f"no answer within {_PROBE_S:.0f} s",
            "Install another version: pip install 'onnxruntime==1.20.1'", "runtime_hangs",
        )  # fmt: skip
    except OSError as error:
        return Row(name, Verdict.UNKNOWN, f"cannot start {python}: {error.strerror}")
    if done.returncode < 0 or done.returncode > 128:
        number = -done.returncode if done.returncode < 0 else done.returncode - 128
        return Row(
            name, Verdict.FAULT, f"crashes (signal {number})",
            "This build does not suit the processor; try another version: "
            "pip install 'onnxruntime==1.20.1'", "runtime_crashes",
        )  # fmt: skip
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        advice = "pip install --force-reinstall onnxruntime, or choose another --bundle"
        return Row(name, Verdict.FAULT, last, advice, "runtime_fails")
    return Row(name, Verdict.GOOD, f"{done.stdout.strip()} gives {bundle.name}'s golden answers")


def disk(folder: Path) -> Row:
    """Return whether a folder can be written to and has room."""
    name = "disk"
    place = next((p for p in (folder, *folder.parents) if p.is_dir()), Path())
    try:
        free = shutil.disk_usage(place).free
        probe = place / f".orbtouch-doctor-{os.getpid()}"
        try:
            with probe.open("xb", buffering=0) as file:
                file.write(b"doctor")
                os.fsync(file.fileno())
        finally:
            with suppress(OSError):
                probe.unlink()
    except OSError as error:
        reason = error.strerror or str(error)
        return Row(
            name, Verdict.FAULT, f"cannot write to {place}: {reason}",
            "Make the folder writable, or start the program as its owner.", "disk",
        )  # fmt: skip
    found = f"{free / 1e9:.1f} GB free at {place}"
    if free < _LITTLE:
        verdict = Verdict.FAULT if free < _NOTHING else Verdict.DOUBTFUL
        return Row(name, verdict, found, "Make room: a long session takes tens of MB.", "disk")
    return Row(name, Verdict.GOOD, found)


def permissions(root: Path = Path("/dev")) -> Iterator[Row]:
    """Yield a row on each device of a Raspberry Pi that a real orb needs."""
    for name, pattern, group, switch in (
        ("SPI bus", "spidev*", "spi", "switch SPI on with raspi-config, and start anew"),
        ("pins", "gpiochip*", "gpio", "is this a Raspberry Pi?"),
    ):
        found = sorted(root.glob(pattern))
        if not found:
            advice = switch[0].upper() + switch[1:] + ("" if switch.endswith("?") else ".")
            yield Row(name, Verdict.FAULT, f"there is no {root / pattern}", advice, "no_device")
        elif closed := [path for path in found if not os.access(path, os.R_OK | os.W_OK)]:
            yield Row(
                name, Verdict.FAULT, f"{closed[0]} may not be opened",
                f"sudo usermod -aG {group} $USER, then log in anew.", "permission",
            )  # fmt: skip
        else:
            yield Row(name, Verdict.GOOD, ", ".join(str(path) for path in found))


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


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "version unknown"
