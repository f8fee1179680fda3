"""The device's part on 64-bit ARM: its own tests and its golden answers, under qemu's emulation.

    python -m tests.system.arm64 [TESTS...]

Builds, once, in the user's cache folder: qemu for user programs, a Debian for ARM with nothing in
it but Python, and the wheels that a Raspberry Pi would install. Then it compares the
golden answers with this machine's, and runs the device's default tests there. About ten minutes the
first time; emulated seconds say nothing about a Pi's.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Final

import numpy as np
import platformdirs

SUITE: Final = "trixie"  # Debian 13: qemu 10
PYTHON: Final = "3.13"  # the suite's
PLATFORMS: Final = ("manylinux_2_28_aarch64", "manylinux_2_27_aarch64", "manylinux2014_aarch64")
WHEELS: Final = (
    "numpy onnxruntime platformdirs pyserial tomli-w pytest pytest-xdist hypothesis cobs"
)
CPU: Final = "cortex-a72"  # the Raspberry Pi 4's
AGREE: Final = 1e-5
PATIENCE_S: Final = "300"  # with a program that takes seconds on the machine itself
ROOT: Final = Path(__file__).parents[2]
# The device's rooms. What opens windows or needs SciPy is another machine's part.
TESTS: Final = """
    controller/bundles/bundle controller/recognition/debounce controller/bundles/engines
    controller/bundles/onnx_reader controller/recordings/journal controller/capture/labels
    controller/capture/session_recorder controller/links/links controller/runtime/loop
    controller/recognition/mapping controller/shared/npz controller/recognition/pipeline
    controller/recognition/images/preprocess controller/shared/protocol/messages
    controller/recordings/recorder controller/recordings/recording controller/bundles/store
    controller/start controller/capture/session_recorder controller/recognition/touch_position
    controller/bundles/vocabulary controller/cli/run
"""
ANSWERS: Final = """
import sys
import numpy as np
from controller.bundles import bundle
from controller.bundles.inference import onnxruntime_engine
shipped = bundle.read(bundle.default_path())
golden = shipped.golden
out = {}
for name, model, questions in (
    ("gesture", shipped.embedding_onnx, golden.windows),
    ("location", shipped.location_onnx, golden.images),
):
    network = onnxruntime_engine.network(model)
    out[name] = np.array([network(q[None])[0] for q in questions])
np.savez(sys.argv[1], **out)
"""


class MissingError(OSError):
    """Something is not there; one sentence says what and what to do."""


def python() -> Path:
    """Return a program that is the emulated machine's Python, built first if it must be."""
    home = platformdirs.user_cache_path("orbtouch", appauthor=False) / f"arm64-{SUITE}"
    program = home / "python"
    if not program.exists():
        if shutil.which("mmdebstrap") is None:
            raise MissingError("mmdebstrap is not installed; apt-get install mmdebstrap")
        home.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=home.parent) as beside:
            _build(Path(beside), home)
            Path(beside, "python").chmod(0o755)
            shutil.rmtree(home, ignore_errors=True)
            Path(beside).rename(home)
            Path(beside).mkdir()  # for the context to remove
    return program


