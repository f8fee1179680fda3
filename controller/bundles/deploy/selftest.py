"""Self-test of a bundle on this device: golden vectors, then a timed control step.

It runs in its own process with a deadline, since a library built for another processor ends its
process instead of raising an error. `python -m controller.bundles.deploy.selftest FILE BLOCKS` is
that process.
"""

import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.container import BundleError
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.shared.errors import one_line
from controller.shared.notices import notice

DEADLINE_S: Final = 60.0  # a slow board needs some seconds for the import
STEPS: Final = 1000  # in a timed block
BLOCKS: Final = 10  # timed blocks, after one untimed block; the fastest one counts
FEW_BLOCKS: Final = 1  # of a bundle that was changed while it is in use


@dataclass(frozen=True, slots=True)
class SelfTestResult:
    """Measurements of a bundle's control step, from a frame to a gesture."""

    step_us: float = 0.0  # median of the fastest block, microseconds
    worst_us: float = 0.0  # 99th percentile of that block, microseconds
    problem: str = ""  # reason that the bundle cannot be used; "" if it can
    engine: str = ""  # name and version of what ran its networks


def run(path: Path, blocks: int = BLOCKS) -> SelfTestResult:
    """Return the measurements of a bundle; BundleError if it cannot be used here."""
    bundles.read(path)
    module = "controller.bundles.deploy.selftest"
    command = [sys.executable, "-m", module, str(path.resolve()), str(blocks)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S)
        result = SelfTestResult(**json.loads(done.stdout.splitlines()[-1]))
    except subprocess.TimeoutExpired:
        raise BundleError(notice("hangs", DEADLINE_S)) from None
    except (IndexError, ValueError, TypeError):
        raise BundleError(notice("crashes", done.returncode)) from None
    if result.problem:
        raise BundleError(result.problem)
    return result


def measure(
    bundle: Bundle, clock_ns: Callable[[], int] = time.perf_counter_ns, blocks: int = BLOCKS
) -> SelfTestResult:
    """Check golden vectors in this process, and time the control step in blocks, if any."""
    try:
        recognizer = Recognizer(bundle)
    except BundleError as error:  # it may quote names in the networks
        return SelfTestResult(problem=one_line(str(error)))
    if not blocks:
        return SelfTestResult(engine=recognizer.engine)
    pipeline = Pipeline(bundle.settings, recognizer, bundle.mapping)
    ratio = bundle.preprocess.normalise == "ratio"
    rest, scale = (40.0, 40.0) if ratio else (0.0, bundle.preprocess.scale)
    noise = np.random.default_rng(0).normal(0.0, 0.01, (64, bundle.rows, bundle.columns))
    frames = (rest + noise * scale).astype(np.float32)
    pressed = frames + np.float32(0.2 * scale)
    quiet = round(2 * bundle.preprocess.start_s * bundle.rate_hz)
    times = np.empty((1 + blocks) * STEPS)
    for number in range(quiet):  # the baseline is found
        pipeline.step(frames[number % len(frames)], number / bundle.rate_hz)
    for number in range(len(times)):
        # A touch every other second, so that both networks run.
        touched = int(number / bundle.rate_hz) % 2
        frame = (pressed if touched else frames)[number % len(frames)]
        start = clock_ns()
        pipeline.step(frame, (quiet + number) / bundle.rate_hz)
        times[number] = clock_ns() - start
        pipeline.check_health()  # when the gesture is out
    steps = times[STEPS:].reshape(blocks, STEPS) / 1000.0
    p50, p99 = np.percentile(steps, [50, 99], axis=1).min(axis=1)
    return SelfTestResult(round(float(p50), 1), round(float(p99), 1), "", recognizer.engine)


if __name__ == "__main__":
    _path, _blocks = sys.argv[1:]
    _result = measure(bundles.read(Path(_path)), blocks=int(_blocks))
    print(json.dumps(asdict(_result)))
