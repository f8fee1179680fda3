"""Duration of a scan on the emulated board.

    python -m tests.benchmarks.scan [--json]

15 us a change of a pin and 20 us around each conversion are guesses for a Raspberry Pi 4
(`controller --sensor orb` tells what a scan takes there); bits and waits are exact.
"""

from dataclasses import replace
from typing import Final, get_args

from controller.sensors.hardware import wiring as wirings
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.emulated.board import EmulatedBoard

from .results import Results, command_line

PAPER_MS: Final = 86.0  # of its whole cycle, section 5

_SMALL: Final = replace(wirings.Wiring(), pump=None, circuit=wirings.CircuitWiring())
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


def scan_ms(wiring: wirings.Wiring) -> float:
    """Return how long a scan takes on the emulated board."""
    bench = EmulatedBoard(wiring, seed=1)
    driver = Driver(bench.board)
    driver.frame()
    began = bench.circuit.now_s
    driver.scanner.scan()
    return (bench.circuit.now_s - began) * 1e3


def main() -> None:
    """Print the duration of a scan for each grid and scheme."""
    options, results = command_line(__doc__).parse_args(), Results("scan")
    for grid, wiring in GRIDS.items():
        for scheme in get_args(wirings.Scheme):
            took = scan_ms(replace(wiring, scheme=scheme))
            results.note(f"scan_ms_{grid}_{scheme}", took, "ms", goal=PAPER_MS)
            results.note(f"scan_hz_{grid}_{scheme}", 1e3 / took, "1/s")
    slow = replace(_SMALL, scheme="taxel", times=SLOW)
    results.note("scan_ms_5x5_papers_slots", scan_ms(slow), "ms", goal=PAPER_MS)
    results.finish(options.json)


if __name__ == "__main__":
    main()
