"""Waveforms at the converter of random orbs, by ngspice: test data for the driver.

python -m tests.reference.waveforms [--orbs 60] [--out tests/data/waveforms.npz]     (needs ngspice)

Each orb is scanned twice, at rest and touched, in both schemes and with C_m, with the switches in
the order and at the times that the driver has on emulated hardware. Kept is what is on the sampling
capacitor after each conversion.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.shared.aliases import Array

from . import spice
from .spice import SAMPLE_S, Parts, Timeline

FILE: Final = Path(__file__).parent.parent / "data" / "waveforms.npz"
SETS: Final = ("taxel", "column", "coupled")  # the schemes; and C_m, a follower, and "taxel"
SAMPLES: Final = 4
PIN_S: Final = 15e-6  # one change of a pin
TRANSFER_S: Final = 44e-6  # one conversion: 24 bits at 1 MHz, and 20 us around it
SETTLE_S: Final = 100e-6
DISCHARGE_S: Final = 100e-6
STEP_V: Final = 50e-6  # of what is kept: a sixteenth of a 12-bit count
_EARLY_S: Final = 5e-6  # a sample is taken this much before its conversion ends


@dataclass(frozen=True)
class Slot:
    """One charge, on the time of the whole scan."""

    column: int  # raised; -1 none
    rows: tuple[int, ...]  # that float, in the order of conversion
    rise_s: float  # when
    ends_s: Array  # when each conversion ends, (rows, samples)


def scan(rows: int, columns: int, scheme: str) -> tuple[Timeline, list[Slot]]:
    """Return the switches of one frame and of a dark one, and its slots."""
    line, slots, now = Timeline(), [], 0.0
    grounded = dict.fromkeys(range(rows), 0.0)  # row -> since when
    for column in (*range(columns), -1):
        groups = [tuple(range(rows))] if scheme == "column" else [(row,) for row in range(rows)]
        for group in groups:
            now += DISCHARGE_S
            for row in group:
                line.close(f"g{row}", grounded[row], now)
                now += PIN_S
            rise = now
            now += PIN_S + SETTLE_S
            ends = np.empty((len(group), SAMPLES))
            for k, row in enumerate(group):
                now += TRANSFER_S
                # The grounded input empties the converter.
                line.close("z", now - _EARLY_S - SAMPLE_S, now - _EARLY_S)
                for sample in range(SAMPLES):
                    now += TRANSFER_S
                    line.close(f"s{row}", now - _EARLY_S - SAMPLE_S, now - _EARLY_S)
                    ends[k, sample] = now
            if column >= 0:
                line.close(f"c{column}", rise, now)
            now += PIN_S
            for row in group:
                grounded[row] = now
                now += PIN_S
            slots.append(Slot(column, group, rise, ends))
    for row, since in grounded.items():
        line.close(f"g{row}", since, now + 1e-6)
    return line, slots


def held(parts: Parts, scheme: str) -> Array:
    """Return what each conversion sees, volts, (columns + 1, rows, samples); the last are dark."""
    line, slots = scan(parts.rows, parts.columns, scheme)
    if scheme == "coupled":
        parts = replace(parts, coupling_pf=1.0, buffered=True)
    times, volts = spice.run(spice.netlist(parts, line, 20e-6), ["adc"])
    out = np.empty((parts.columns + 1, parts.rows, SAMPLES))
    for slot in slots:
        for k, row in enumerate(slot.rows):
            out[slot.column, row] = spice.at(times, volts, slot.ends_s[k] - 2e-6)[:, 0]
    return out


def touched(rng: np.random.Generator, rows: int, columns: int) -> Array:
    """Return C / C0 of a random touch: a dent, and a bulge around it."""
    y, x = np.mgrid[:rows, :columns]
    image = np.ones((rows, columns))
    for _ in range(int(rng.integers(1, 4))):
        far = (x - rng.uniform(0, columns - 1)) ** 2 + (y - rng.uniform(0, rows - 1)) ** 2
        image -= rng.uniform(0.05, 0.45) * np.exp(-far / 1.3)
    return np.asarray(np.maximum(image * (1.0 + rng.uniform(0.0, 0.06)), 0.35))


def orbs(count: int) -> Iterator[dict[str, Array]]:
    """Yield the orbs: what they have, and what the converter sees."""
    rng = np.random.default_rng(2018)
    for _ in range(count):
        parts = spice.draw(rng)
        pressed = replace(parts, taxels_pf=parts.taxels_pf * touched(rng, 5, 5))
        row = {"picofarads": np.stack([parts.taxels_pf, pressed.taxels_pf])}
        for name in SETS:
            row[name] = np.stack([held(parts, name), held(pressed, name)])
        yield row


def main(argv: Sequence[str] | None = None) -> int:
    grammar = argparse.ArgumentParser(description=__doc__)
    grammar.add_argument("--orbs", type=int, default=60)
    grammar.add_argument("--out", type=Path, default=FILE)
    options = grammar.parse_args(argv)
    found = list(orbs(options.orbs))
    kept: dict[str, Any] = {
        name: np.rint(np.stack([one[name] for one in found]) / STEP_V).astype(np.int16)
        for name in SETS
    }
    kept["picofarads"] = np.stack([one["picofarads"] for one in found]).astype(np.float32)
    np.savez_compressed(options.out, **kept)
    print(f"{options.out}: {options.out.stat().st_size} bytes, {len(found)} orbs")
    return 0


if __name__ == "__main__":
    sys.exit(main())
