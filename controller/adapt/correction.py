"""Corrections in play: the player labels the latest touch, and the network learns it.

    python -m controller.adapt.correction BUNDLE OUT LABEL RATE < images.npy

is the training process, so that the control loop does not wait; it runs at low priority.
"""

import io
import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

from controller.adapt.examples import Example, Images, touched
from controller.adapt.few_shot import AdaptError, teach
from controller.bundles import bundle as bundles
from controller.bundles.bundle import BundleError
from controller.bundles.deploy.store import BundleStore

LATEST_S: Final = 2.5  # greatest age of the corrected touch
GAP_S: Final = 0.4  # between two touches; that of a double tap is shorter
LEAD_S: Final = 1.3  # of images before the touch
DEADLINE_S: Final = 120.0
MOST: Final = 40  # corrections in a bundle
NICE: Final = 10
NOTE: Final = "corrected in play: "
_ENV: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def example(label: str, images: Images, rate_hz: float) -> Example:
    """Return the latest touch in images as an example; AdaptError: none, or a weak one."""
    cut = latest(images, rate_hz)
    if cut is None:
        raise AdaptError(f"nothing touched the orb in the last {LATEST_S:g} s; correct it sooner")
    one = Example(label, cut)
    if one.found(rate_hz) is None:
        raise AdaptError("that touch is too weak to learn from")
    return one


def latest(images: Images, rate_hz: float) -> Images | None:
    """Return the images around the latest touch, (frames, rows, columns); None without a touch."""
    touches = touched(images, GAP_S * rate_hz) if len(images) >= 3 else []
    if not touches or touches[-1].span[1] < len(images) - LATEST_S * rate_hz:
        return None
    before = math.ceil(touches[-2].span[1]) if len(touches) > 1 else 0
    first = math.ceil(touches[-1].span[0]) - round(LEAD_S * rate_hz)
    return images[max(before, first) :]


def correct(
    label: str,
    images: Images,
    rate_hz: float,
    store: BundleStore,
    install: Callable[[Path, str], str],
) -> str:
    """Learn the label of the latest touch, take the new bundle into use, and return a sentence.

    Training takes seconds: call this in a thread of its own. The label "null" is no gesture, and ""
    takes the last correction back. `install` tests a file and takes it into use, given the name of
    the bundle that it corrects.

    Raises:
        BundleError, AdaptError, OSError: Nothing has changed; the message has the reason.
    """
    if not label:
        left = _corrections(store.path(store.take_back().current))
        return f"taken back ({left} left)"
    before = store.record().current
    path = store.path(before, rate_hz)
    count = _corrections(path)
    if count >= MOST:
        raise AdaptError(
            f"{MOST} corrections are enough; teach the gesture again (docs/teach.md), or go back "
            "with controller rollback"
        )
    example(label, images, rate_hz)  # refuses an unusable example before the process starts
    out = store.folder / "incoming" / "corrected.orb"
    out.parent.mkdir(parents=True, exist_ok=True)
    try:
        _in_a_process(path, out, label, images, rate_hz)
        install(out, before)
    finally:
        out.unlink(missing_ok=True)
    return f"learned: that was {_shown(label)} ({count + 1} so far)"


def _shown(label: str) -> str:
    """Return a label for messages and notes."""
    return "nothing" if label == "null" else label


def _corrections(path: Path) -> int:
    """Return the number of corrections in a bundle."""
    return sum(str(note).startswith(NOTE) for note in bundles.read(path).card.get("added", []))


def _in_a_process(path: Path, out: Path, label: str, images: Images, rate_hz: float) -> None:
    """Run the training process on images, (frames, rows, columns)."""
    command = [sys.executable, "-m", "controller.adapt.correction", str(path.resolve()), str(out),
               label, repr(rate_hz)]  # fmt: skip
    buffer = io.BytesIO()
    np.save(buffer, images)
    environment = {**os.environ, **dict.fromkeys(_ENV, "1")}
    try:
        done = subprocess.run(
            command, input=buffer.getvalue(), capture_output=True, timeout=DEADLINE_S,
            env=environment, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise AdaptError(f"it was not learned within {DEADLINE_S:g} s") from None
    if done.returncode:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        raise AdaptError(lines[-1] if lines else f"learning ended with status {done.returncode}")


def main(argv: list[str]) -> int:
    """Learn one correction: BUNDLE OUT LABEL RATE, images on standard input."""
    path, out, label, rate = argv
    if hasattr(os, "nice"):
        os.nice(NICE)
    images = np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False)
    try:
        one = example(label, images, float(rate))
        teach(Path(path).read_bytes(), [one], note=NOTE + _shown(label)).write(Path(out))
    except (AdaptError, BundleError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
