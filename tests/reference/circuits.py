"""Ways to wire figure 4b, compared in ngspice: what one percent of a taxel is worth in counts.

python -m tests.reference.circuits                                               (needs ngspice)

The paper's figure shows one taxel, R_m, C_m and a converter; its text does not say where R_m is.
This compares what that may mean, with all 25 taxels and what is inside a converter.
"""

import sys
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from . import spice
from .spice import SUPPLY_V, Parts, Timeline

Array = NDArray[np.float64]

COUNT_V: Final = SUPPLY_V / 4096
SLOTS_S: Final = (0.0001, 0.0024)  # the driver's settling time, and a slot of the paper's scan
ROW, COLUMN = 2, 2

_TYPICAL: Final = Parts(
    taxels_pf=np.full((5, 5), 41.2),
    film_ohm=np.full(10, 1000.0),
    stray_pf=np.full(10, 18.0),
    row_pf=np.zeros(5),
    bleed_ohm=np.full(5, 50e6),
    leak_a=np.zeros(5),
    gate_pf=0.0,
)
_HUNDRED: Final = np.full(5, 100.0)
CIRCUITS: Final[dict[str, Parts]] = {
    "R_m in the drive": replace(_TYPICAL, place="drive"),
    "R_m in the drive, follower": replace(_TYPICAL, place="drive", buffered=True),
    "R_m before the converter": replace(_TYPICAL, place="input"),
    "R_m before the converter, follower": replace(_TYPICAL, place="input", buffered=True),
    "R_m to ground, C_m": replace(_TYPICAL, coupling_pf=1.0),
    "R_m to ground, C_m, follower": replace(_TYPICAL, coupling_pf=1.0, buffered=True),
    "R_m to ground, follower": replace(_TYPICAL, buffered=True),
    "R_m to ground": _TYPICAL,
    "R_m to ground, 100 pF (ours)": replace(_TYPICAL, row_pf=_HUNDRED),
}


def seen(parts: Parts, slot_s: float, before_v: float = 0.0) -> float:
    """Return what the converter samples of the middle taxel, volts."""
    line, rise = Timeline(), 50e-6
    for row in range(5):
        line.close(f"g{row}", 0.0, rise - 15e-6 if row == ROW else rise + slot_s + 50e-6)
    line.close(f"c{COLUMN}", rise, rise + slot_s + 50e-6)
    line.close(f"s{ROW}", rise + slot_s, rise + slot_s + spice.SAMPLE_S)
    circuit = spice.netlist(parts, line).replace(".ic v(adc)=0", f".ic v(adc)={before_v}")
    circuit += " uic" if before_v else ""
    times, volts = spice.run(circuit, ["adc"])
    return float(spice.at(times, volts, np.array([rise + slot_s + 3e-6]))[0, 0])


def changed(parts: Parts, row: int, column: int) -> Parts:
    """Return the circuit with one percent more of a taxel."""
    taxels = parts.taxels_pf.copy()
    taxels[row, column] *= 1.01
    return replace(parts, taxels_pf=taxels)


def worth(parts: Parts, slot_s: float) -> dict[str, float]:
    """Return counts: of the reading, and what each change adds to it."""
    rest = seen(parts, slot_s)
    cases = {
        "own": seen(changed(parts, ROW, COLUMN), slot_s),
        "row": seen(changed(parts, ROW, COLUMN - 1), slot_s),
        "column": seen(changed(parts, ROW - 1, COLUMN), slot_s),
        "leak": seen(replace(parts, leak_a=np.full(5, 1e-9)), slot_s),
        "last": seen(parts, slot_s, 0.5),
    }
    return {"rest": rest / COUNT_V} | {
        name: (volts - rest) / COUNT_V for name, volts in cases.items()
    }


def main() -> int:
    """Print the table of docs/hardware.md."""
    print("| circuit | slot | reads | own taxel +1 % | row | column | 1 nA | last reading +0.5 V |")
    print("|---|---|---|---|---|---|---|---|")
    for name, parts in CIRCUITS.items():
        for slot_s in SLOTS_S:
            w = worth(parts, slot_s)
            leak = f"{w['leak']:+.1f}" if w["leak"] < 4096 else "to the rail"
            print(
                f"| {name} | {slot_s * 1e3:g} ms | {w['rest']:.0f} | {w['own']:+.2f} | "
                f"{w['row']:+.2f} | {w['column']:+.2f} | {leak} | {w['last']:+.0f} |"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
