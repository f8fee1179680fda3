"""Self-test of a bundle on this device: golden vectors, then a timed control step, by engine.

Each engine runs in its own process with a deadline, since a library built for another processor
ends its process instead of raising an error. `python -m controller.bundles.deploy.selftest FILE
ENGINE` is that process.
"""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle, BundleError
from controller.bundles.inference import engines
from controller.bundles.inference.networks import Recognizer
from controller.errors import one_line
from controller.recognition.pipeline import Pipeline

DEADLINE_S: Final = 60.0  # for one engine; a slow board needs some seconds for its import
STEPS: Final = 1000  # in a timed block
BLOCKS: Final = 5  # timed blocks, after one untimed block; the fastest one counts
EQUAL: Final = 1.1  # steps whose ratio is smaller are equally fast; then the start time decides


@dataclass(frozen=True, slots=True)
class SelfTestResult:
    """Measurements of one engine."""

    engine: str
    # median control step, from a frame to a gesture, of the fastest block, microseconds
    step_us: float = 0.0
    worst_us: float = 0.0  # 99th percentile of that block, microseconds
    problem: str = ""  # reason that the engine cannot be used; "" if it can
    # processor time from the start of a program to the end of the golden vectors
    start_ms: float = 0.0


def run(path: Path, names: Iterable[str] = engines.NAMES) -> list[SelfTestResult]:
    """Return the measurements of every engine with a bundle, the one to use first.

    That is the fastest engine, or, of equally fast ones, the one that starts soonest.

    Raises:
        BundleError: The bundle is damaged, or no engine can run it.
    """
    bundles.read(path)
    results = [_in_a_process(path, name) for name in names]
    usable = [result for result in results if not result.problem]
    if len(usable) > 1:  # a second run: other programs only ever make a run slower
        usable = [_better(result, _in_a_process(path, result.engine)) for result in usable]
    if not usable:
        raise BundleError("; ".join(dict.fromkeys(result.problem for result in results)))
    limit_us = EQUAL * min(result.step_us for result in usable)

    def rank(result: SelfTestResult) -> tuple[bool, float]:
        fast = result.step_us <= limit_us
        return not fast, result.start_ms if fast else result.step_us

    return sorted(usable, key=rank) + [result for result in results if result.problem]


def _better(one: SelfTestResult, other: SelfTestResult) -> SelfTestResult:
    """Return the better of two runs of an engine; the first one if the other failed."""
    if other.problem:
        return one
    fast = min(one, other, key=lambda result: result.step_us)
    return replace(fast, start_ms=min(one.start_ms, other.start_ms))


def _in_a_process(path: Path, engine: str) -> SelfTestResult:
    module = "controller.bundles.deploy.selftest"
    command = [sys.executable, "-m", module, str(path.resolve()), engine]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S)
        return SelfTestResult(**json.loads(done.stdout.splitlines()[-1]))
    except subprocess.TimeoutExpired:
        return SelfTestResult(engine, problem=f"{engine} did not answer within {DEADLINE_S:g} s")
    except (IndexError, ValueError, TypeError):
        return SelfTestResult(
            engine, problem=f"{engine} ended with status {done.returncode} on this device"
        )


def measure(
    bundle: Bundle,
    engine: str,
    clock_ns: Callable[[], int] = time.perf_counter_ns,
    spent_s: Callable[[], float] = time.process_time,
) -> SelfTestResult:
    """Check a bundle's golden vectors with one engine in this process, and time its control step.

    Args:
        bundle: The bundle.
        engine: One of `engines.NAMES`.
        clock_ns: Monotonic clock, nanoseconds.
        spent_s: Processor time since the start of the process.
    """
    try:
        pipeline = Pipeline(bundle.settings, Recognizer(bundle, engine), bundle.mapping)
    except BundleError as error:  # it may quote names in the networks
        return SelfTestResult(engine, problem=one_line(str(error)))
    start_ms = round(1000.0 * spent_s(), 1)
    ratio = bundle.preprocess.normalise == "ratio"
    rest, scale = (40.0, 40.0) if ratio else (0.0, bundle.preprocess.scale)
    noise = np.random.default_rng(0).normal(0.0, 0.01, (64, bundle.rows, bundle.columns))
    frames = (rest + noise * scale).astype(np.float32)
    pressed = frames + np.float32(0.2 * scale)
    quiet = round(2 * bundle.preprocess.start_s * bundle.rate_hz)
    times = np.empty((1 + BLOCKS) * STEPS)
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
    blocks = times[STEPS:].reshape(BLOCKS, STEPS) / 1000.0
    p50, p99 = np.percentile(blocks, [50, 99], axis=1).min(axis=1)
    return SelfTestResult(engine, round(float(p50), 1), round(float(p99), 1), start_ms=start_ms)


if __name__ == "__main__":
    _path, _engine = sys.argv[1:]
    print(json.dumps(asdict(measure(bundles.read(Path(_path)), _engine))))
