"""Processes that record until they are killed."""

import contextlib
import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recognition.images.frames import Frame
from controller.recordings.recorder import SYNC_S, Recorder
from controller.recordings.recording import Provenance

RATE_HZ: Final = 100.0
AT_ONCE: Final = 10  # processes
LABELS: Final = ("null", "press", "pinch")
ORIGIN: Final = Provenance("benchmark", 5, 5, 10.0, RATE_HZ, LABELS, "", "", "")
FORK: Final = multiprocessing.get_context("fork")


def made(seed: int, number: int) -> Frame:
    """Return a frame of a seed, made from its number alone."""
    return np.random.default_rng((seed, number)).normal(41.2, 2.9, (5, 5)).astype(np.float32)


@dataclass
class Life:
    """A process, and what it had done when it was killed."""

    folder: Path
    seed: int
    span_s: float  # from its start, or from when it says `ready`, until it is killed
    waits: bool = False  # for `ready`
    added: Any = field(default_factory=lambda: FORK.Value("q", 0, lock=False))  # frames
    ready: Any = field(default_factory=FORK.Event)


def record(life: Life) -> None:
    """Record on an absolute schedule until killed."""
    recorder = Recorder(life.folder / "one.npz", ORIGIN, {})
    start = time.monotonic()
    for number in range(1, 1 << 40):
        time.sleep(max(0.0, start + number / RATE_HZ - time.monotonic()))
        _add(recorder, life.seed, number)
        life.added.value = number


def _add(recorder: Recorder, seed: int, number: int) -> None:
    t_s, label = number / RATE_HZ, number % len(LABELS)
    recorder.add(made(seed, number), t_s, number, label=label)


def seal(life: Life) -> None:
    """Record a lot at once and seal it; killed meanwhile."""
    recorder = Recorder(life.folder / "one.npz", ORIGIN, {})
    for number in range(1, 1001):
        _add(recorder, life.seed, number)
    time.sleep(2 * SYNC_S)  # then all is on the disk, and a crash may cost nothing
    life.added.value = 1000
    life.ready.set()
    recorder.close()


def kill(lives: list[Life], work: Callable[[Life], None], number: int = signal.SIGKILL) -> None:
    """Run the lives, some at once, and end each at its time with a signal."""
    step = 1 if any(life.waits for life in lives) else AT_ONCE
    for first in range(0, len(lives), step):
        running = []
        for life in lives[first : first + step]:
            process = FORK.Process(target=work, args=(life,), daemon=True)
            process.start()
            if life.waits:
                life.ready.wait(60.0)
            running.append((time.monotonic() + life.span_s, process))
        for end, process in sorted(running, key=lambda run: run[0]):
            time.sleep(max(0.0, end - time.monotonic()))
            with contextlib.suppress(ProcessLookupError):
                os.kill(process.pid or 0, number)
            process.join()
