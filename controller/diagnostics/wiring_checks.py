"""Wiring checks from the measurements of a board; pure.

The checks run in the order of how much they explain, and what one explains is not reported again:
a row that touches ground has no taxels to complain of.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import Final

import numpy as np

from controller.diagnostics.measurements import LATE_S, Measurements
from controller.diagnostics.report import Row, Verdict, fault
from controller.simulator.dome.readout import NOMINAL_PF

_COUNTS: Final = 4096.0  # in which noise is given, whatever the converter

# The limits lie between what sound orbs of random tolerances and orbs with each fault show
# (tests/benchmarks/doctor.py).
HELD_SHARE: Final = 0.5  # of full scale: a row keeps its charge, .94, or does not
CLIPPED_SHARE: Final = 0.985  # a charged row at full scale: the reference is below the supply
LOW_SHARE: Final = 0.88  # ... or above it
DRIVEN_SHARE: Final = 0.5  # of full scale: a row stands at the supply although no pin drives it
LOST_SHARE: Final = 0.25  # of the middle taxel's capacitance
TOUCHING_SHARE: Final = 0.9  # of full scale: a taxel whose row gets the whole supply
BLEED_MOHM: Final = (30.0, 85.0)
ROW_PF: Final = 95.0
NOISE_COUNTS: Final = 85.0  # twice what the paper's own figures imply
LEAST_LOSS_S: Final = 2e-3  # a row that loses its charge faster has no sound resistor


class WiringChecks:
    """The verdict on one board.

    Attributes:
        faults: What is wrong, what explains most first.
        bad: Taxels that a fault explains, (rows, columns).
        capacitance: Mean of each taxel, (rows, columns), picofarads.
        scatter: Noise of one conversion of each row, (rows,), counts of 4096.
    """

    def __init__(self, measured: Measurements) -> None:
        """Run all checks."""
        self.faults: list[Row] = []
        self._m = measured
        rows, columns = measured.wiring.rows, measured.wiring.columns
        self.bad = np.zeros((rows, columns), dtype=np.bool_)
        self._bad_lines = {
            "row": np.zeros(rows, dtype=np.bool_),
            "column": np.zeros(columns, dtype=np.bool_),
        }
        self.capacitance = measured.picofarads.mean(axis=0)
        samples = np.sqrt(measured.wiring.times.samples)
        self.scatter = np.median(measured.shares.std(axis=0, ddof=1), axis=1) * samples * _COUNTS
        self._tau_s = measured.time_constants_s()
        self._unreliable = False  # levels, or what takes a quiet converter
        self._plug()
        self._converter()
        self._shorts()
        self._pins()
        self._noise()
        self._open()
        self._row_parts()
        self._dead()

    def sound(self) -> Iterator[Row]:
        """Yield rows on what was found to be good."""
        named = {row.name.split()[0] for row in self.faults}
        if "converter" not in named:
            yield Row("converter", Verdict.GOOD, f"{self._m.wiring.converter.type} answers")
        good = self.capacitance[~self.bad]
        if good.size and "membrane" not in named:
            words = f"{good.size} of {self.bad.size}: {good.mean():.1f} pF (SD {good.std():.1f})"
            yield Row("taxels", Verdict.GOOD, words)
        if "readings" not in named:
            words = f"scatter by {float(np.median(self.scatter)):.1f} counts of 4096"
            yield Row("readings", Verdict.GOOD, words)

    # --- reporting ----------------------------------------------------------------------------

    def _line(self, code: str, kind: str, i: int, *figures: object) -> None:
        """Report a fault of an electrode."""
        self.faults.append(fault(code, f"{kind} {i}", *figures))
        self._explain(kind, i)

    def _taxel(self, code: str, row: int, column: int, *figures: object) -> None:
        """Report a fault of a taxel."""
        self.faults.append(fault(code, f"taxel ({row},{column})", *figures))
        self.bad[row, column] = True

    def _explain(self, kind: str, i: int) -> None:
        """Mark an electrode and its taxels as explained."""
        self._bad_lines[kind][i] = True
        (self.bad if kind == "row" else self.bad.T)[i] = True

    def _left(self, kind: str) -> list[int]:
        """Return the electrodes that no fault explains yet."""
        return np.flatnonzero(~self._bad_lines[kind]).tolist()

    # --- the checks, in order -------------------------------------------------------------------

    def _plug(self) -> None:
        middle = float(np.median(self.capacitance))
        holds = float(np.median(np.diag(self._m.held)))
        if middle < LOST_SHARE * NOMINAL_PF and holds > HELD_SHARE:
            self.faults.append(fault("unplugged", "membrane", f"{middle:.1f}"))
            self.bad[:] = self._bad_lines["row"][:] = self._bad_lines["column"][:] = True

    def _converter(self) -> None:
        m = self._m
        totals = np.rint(m.shares * m.wiring.times.samples / m.step)
        if m.step < 1 / 1024 and totals.any() and not (totals % 4).any():
            self.faults.append(fault("other_converter", "converter"))
        level = float(np.median(np.diag(m.held))) / m.wiring.circuit.reach
        clipped = level >= CLIPPED_SHARE and np.median(m.dark) < DRIVEN_SHARE
        if clipped or (HELD_SHARE < level < LOW_SHARE and self._left("row")):
            self.faults.append(fault("reference", "converter", f"{level:.2f} of full scale"))
            self._unreliable = True

    def _shorts(self) -> None:
        m = self._m
        held, low = m.held > HELD_SHARE, m.dark < DRIVEN_SHARE
        swapped = held & held.T & (np.diag(m.held) < HELD_SHARE)[:, None]
        high = m.row_touch > HELD_SHARE
        touch = {
            "row": high & high.T & low & low[:, None],
            "column": m.column_touch & m.column_touch.T,
        }
        for kind, touching in touch.items():
            for i, k in combinations(range(len(touching)), 2):
                if kind == "row" and swapped[i, k]:
                    self._line("swapped_channels", kind, i, f"row {k}")
                    self._line("swapped_channels", kind, k, f"row {i}")
                elif touching[i, k]:
                    self._line("short", kind, i, f"{kind} {k}")
                    self._explain(kind, k)
        for row in self._left("row"):
            share = m.shares[:, row].mean(axis=0)
            touching = share.max() > TOUCHING_SHARE and np.median(share) < 1 - TOUCHING_SHARE
            if low[row] and touching:
                column = int(share.argmax())
                self._taxel("short_taxel", row, column)
                self._explain("row", row)
                self._explain("column", column)

    def _pins(self) -> None:
        m = self._m
        for row in self._left("row"):
            if m.dark[row] > DRIVEN_SHARE:
                self._line("stuck", "row", row)
            elif m.held[row, row] < HELD_SHARE / 5:
                self._line("no_channel" if m.held_level[row] else "stuck", "row", row)
        for column in self._left("column"):
            if not (m.column_low[column] and m.column_high[column]):
                self._line("stuck", "column", column)

    def _noise(self) -> None:
        free = ~self._bad_lines["row"]
        middle = float(np.median(self.scatter[free])) if free.any() else 0.0
        if middle > NOISE_COUNTS and not self.faults:
            self.faults.append(fault("noise", "readings", f"{middle:.0f}"))
            self._unreliable = True

    def _open(self) -> None:
        good = self.capacitance[~self.bad]
        if not good.size:
            return
        middle = float(np.median(good))
        low = self.capacitance < LOST_SHARE * middle
        for kind, lost, taxels, charges in (
            ("row", low, self.capacitance, self._tau_s > LEAST_LOSS_S),
            ("column", low.T, self.capacitance.T, np.ones(low.shape[1], dtype=np.bool_)),
        ):
            across = ~self._bad_lines["column" if kind == "row" else "row"]
            for i in self._left(kind):
                if across.sum() > 1 and lost[i, across].all() and charges[i]:
                    mean = f"{taxels[i].mean():.1f}"
                    self._line("open", kind, i, mean, f"{middle:.0f}")

    def _row_parts(self) -> None:
        for row in () if self._unreliable else self._left("row"):
            there = self.capacitance[row] > LOST_SHARE * np.median(self.capacitance[row])
            taxels_pf = NOMINAL_PF * float(there.sum())
            share = float(np.clip(self._m.shares[:, row].mean(axis=0).sum(), 0.01, 0.99))
            ground_pf = taxels_pf * (1.0 - share) / share  # if its taxels are as usual
            usual_pf = float(np.clip(ground_pf, 40.0, 600.0))
            if self._tau_s[row] < LATE_S / 2:  # then its share is spoilt by the loss, too
                usual_pf = self._m.wiring.circuit.row_pf
            bleed_mohm = float(self._tau_s[row]) * 1e6 / (taxels_pf + usual_pf)
            if not BLEED_MOHM[0] < bleed_mohm < BLEED_MOHM[1]:
                self._line("bleed", "row", row, f"{min(bleed_mohm, 999.0):.2g}")
            elif ground_pf < ROW_PF:
                self._line("no_row_capacitor", "row", row, f"{ground_pf:.0f}")

    def _dead(self) -> None:
        good = self.capacitance[~self.bad]
        for row, column in np.argwhere(~self.bad).tolist():
            if self.capacitance[row, column] < LOST_SHARE * np.median(good):
                figures = f"{self.capacitance[row, column]:.1f}", f"{np.median(good):.0f}"
                self._taxel("dead", row, column, *figures)


def judge(measured: Measurements | Row) -> list[Row]:
    """Return what is wrong with a board, what explains most first; [] where nothing is."""
    return [measured] if isinstance(measured, Row) else WiringChecks(measured).faults
