"""Wiring checks from the measurements of a board; pure.

The checks run in the order of how much they explain, and what one explains is not reported again:
a row that touches ground has no taxels to complain of.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.measurements import LATE_S, Measurements, UnresponsiveBoard
from controller.diagnostics.messages import fault
from controller.diagnostics.report import Row, Verdict
from controller.sensors.hardware import schedule

Flags = NDArray[np.bool_]

TAXEL_PF: Final = 41.2  # mean of the taxels: paper, section 3.2
_COUNTS: Final = 4096.0  # in which noise is given, whatever the converter

# The limits lie between what 1,000 sound orbs of random tolerances and 50 of each fault show
# (tests/benchmarks/doctor.py).
_HELD: Final = 0.5  # of full scale: a row keeps its charge, .94, or does not
_CLIPPED: Final = 0.985  # a charged row at full scale: the reference is below the supply
_LOW: Final = 0.88
_UP: Final = 0.5  # a row that no pin drives stands at the supply
_AT_SUPPLY: Final = 0.965
_LOST: Final = 0.25  # of the middle taxel's capacitance
_FULL: Final = 0.9  # a taxel whose row gets the whole supply
_GROWS: Final = 1.3  # late by early
_CONDUCTS: Final = 0.15  # of full scale, late: sound taxels read .08
_OUTLIER: Final = 12.0  # times the usual deviation: eight standard deviations
_SETTLING: Final = 3  # scans until a film that fills slowly has forgotten what was before
_OUTLIERS: Final = 0.005  # of all readings
_DAMP: Final = 0.03  # of full scale after 4 ms; leaks of 1 nA (SD) make 0.01
_BLEED_MOHM: Final = (30.0, 85.0)
_ROW_PF: Final = (95.0, 240.0)
_NOISY: Final = 2.2  # times the middle row
_NOISE: Final = 85.0  # counts: twice what the paper's own figures imply
_HUM: Final = 0.015  # of the reading
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
        """Run all checks.

        Args:
            measured: What was measured.
            rate_hz: Scans per second that are wanted.
        """
        self.faults: list[Row] = []
        self._m, self._rate_hz = measured, rate_hz
        rows, columns = measured.wiring.rows, measured.wiring.columns
        self.bad = np.zeros((rows, columns), dtype=np.bool_)
        self._bad_lines: dict[str, Flags] = {
            "row": np.zeros(rows, dtype=np.bool_), "column": np.zeros(columns, dtype=np.bool_)
        }  # fmt: skip
        self.capacitance = measured.picofarads.mean(axis=0)
        self._growth = np.maximum(measured.late, 0.5) / np.maximum(self.capacitance, 0.5)
        samples = np.sqrt(measured.wiring.times.samples)
        self.scatter = np.median(measured.shares.std(axis=0, ddof=1), axis=1) * samples * _COUNTS
        self._tau_s = measured.time_constants_s()
        self._reference_off = False  # levels are not to be trusted
        self._loud = False  # figures that take a quiet converter are not to be trusted
        self._speed()
        if self.faults:
            return  # what is read that late says nothing of the leads
        for check in (
            self._bits, self._hums, self._plug, self._converter, self._shorts, self._pins,
            self._noise, self._open, self._worn, self._leaks,
            self._row_parts, self._dead,
        ):  # fmt: skip
            check()

    def sound(self) -> Iterator[Row]:
        """Yield rows on what was found to be good."""
        named = {row.name.split()[0] for row in self.faults}
        rows, columns = self.bad.shape
        if "converter" not in named:
            yield Row("converter", Verdict.GOOD, f"{self._m.wiring.converter.type} answers")
        if not {"row", "column", "membrane"} & named:
            yield Row("electrodes", Verdict.GOOD, f"{rows} rows, {columns} columns")
        good = self.capacitance[~self.bad]
        if good.size and "membrane" not in named:
            spread = f"{good.mean():.1f} pF (SD {good.std():.1f})"
            yield Row("taxels", Verdict.GOOD, f"{good.size} of {self.bad.size}: {spread}")
        if "readings" not in named:
            middle = float(np.median(self.scatter))
            yield Row("readings", Verdict.GOOD, f"scatter by {middle:.1f} counts of 4096")
        if "scan" not in named:
            found = f"a conversion takes {1e6 * self._m.conversion_s:.0f} us"
            yield Row("clock", Verdict.GOOD, found)

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
        return _where(~self._bad_lines[kind])

    # --- the checks, in order -------------------------------------------------------------------

    def _speed(self) -> None:
        m = self._m
        frame_s = schedule.frame_s(m.wiring, m.conversion_s / 3, m.conversion_s)
        if frame_s > _BUSY / self._rate_hz:
            words = (
                f"a conversion takes {1e6 * m.conversion_s:.0f} us, so a scan takes "
                f"{1e3 * frame_s:.0f} of the frame's {1e3 / self._rate_hz:.0f} ms"
            )
            self._add("slow", "scan", words)

    def _bits(self) -> None:
        m = self._m
        values = m.values[(m.values > 0) & (m.values < 1.0 / m.step - 1)].astype(np.int64)
        bits = round(np.log2(1.0 / m.step))
        if len(values) >= _TELLING and bits > 10 and not (values & 3).any():
            self._add("other_converter", "converter")
            return
        for bit in range(bits - 2):
            telling = values[values >= 4 << bit] >> bit & 1
            if len(telling) >= _TELLING and telling.min() == telling.max():
                self._add("stuck_bit", "converter", bit)
                self._reference_off = True
                return

    def _hums(self) -> None:
        if self.faults:
            return
        hum, hertz, sure = self._m.hum()
        if hum > _HUM and sure:
            self._add("mains", "readings", f"{100 * hum:.0f}", f"{hertz:.0f}")
            self._reference_off = True

    def _plug(self) -> None:
        m, most = self._m, np.maximum(self._m.late, self.capacitance)
        holds = np.diag(m.held) > _HELD
        nothing = np.median(most) < _LOST * TAXEL_PF and holds.sum() > len(holds) / 2
        if nothing and _LOSES_S < np.median(self._tau_s) < _FILLS_S / 2:
            self._add("unplugged", "membrane", f"{np.median(self.capacitance):.1f}")
            for kind, lines in self._bad_lines.items():
                for i in range(len(lines)):
                    self._explain(kind, i)

    def _converter(self) -> None:
        m = self._m
        shares = m.shares[_SETTLING:]
        away = np.abs(shares - np.median(shares, axis=0))
        jumps = away > _OUTLIER * np.maximum(np.median(away, axis=0), m.step / 4)
        if jumps.mean() > _OUTLIERS and jumps.any(axis=(0, 2)).mean() > 0.5:
            self._add("bit_errors", "converter", f"{100 * jumps.mean():.1f}")
            self._reference_off = True
        if self._reference_off:
            return
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
        touch: dict[str, Flags] = {
            "row": high & high.T & low & low[:, None], "column": m.column_touch & m.column_touch.T
        }  # fmt: skip
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
                high = min(m.prompt[row], m.dark[row]) > _AT_SUPPLY
                self._line("high_row" if high else "pull_up", "row", row, f"{m.dark[row]:.2f}")
            elif m.held[row, row] < _HELD / 5:
                charged = m.shares[:, row].mean(axis=0).sum() > 0.05
                other = "dead_row_pin" if charged else "grounded_row"
                self._line("no_channel" if m.held_level[row] else other, "row", row)
        for column in self._left("column"):
            if not self._m.column_low[column]:
                self._line("high_column", "column", column)
            elif not self._m.column_high[column]:
                self._line("grounded_column", "column", column)

    def _noise(self) -> None:
        free = ~self._bad_lines["row"]
        if not free.any():
            return
        middle = float(np.median(self.scatter[free]))
        for row in () if self._reference_off else self._left("row"):
            if self.scatter[row] > _NOISY * max(middle, 1.0) + 2.0:
                self._line("noisy", "row", row, f"{self.scatter[row]:.0f}", f"{middle:.0f}")
        if middle > _NOISE and not self.faults:
            self._add("noise", "readings", f"{middle:.0f}")
            self._loud = True

    def _open(self) -> None:
        good = self.capacitance[~self.bad]
        if not good.size:
            return
        middle = float(np.median(good))
        low = np.maximum(self._m.late, self.capacitance) < _LOST * middle
        for kind, lost, taxels, charges in (
            ("row", low, self.capacitance, self._tau_s > _LOSES_S),
            ("column", low.T, self.capacitance.T, np.ones(low.shape[1], dtype=np.bool_)),
        ):
            across = ~self._bad_lines["column" if kind == "row" else "row"]
            for i in self._left(kind):
                if across.sum() > 1 and lost[i, across].all() and charges[i]:
                    mean = f"{taxels[i].mean():.1f}"
                    self._line(f"open_{kind}", kind, i, mean, f"{middle:.0f}")

    def _worn(self) -> None:
        if self._loud:
            return
        grows = (self._growth > _GROWS) & ~self.bad
        for kind, slow, growth, fades in (
            # A missing resistor or a long lead lets all of a row grow; but then its charge stays.
            ("row", grows, self._growth, self._tau_s < _FILLS_S),
            ("column", grows.T, self._growth.T, np.ones(grows.shape[1], dtype=np.bool_)),
        ):
            for i in self._left(kind):
                free = ~(self.bad if kind == "row" else self.bad.T)[i]
                if free.sum() > 1 and slow[i, free].all() and fades[i]:
                    self._line(f"weak_{kind}", kind, i, f"{np.median(growth[i, free]):.1f}")

    def _leaks(self) -> None:
        if self._loud:
            return
        for row in self._left("row"):
            free = ~self.bad[row]
            if not free.any():
                continue
            growth = self._growth[row] / np.median(self._growth[row, free])
            conducts = free & (growth > _GROWS) & (self._m.late_shares[row] > _CONDUCTS)
            if free.sum() > conducts.sum():
                for column in _where(conducts):
                    self._taxel("leaky", row, column, f"{growth[column]:.1f}")
            if (self.bad[row] & free).any():
                self._bad_lines["row"][row] = True  # what leaks there is no resistor's fault

    def _row_parts(self) -> None:
        if self._reference_off or self._loud:
            return
        m = self._m
        for row in self._left("row"):
            ground_pf, bleed_mohm = self._row_pf(row), self._bleed_mohm(row)
            # Counts are never below zero, so noise alone reads as some charge.
            if m.dark_late[row] > _DAMP + 0.8 * self.scatter[row] / _COUNTS:
                self._line("damp", "row", row, f"{m.dark_late[row]:.2f}")
            elif bleed_mohm >= _BLEED_MOHM[1]:
                self._line("no_bleed", "row", row, f"{100 * m.held_late[row]:.0f} % after 4 ms")
            elif bleed_mohm <= _BLEED_MOHM[0]:
                self._line("small_bleed", "row", row, f"{bleed_mohm:.2g}")
            elif not _ROW_PF[0] <= ground_pf <= _ROW_PF[1]:
                code = "no_row_capacitor" if ground_pf < _ROW_PF[0] else "long_lead"
                self._line(code, "row", row, f"{ground_pf:.0f}")

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
        return TAXEL_PF * float(there.sum())

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


def judge(measured: Measurements | UnresponsiveBoard, rate_hz: float) -> list[Row]:
    """Return what is wrong with a board, what explains most first; [] where nothing is."""
    if isinstance(measured, Measurements):
        return WiringChecks(measured, rate_hz).faults
    if measured.zeros:
        return [fault("silent_converter", "converter")]
    if measured.failed == 1.0:
        return [fault("no_converter", "converter", measured.reason)]
    share = f"{100 * measured.failed:.0f} % of the transfers failed"
    return [fault("bus_errors", "bus", f"{share}: {measured.reason}")]


def _where(mask: Flags) -> list[int]:
    """Return the indices at which a mask (n,) is true."""
    return np.flatnonzero(mask).tolist()
