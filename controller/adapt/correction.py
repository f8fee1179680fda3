"""`That was a twist`: the latest touch, named by the player, learned while play goes on.

    python -m controller.adapt.correction BUNDLE OUT LABEL < images.npy

is the process that learns, so that the loop that plays never waits for it; it is nice to others.
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
from numpy.typing import NDArray

from controller.adapt.examples import Example, touched
from controller.adapt.few_shot import AdaptError, teach
from controller.bundles import bundle as bundles
from controller.bundles.bundle import BundleError
from controller.bundles.deploy.store import BundleStore

LATEST_S: Final = 2.5  # a touch that ended earlier is not meant
GAP_S: Final = 0.4  # between two touches; a double tap's is shorter
LEAD_S: Final = 1.3  # of images before the touch
DEADLINE_S: Final = 120.0
MOST: Final = 40  # corrections that a bundle takes
NICE: Final = 10
NOTE: Final = "corrected in play: "
_ENV: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

Images = NDArray[np.float32]


def example(label: str, images: Images, rate_hz: float) -> Example:
    """Return the latest touch in some images, as an example of what the player calls it.

    Args:
        label: The gesture; "null": it was none.
        images: z, (frames, rows, columns), up to now.
        rate_hz: Frames per second.

    Raises:
        AdaptError: Nothing touched lately.
    """
    cut = latest(images, rate_hz)
    if cut is None:
        raise AdaptError(f"nothing touched the orb in the last {LATEST_S:g} s; correct it sooner")
    one = Example(label, cut)
    if one.found(rate_hz) is None:
        raise AdaptError("that touch is too weak to learn from")
    return one


def latest(images: Images, rate_hz: float) -> Images | None:
    """Return the images of the latest touch with what is around it; None: there was none."""
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
    """Learn what the latest touch was and take the bundle that knows it into use.

    It takes seconds: call it in a thread of its own.

    Args:
        label: What it was; "null": nothing; "": take the last correction back.
        images: The latest, z, (frames, rows, columns).
        rate_hz: Frames per second.
        store: Bundle store of this device.
        install: Proves a file and takes it into use; given the name of the bundle that it
            corrects as well.

    Returns:
        What is in use now, a sentence.

    Raises:
        BundleError, AdaptError, OSError: Nothing has changed; the message has the reason.
    """
    if not label:
        left = _corrections(store.path(store.take_back().current))
        return f"taken back ({left} left)"
    before = store.record().current
    path = store.path(before)
    made = _corrections(path)
    if made >= MOST:
        raise AdaptError(
            f"{MOST} corrections are enough; teach the gesture again (docs/teach.md), or go back "
            "with controller rollback"
        )
    example(label, images, rate_hz)  # what cannot be learned from is told at once
    out = store.folder / "incoming" / "corrected.orb"
    out.parent.mkdir(parents=True, exist_ok=True)
    try:
        _in_a_process(path, out, label, images, rate_hz)
        install(out, before)
    finally:
        out.unlink(missing_ok=True)
    what = "nothing" if label == "null" else label
    return f"learned: that was {what} ({made + 1} so far)"


def _corrections(path: Path) -> int:
    """Return how many corrections a bundle has."""
    added = bundles.read(path).card.get("added")
    return sum(str(note).startswith(NOTE) for note in added) if isinstance(added, list) else 0


def _in_a_process(path: Path, out: Path, label: str, images: Images, rate_hz: float) -> None:
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
        told = done.stderr.decode(errors="replace").strip().splitlines()
        raise AdaptError(told[-1] if told else f"learning ended with status {done.returncode}")


def main(argv: list[str]) -> int:
    """Learn one correction: BUNDLE OUT LABEL RATE, images on standard input."""
    path, out, label, rate = argv
    if hasattr(os, "nice"):
        os.nice(NICE)
    images = np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False)
    try:
        one = example(label, images, float(rate))
        note = f"{NOTE}{'nothing' if label == 'null' else label}"
        teach(Path(path).read_bytes(), [one], note=note).write(Path(out))
    except (AdaptError, BundleError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
