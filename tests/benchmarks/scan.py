"""Duration, error and noise of a scan.

python -m tests.benchmarks.scan [--json]

Times are the emulated board's: 15 us a change of a pin and 20 us around each conversion are guesses
for a Raspberry Pi 4 (`controller --sensor orb` tells what a scan takes there), bits and waits
exact; `python_ms` is what the driver's own Python costs here, where pins and bus do nothing.
Errors are the driver's against sixty orbs of ngspice, noise is that of one count a conversion.
"""

import time
from dataclasses import replace
from typing import Any, Final, get_args

import numpy as np

from controller.sensors.hardware import wiring as wirings
from controller.sensors.hardware.board import Board
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.emulated.board import EmulatedBoard
from controller.sensors.hardware.inversion import Inversion
from controller.sensors.hardware.wiring import CHIPS
from controller.shared.aliases import Array
from tests.reference import waveforms
from tests.support.waveform_board import board as recorded_board

from .results import Results, command_line

PAPER_MS: Final = 86.0  # of its whole cycle, section 5
FRAMES: Final = 16

_SMALL: Final = replace(wirings.Wiring(), pump=None, circuit=wirings.CircuitWiring(ghosting=0.0))
_LARGE: Final = replace(
    _SMALL,
    electrodes=wirings.Electrodes(
        (4, 5, 6, 12, 13, 16, 19, 20, 21, 26),
        (0, 1, 14, 15, 17, 18, 22, 23, 24, 25),
        (0, 1, 2, 3, 4, 8, 9, 10, 11, 12),
    ),
    converter=wirings.ConverterWiring(devices=(0, 1)),
    button=None,
    led=None,
)
GRIDS: Final = {"5x5": _SMALL, "10x10": _LARGE}
# The paper's slots: one conversion after a settling time of 2.4 ms, 25 of which fill 60 of 86 ms.
SLOW: Final = wirings.Times(settle_s=0.0024, samples=1)


class _Idle:
    """Pins, a bus and knobs that do nothing at once."""

    def drive(self, pin: int, high: bool) -> None:
        pass

    def release(self, pin: int) -> None:
        pass

    def transfer(self, data: bytes) -> bytes:
        return b"\0\7\0"

    def pump(self, on: bool) -> None:
        pass

    light = pump

    def close(self) -> None:
        pass


def scan_ms(wiring: wirings.Wiring) -> float:
    """Return how long a scan takes on the emulated board."""
    bench = EmulatedBoard(wiring, seed=1)
    driver = Driver(bench.board)
    driver.frame()
    began = bench.circuit.now_s
    driver.scanner.scan()
    return (bench.circuit.now_s - began) * 1e3


def python_ms(wiring: wirings.Wiring) -> float:
    """Return what the driver's own code costs, the median of many frames."""
    idle: Any = _Idle()
    chip = CHIPS[wiring.converter.type]
    buses = (idle,) * len(wiring.converter.devices)
    driver = Driver(Board(wiring, idle, chip, buses, idle, lambda _: None, time.perf_counter))
    inversion, spent = Inversion(wiring, 1 << chip.bits), []
    for _ in range(200):
        began = time.process_time()
        reading = driver.scanner.scan()
        inversion.picofarads(reading.counts, reading.age_s, np.zeros(wiring.rows))
        spent.append(time.process_time() - began)
    return float(np.median(spent)) * 1e3


def readings(scheme: wirings.Scheme, chip: str) -> tuple[Array, Array]:
    """Return the images' errors against ngspice, and the relative noise, (orbs, rows, columns)."""
    wiring = replace(_SMALL, scheme=scheme)
    wiring = replace(wiring, converter=replace(wiring.converter, type=chip))
    data, rng = np.load(waveforms.FILE), np.random.default_rng(1)
    error, noise = [], []
    for true, states in zip(data["picofarads"], data[scheme] * waveforms.STEP_V, strict=True):
        seen = []
        for held in states:
            driver = Driver(recorded_board(wiring, held, rng))
            frames = np.array([driver.frame() for _ in range(FRAMES)])
            seen.append(frames.mean(axis=0))
            noise.append(frames.std(axis=0, ddof=1) / frames.mean(axis=0))
        error.append(seen[1] / seen[0] - true[1] / true[0])
    return np.array(error), np.array(noise)


def measure(results: Results) -> None:
    """Measure and note everything."""
    for grid, wiring in GRIDS.items():
        for scheme in get_args(wirings.Scheme):
            one = replace(wiring, scheme=scheme)
            took, own = scan_ms(one), python_ms(one)
            results.note(f"scan_ms_{grid}_{scheme}", took, "ms", goal=PAPER_MS)
            results.note(f"scan_hz_{grid}_{scheme}", 1e3 / took, "1/s")
            results.note(f"python_ms_{grid}_{scheme}", own, "ms")
    slow = replace(_SMALL, scheme="taxel", times=SLOW)
    results.note("scan_ms_5x5_papers_slots", scan_ms(slow), "ms", goal=PAPER_MS)
    for chip in ("mcp3208", "mcp3008"):
        for scheme in get_args(wirings.Scheme):
            error, noise = readings(scheme, chip)
            each = np.sqrt(np.mean(error**2, axis=0))
            results.note(f"z_error_{scheme}@{chip}", float(np.sqrt(np.mean(error**2))), "1")
            results.note(f"z_error_worst_{scheme}@{chip}", float(np.abs(error).max()), "1")
            results.note(f"noise_{scheme}@{chip}", float(noise.mean()), "of C")
            if chip == "mcp3208":
                print(f"  error of z, per taxel, thousandths:\n{np.round(each * 1e3, 2)}")
                print(f"  noise, per taxel, thousandths:\n{np.round(noise.mean(axis=0) * 1e3, 2)}")


def main() -> None:
    options, results = command_line(__doc__).parse_args(), Results("scan")
    measure(results)
    results.finish(options.json)


if __name__ == "__main__":
    main()
