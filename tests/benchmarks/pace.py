"""Punctuality of the loop: lateness and missed frames while the other core is busy.

    python -m tests.benchmarks.pace [--minutes N] [--rate HZ] [--realtime] [--json]

The device's own loop with the shipped bundle, the recorded demo for a sensor, and a host on TCP
that listens; a second process computes all the time. Lateness is the ledger's `wait`. The
hypervisor's steal time, when it gave this machine's processors to others, is printed: no loop can
answer for that.
"""

import gc
import multiprocessing
import os
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle as bundles
from controller.bundles.inference.networks import Recognizer
from controller.links import open_link
from controller.recognition.images.frames import Frame
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader
from controller.runtime.device import Device
from controller.runtime.latency import LatencyReporter, LatencyStatistics
from controller.runtime.loop import Loop
from controller.sensors.base import Sensor
from controller.sensors.geometry import Geometry
from controller.shared.protocol.messages import DEADMAN_MS, HEARTBEAT_MS, VERSION, Welcome
from host.connection.receiver import Receiver
from host.connection.transport import open_transport

from .results import Results, command_line

DEMO: Final = Path(str(files("assets") / "demo.npz"))


class Recorded(Sensor):
    """A sensor that gives a recording's frames, over and over, without waiting."""

    device_id = "recorded"

    def __init__(self, geometry: Geometry, rate_hz: float) -> None:
        self.geometry, self.rate_hz = geometry, rate_hz
        self._frames: NDArray[np.float32] = np.array(reader.load(DEMO).frames)
        self._next = 0

    def read(self, t_s: float) -> Frame:
        self._next += 1
        frame: Frame = self._frames[self._next % len(self._frames)]
        return frame


class AllLines(LatencyStatistics):
    """A ledger that forgets nothing, for a run whose length is known."""

    def __init__(self, lines: int) -> None:
        super().__init__(lines=lines)

    def between_ms(self, first: int, last: int) -> NDArray[np.float64]:
        """Return the time of each frame from one stamp to another."""
        known = self._stamps[: self.lines]
        spent: NDArray[np.float64] = (known[:, last] - known[:, first]) / 1e6
        return spent


def toil(until_s: float) -> None:
    while time.time() < until_s:
        sum(range(10_000))


def listen(url: str, until_s: float) -> None:
    """Be a host that takes all that comes."""
    receiver = Receiver(lambda: open_transport(url))
    receiver.connect()
    while time.time() < until_s:
        receiver.wait(0.1)
        receiver.poll()
    receiver.close()


def steal_s() -> float:
    """Return how long all processors were taken away, seconds since the machine's start."""
    fields = Path("/proc/stat").read_text().splitlines()[0].split()
    return int(fields[8]) / os.sysconf("SC_CLK_TCK")


def measure(minutes: float, rate_hz: float, tell: Callable[[str], object]) -> tuple[AllLines, int]:
    """Return the ledger of a run, and how many frames it missed."""
    bundle = bundles.read(bundles.default_path())
    grid = Geometry(bundle.rows, bundle.columns, bundle.pitch_mm)
    welcome = Welcome(
        VERSION, 1, "recorded", "OrbTouch", False, grid.rows, grid.columns, grid.pitch_mm, rate_hz,
        HEARTBEAT_MS, DEADMAN_MS, bundle.labels, bundle.mapping.commands,
    )  # fmt: skip
    link = open_link("listen://127.0.0.1:0", welcome)
    end_s = time.time() + 60 * minutes
    context = multiprocessing.get_context("spawn")
    helpers = [
        context.Process(target=listen, args=(link.url, end_s), daemon=True),
        context.Process(target=toil, args=(end_s,), daemon=True),
    ]
    for helper in helpers:
        helper.start()
    gc.freeze()  # as the device does
    timekeeper = LatencyReporter(1 / rate_hz, lambda pace: link.send(pace, 0))
    timekeeper.statistics = ledger = AllLines(round(minutes * 60 * rate_hz) + 100)
    pipeline = Pipeline(bundle.settings, Recognizer(bundle), bundle.mapping)
    device = Device(Recorded(grid, rate_hz), pipeline, link, latency=timekeeper)
    loop = Loop(link, lambda: device, time.monotonic)
    tell(f"{minutes:g} minutes at {rate_hz:g} frames a second, one other process computing")
    loop.run(lambda: time.time() >= end_s)
    gc.unfreeze()
    link.close()
    for helper in helpers:
        helper.join()
    return ledger, loop.missed


def main() -> None:
    arguments = command_line(__doc__, minutes=10.0, rate=40.0, realtime=False).parse_args()
    if arguments.realtime:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    stolen = steal_s()
    ledger, missed = measure(arguments.minutes, arguments.rate, print)
    stolen = steal_s() - stolen
    results = Results("pace")
    for name, values in (("lateness", ledger.between_ms(0, 1)), ("step", ledger.between_ms(1, -1))):
        for share in (50.0, 99.0, 99.9, 100.0):
            results.note(f"{name}_p{share:g}_ms", float(np.percentile(values, share)), "ms")
    results.note("pace_frames", ledger.lines)
    results.note("pace_missed", missed, goal=0.0)
    results.note("steal_s", stolen, "s")
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