def _build(folder: Path, home: Path) -> None:
    """Fill a folder that will be called `home`."""
    keyring = "/usr/share/keyrings/debian-archive-keyring.gpg"
    source = f"deb [signed-by={keyring}] {_mirror()} {SUITE} main"
    parts = (("qemu", "amd64", "qemu-user"), ("debian", "arm64", "python3,libstdc++6,libgomp1"))
    for name, architecture, packages in parts:
        print(f"unpacking {packages} for {architecture} ...", file=sys.stderr)
        _run(
            "mmdebstrap", "--quiet", f"--architectures={architecture}", "--variant=extract",
            f"--include={packages}", SUITE, str(folder / name), source,
        )  # fmt: skip
    # What is missing here is looked for on this machine: its devices are those that work.
    shutil.rmtree(folder / "debian" / "dev", ignore_errors=True)
    for part in ("lib", "lib64", "bin"):
        link = folder / "debian" / part
        if not link.exists():
            link.symlink_to(f"usr/{part}")
    print("fetching wheels ...", file=sys.stderr)
    wheels = folder / "wheels"
    _run(
        sys.executable, "-m", "pip", "download", "--quiet", "--only-binary=:all:",
        "--implementation=cp", f"--python-version={PYTHON}", f"--dest={wheels}",
        *(f"--platform={platform}" for platform in PLATFORMS), *WHEELS.split(),
    )  # fmt: skip
    site = folder / "site"
    for wheel in wheels.glob("*.whl"):
        zipfile.ZipFile(wheel).extractall(site)
    shutil.rmtree(wheels)
    # Programs that are started by this Python find themselves through this file.
    (site / "sitecustomize.py").write_text(
        f"import sys\nsys.executable = sys._base_executable = {str(home / 'python')!r}\n"
    )
    (folder / "python").write_text(_SCRIPT.format(home=home, cpu=CPU, python=PYTHON))


_SCRIPT: Final = """#!/bin/sh
export QEMU_LD_PREFIX={home}/debian PYTHONHOME={home}/debian/usr PYTHONDONTWRITEBYTECODE=1
export PYTHONPATH={home}/site${{ORBTOUCH:+:$ORBTOUCH}}
exec {home}/qemu/usr/bin/qemu-aarch64 -cpu {cpu} \\
    -E LD_LIBRARY_PATH={home}/debian/usr/lib/aarch64-linux-gnu \\
    {home}/debian/usr/bin/python{python} "$@"
"""


def _mirror() -> str:
    """Return where this machine's own packages come from."""
    done = subprocess.run(
        ["apt-get", "indextargets", "--format", "$(REPO_URI)", "Created-By: Packages"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    mirrors = [line for line in done.stdout.splitlines() if line.rstrip("/").endswith("/debian")]
    if not mirrors:
        raise MissingError("apt-get names no Debian mirror; this needs a Debian, with its sources")
    return mirrors[0]


def _run(*command: str) -> None:
    done = subprocess.run(command, stdout=sys.stderr, check=False)
    if done.returncode:
        raise MissingError(f"{command[0]} ended with status {done.returncode}; see above")


def answers(
    program: Path, folder: Path
) -> dict[str, np.ndarray[tuple[int, ...], np.dtype[np.float32]]]:
    """Return the golden answers of each network, as a Python gives them."""
    path = folder / "answers.npz"
    subprocess.run(
        [str(program), "-c", ANSWERS, str(path)],
        check=True, cwd=ROOT, env={**os.environ, "ORBTOUCH": str(ROOT)},
    )  # fmt: skip
    with np.load(path) as arrays:
        return dict(arrays)


def compare(program: Path) -> float:
    """Print how far the two machines' answers are apart, and return the greatest difference."""
    with tempfile.TemporaryDirectory() as here, tempfile.TemporaryDirectory() as there:
        ours, theirs = answers(Path(sys.executable), Path(here)), answers(program, Path(there))
    worst = 0.0
    for name, array in ours.items():
        apart = float(np.abs(array - theirs[name]).max())
        worst = max(worst, apart)
        print(f"{name:24} {len(array):4} answers, at most {apart:.1e} apart")
    return worst


def main() -> int:
    """Compare, then run the tests; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.system.arm64")
    parser.add_argument("tests", nargs="*", help="files of tests (default: the device's)")
    chosen = parser.parse_args().tests or [
        "tests/{}/test_{}.py".format(*name.rsplit("/", 1)) for name in TESTS.split()
    ]
    try:
        program = python()
    except MissingError as error:
        print(error, file=sys.stderr)
        return 1
    if compare(program) > AGREE:
        print(f"that is more than {AGREE:g}")
        return 1
    return subprocess.run(
        [str(program), "-m", "pytest", "-n0", "-p", "no:cacheprovider", *chosen],
        cwd=ROOT, check=False,
        env={**os.environ, "ORBTOUCH": str(ROOT), "ORBTOUCH_PATIENCE_S": PATIENCE_S},
    ).returncode  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
