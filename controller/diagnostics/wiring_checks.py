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
_HELD: Final = 0.5  # of full scale: a row keeps its charge, .94, or does not
_CLIPPED: Final = 0.985  # a charged row at full scale: the reference is below the supply
_LOW: Final = 0.88
_UP: Final = 0.5  # a row that no pin drives stands at the supply
_LOST: Final = 0.25  # of the middle taxel's capacitance
_FULL: Final = 0.9  # a taxel whose row gets the whole supply
_GROWS: Final = 1.3  # late by early
_CONDUCTS: Final = 0.15  # of full scale, late: sound taxels read .08
_DAMP: Final = 0.03  # of full scale after 4 ms; leaks of 1 nA (SD) make 0.01
_BLEED_MOHM: Final = (30.0, 85.0)
_ROW_PF: Final = 95.0
_NOISE: Final = 85.0  # counts: twice what the paper's own figures imply
_BUSY: Final = 0.8  # of a frame
_TELLING: Final = 30  # conversions that tell bits which never change
_LOSES_S: Final = 2e-3  # a row that loses its charge faster has no sound resistor
_FILLS_S: Final = 20e-3  # a row whose film fills slowly seems to lose it faster than so


class WiringChecks:
    """The verdict on one board.

    Attributes:
        faults: What is wrong, what explains most first.
        bad: Taxels that a fault explains, (rows, columns).
        capacitance: Mean of each taxel, (rows, columns), picofarads.
        scatter: Noise of one conversion of each row, (rows,), counts of 4096.
    """

    def __init__(self, measured: Measurements, rate_hz: float) -> None:
        """Run all checks, for so many scans per second."""
        self.faults: list[Row] = []
        self._m = measured
        rows, columns = measured.wiring.rows, measured.wiring.columns
        self.bad = np.zeros((rows, columns), dtype=np.bool_)
        self._bad_lines = {
            "row": np.zeros(rows, dtype=np.bool_),
            "column": np.zeros(columns, dtype=np.bool_),
        }
        self.capacitance = measured.picofarads.mean(axis=0)
        self._most = np.maximum(measured.late, self.capacitance)
        self._growth = np.maximum(measured.late, 0.5) / np.maximum(self.capacitance, 0.5)
        samples = np.sqrt(measured.wiring.times.samples)
        self.scatter = np.median(measured.shares.std(axis=0, ddof=1), axis=1) * samples * _COUNTS
        self._tau_s = measured.time_constants_s()
        self._reference_off = False  # levels are not to be trusted
        self._loud = False  # nor is what takes a quiet converter
        if measured.scan_s > _BUSY / rate_hz:  # what is read that late says nothing of the leads
            scan_ms, frame_ms = 1e3 * measured.scan_s, 1e3 / rate_hz
            words = f"a scan takes {scan_ms:.0f} of the frame's {frame_ms:.0f} ms"
            self._add("slow", "scan", words)
            return
        for check in (
            self._bits,
            self._plug,
            self._converter,
            self._shorts,
            self._pins,
            self._noise,
            self._open,
            self._leaks,
            self._row_parts,
            self._dead,
        ):
            check()

    def sound(self) -> Iterator[Row]:
        """Yield rows on what was found to be good."""
        named = {row.name.split()[0] for row in self.faults}
        if "converter" not in named:
            yield Row("converter", Verdict.GOOD, f"{self._m.wiring.converter.type} answers")
        good = self.capacitance[~self.bad]
        if good.size and not {"membrane", "scan"} & named:
            words = f"{good.size} of {self.bad.size}: {good.mean():.1f} pF (SD {good.std():.1f})"
            yield Row("taxels", Verdict.GOOD, words)
        if "readings" not in named:
            words = f"scatter by {float(np.median(self.scatter)):.1f} counts of 4096"
            yield Row("readings", Verdict.GOOD, words)

    # --- reporting ----------------------------------------------------------------------------

    def _add(self, code: str, name: str, *figures: object) -> None:
        """Report a fault."""
        self.faults.append(fault(code, name, *figures))

    def _line(self, code: str, kind: str, i: int, *figures: object) -> None:
        """Report a fault of an electrode."""
        self._add(code, f"{kind} {i}", *figures)
        self._explain(kind, i)

    def _taxel(self, code: str, row: int, column: int, *figures: object) -> None:
        """Report a fault of a taxel."""
        self._add(code, f"taxel ({row},{column})", *figures)
        self.bad[row, column] = True

    def _explain(self, kind: str, i: int) -> None:
        """Mark an electrode and its taxels as explained."""
        self._bad_lines[kind][i] = True
        (self.bad if kind == "row" else self.bad.T)[i] = True

    def _left(self, kind: str) -> list[int]:
        """Return the electrodes that no fault explains yet."""
        return np.flatnonzero(~self._bad_lines[kind]).tolist()

    # --- the checks, in order -------------------------------------------------------------------

    def _bits(self) -> None:
        full, values = 1.0 / self._m.step, self._m.values
        counts = values[(values > 0) & (values < full - 1)].astype(np.int64)
        if len(counts) >= _TELLING and full > 1024 and not (counts & 3).any():
            self._add("other_converter", "converter")

    def _plug(self) -> None:
        holds = np.diag(self._m.held) > _HELD
        nothing = np.median(self._most) < _LOST * NOMINAL_PF and holds.mean() > 0.5
        if nothing and _LOSES_S < np.median(self._tau_s) < _FILLS_S / 2:
            self._add("unplugged", "membrane", f"{np.median(self.capacitance):.1f}")
            for row in self._left("row"):
                self._explain("row", row)
            self._bad_lines["column"][:] = True

    def _converter(self) -> None:
        m = self._m
        level = float(np.median(np.diag(m.held))) / m.wiring.circuit.reach
        clipped = level >= _CLIPPED and np.median(m.dark) < _UP
        if clipped or (_HELD < level < _LOW and self._left("row")):
            self._add("reference", "converter", f"{level:.2f} of full scale")
            self._reference_off = True

    def _shorts(self) -> None:
        m = self._m
        held, low = m.held > _HELD, m.dark < _UP
        swapped = held & held.T & (np.diag(m.held) < _HELD)[:, None]
        high = m.row_touch > _HELD
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
                    self._line(f"short_{kind}s", kind, i, f"{kind} {k}")
                    self._explain(kind, k)
        for row in self._left("row"):
            share = m.shares[:, row].mean(axis=0)
            if low[row] and share.max() > _FULL and np.median(share) < 1 - _FULL:
                column = int(share.argmax())
                self._taxel("short_taxel", row, column)
                self._explain("row", row)
                self._explain("column", column)

    def _pins(self) -> None:
        m = self._m
        for row in self._left("row"):
            if m.dark[row] > _UP:
                self._line("high_row", "row", row, f"{m.dark[row]:.2f}")
            elif m.held[row, row] < _HELD / 5:
                charged = m.shares[:, row].mean(axis=0).sum() > 0.05
                other = "dead_row_pin" if charged else "grounded_row"
                self._line("no_channel" if m.held_level[row] else other, "row", row)
        for column in self._left("column"):
            if not m.column_low[column]:
                self._line("high_column", "column", column)
            elif not m.column_high[column]:
                self._line("grounded_column", "column", column)

    def _noise(self) -> None:
        free = ~self._bad_lines["row"]
        middle = float(np.median(self.scatter[free])) if free.any() else 0.0
        if middle > _NOISE and not self.faults:
            self._add("noise", "readings", f"{middle:.0f}")
            self._loud = True

    def _open(self) -> None:
        good = self.capacitance[~self.bad]
        if not good.size:
            return
        middle = float(np.median(good))
        low = self._most < _LOST * middle
        for kind, lost, taxels, charges in (
            ("row", low, self.capacitance, self._tau_s > _LOSES_S),
            ("column", low.T, self.capacitance.T, np.ones(low.shape[1], dtype=np.bool_)),
        ):
            across = ~self._bad_lines["column" if kind == "row" else "row"]
            for i in self._left(kind):
                if across.sum() > 1 and lost[i, across].all() and charges[i]:
                    mean = f"{taxels[i].mean():.1f}"
                    self._line(f"open_{kind}", kind, i, mean, f"{middle:.0f}")

    def _leaks(self) -> None:
        for row in () if self._loud else self._left("row"):
            free = ~self.bad[row]
            if not free.any():
                continue
            growth = self._growth[row] / np.median(self._growth[row, free])
            conducts = free & (growth > _GROWS) & (self._m.late_shares[row] > _CONDUCTS)
            if free.sum() > conducts.sum() > 0:
                for column in np.flatnonzero(conducts).tolist():
                    self._taxel("leaky", row, column, f"{growth[column]:.1f}")
                self._bad_lines["row"][row] = True  # what leaks there is no resistor's fault

    def _row_parts(self) -> None:
        m = self._m
        for row in () if self._reference_off or self._loud else self._left("row"):
            ground_pf, bleed_mohm = self._row_pf(row), self._bleed_mohm(row)
            # Counts are never below zero, so noise alone reads as some charge.
            if m.dark_late[row] > _DAMP + 0.8 * self.scatter[row] / _COUNTS:
                self._line("damp", "row", row, f"{m.dark_late[row]:.2f}")
            elif bleed_mohm >= _BLEED_MOHM[1]:
                self._line("no_bleed", "row", row, f"{100 * m.held_late[row]:.0f} % after 4 ms")
            elif bleed_mohm <= _BLEED_MOHM[0]:
                self._line("small_bleed", "row", row, f"{bleed_mohm:.2g}")
            elif ground_pf < _ROW_PF:
                self._line("no_row_capacitor", "row", row, f"{ground_pf:.0f}")

    def _dead(self) -> None:
        good = self.capacitance[~self.bad]
        for row, column in np.argwhere(~self.bad).tolist():
            if self.capacitance[row, column] < _LOST * np.median(good):
                figures = f"{self.capacitance[row, column]:.1f}", f"{np.median(good):.0f}"
                self._taxel("dead", row, column, *figures)

    # --- figures ------------------------------------------------------------------------------

    def _taxels_pf(self, row: int) -> float:
        """Return the usual sum of a row's taxels, pF, as many as there are."""
        there = self.capacitance[row] > _LOST * np.median(self.capacitance[row])
        return NOMINAL_PF * float(there.sum())

    def _row_pf(self, row: int) -> float:
        """Return a row's capacitance to ground, pF, if its taxels are as usual."""
        share = float(np.clip(self._m.shares[:, row].mean(axis=0).sum(), 0.01, 0.99))
        return self._taxels_pf(row) * (1.0 - share) / share

    def _bleed_mohm(self, row: int) -> float:
        """Return a row's resistor, megohms, from what it keeps and its usual capacitance."""
        ground_pf = float(np.clip(self._row_pf(row), 40.0, 600.0))
        if self._tau_s[row] < LATE_S / 2:  # then its share is spoilt by the loss, too
            ground_pf = self._m.wiring.circuit.row_pf
        return float(self._tau_s[row]) * 1e6 / (self._taxels_pf(row) + ground_pf)


def judge(measured: Measurements | Row, rate_hz: float) -> list[Row]:
    """Return what is wrong with a board, what explains most first; [] where nothing is."""
    if isinstance(measured, Row):
        return [measured]
    return WiringChecks(measured, rate_hz).faults
