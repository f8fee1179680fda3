"""Wiring checks from the measurements of a board; pure.

What explains most is said first, and what it explains is not said again: a row that touches ground
has no taxels to complain of.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.measurements import LATE_S, Measurements, UnresponsiveBoard
from controller.diagnostics.messages import SENTENCES
from controller.diagnostics.report import Row, Verdict
from controller.sensors.hardware import schedule

Array = NDArray[np.float64]

TAXEL_PF: Final = 41.2  # mean of the taxels: paper, section 3.2
_COUNTS: Final = 4096.0  # in which noise is told, whatever the converter

# The limits lie between what 1,000 sound orbs of random tolerances and 50 of each fault show
# (tests/benchmarks/doctor.py).
_HELD: Final = 0.5  # of full scale: a row keeps its charge, .94, or does not
_CLIPPED: Final = 0.985  # a charged row at full scale: the reference is below the supply
_LOW: Final = 0.88
_UP: Final = 0.5  # a row that nobody drives stands at the supply
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
_SURE: Final = 4.0  # times the hum that noise alone would show
_BUSY: Final = 0.8  # of a frame
_TELLING: Final = 30  # conversions that tell bits which never change
_LOSES_S: Final = 2e-3  # a row that loses its charge faster has no sound resistor
_FILLS_S: Final = 20e-3  # a row whose film fills slowly seems to lose it faster than so


class WiringChecks:
    """The verdict on one board."""

    def __init__(self, measured: Measurements, rate_hz: float) -> None:
        """Judge.

        Args:
            measured: What was measured.
            rate_hz: Scans per second that are wanted.
        """
        self.faults: list[Row] = []
        self._m, self._rate_hz = measured, rate_hz
        self._rows, self._columns = measured.wiring.rows, measured.wiring.columns
        self.bad = np.zeros((self._rows, self._columns), dtype=np.bool_)  # explained already
        self._bad_row = np.zeros(self._rows, dtype=np.bool_)
        self._bad_column = np.zeros(self._columns, dtype=np.bool_)
        self.capacitance = measured.picofarads.mean(axis=0)
        with_nothing = np.maximum(self.capacitance, 0.5)
        self._growth = np.maximum(measured.late, 0.5) / with_nothing
        # Noise of one conversion, counts of 4096.
        samples = np.sqrt(measured.wiring.times.samples)
        self.scatter = np.median(measured.shares.std(axis=0, ddof=1), axis=1) * samples * _COUNTS
        self._reference_off = False
        self._loud = False
        self._speed()
        if self.faults:
            return  # what is read that late says nothing of the leads
        for step in (
            self._bits, self._hums, self._plug, self._converter, self._shorts, self._row_pins,
            self._column_pins, self._crackles, self._noise, self._open, self._worn, self._leaks,
            self._row_parts, self._dead,
        ):  # fmt: skip
            step()

    def _say(self, code: str, name: str, *figures: object, doubtful: bool = False) -> None:
        sentence = SENTENCES[code]
        verdict = Verdict.DOUBTFUL if doubtful else Verdict.FAULT
        found = sentence.found.format(*figures)
        self.faults.append(Row(name, verdict, found, sentence.advice, code))

    def _row(self, code: str, row: int, *figures: object) -> None:
        self._say(code, f"row {row}", *figures)
        self._bad_row[row] = True
        self.bad[row] = True

    def _column(self, code: str, column: int, *figures: object) -> None:
        self._say(code, f"column {column}", *figures)
        self._bad_column[column] = True
        self.bad[:, column] = True

    def _taxel(self, code: str, row: int, column: int, *figures: object) -> None:
        self._say(code, f"taxel ({row},{column})", *figures)
        self.bad[row, column] = True

    # --- one step of the explanation after the other -----------------------------------------

    def _plug(self) -> None:
        m, most = self._m, np.maximum(self._m.late, self.capacitance)
        holds = np.diag(m.held) > _HELD
        if np.median(most) < _LOST * TAXEL_PF and holds.sum() > self._rows / 2:
            taus_s = [self._tau_s(row) for row in range(self._rows)]
            if np.median(taus_s) < _FILLS_S / 2 and np.median(taus_s) > _LOSES_S:
                self._say("unplugged", "membrane", f"{np.median(self.capacitance):.1f}")
                self.bad[:] = self._bad_row[:] = self._bad_column[:] = True

    def _hums(self) -> None:
        if self.faults:
            return
        hum, hertz, sure = self._hum()
        if hum > _HUM and sure:
            self._say("mains", "readings", f"{100 * hum:.0f}", f"{hertz:.0f}")
            self._reference_off = True  # levels are not to be trusted

    def _bits(self) -> None:
        m = self._m
        values = m.values[(m.values > 0) & (m.values < 1.0 / m.step - 1)].astype(np.int64)
        bits = round(np.log2(1.0 / m.step))
        if len(values) >= _TELLING and bits > 10 and not (values & 3).any():
            self._say("other_converter", "converter")
        else:
            for bit in range(bits - 2):
                telling = values[values >= 4 << bit] >> bit & 1
                if len(telling) >= _TELLING and telling.min() == telling.max():
                    self._say("stuck_bit", "converter", bit)
                    self._reference_off = True
                    break

    def _converter(self) -> None:
        m = self._m
        shares = m.shares[_SETTLING:]
        away = np.abs(shares - np.median(shares, axis=0))
        usual = np.maximum(np.median(away, axis=0), m.step / 4)
        share = float((away > _OUTLIER * usual).mean())
        if share > _OUTLIERS and (away > _OUTLIER * usual).any(axis=(0, 2)).mean() > 0.5:
            self._say("bit_errors", "converter", f"{100 * share:.1f}")
            self._reference_off = True
        if self._reference_off:
            return
        level = float(np.median(np.diag(m.held))) / m.wiring.circuit.reach
        clipped = level >= _CLIPPED and np.median(m.dark) < _UP
        if clipped or (_HELD < level < _LOW and not self._bad_row.all()):
            self._say("reference", "converter", f"{level:.2f} of full scale")
            self._reference_off = True  # what follows from levels would only repeat it

    def _shorts(self) -> None:
        m = self._m
        for i in range(self._rows):
            for k in range(i + 1, self._rows):
                if m.held[i, k] > _HELD and m.held[k, i] > _HELD and m.held[i, i] < _HELD:
                    for one, other in ((i, k), (k, i)):
                        self._row("swapped_channels", one, f"row {other}")
                elif (
                    min(m.row_touch[i, k], m.row_touch[k, i]) > _HELD
                    and max(m.dark[i], m.dark[k]) < _UP
                ):
                    self._row("short_rows", i, f"row {k}")
                    self._bad_row[k] = self.bad[k] = True
        for i in range(self._columns):
            for k in range(i + 1, self._columns):
                if m.column_touch[i, k] and m.column_touch[k, i]:
                    self._column("short_columns", i, f"column {k}")
                    self._bad_column[k] = self.bad[:, k] = True
        for row in _where(~self._bad_row):
            share = m.shares[:, row].mean(axis=0)
            if m.dark[row] < _UP and share.max() > _FULL and np.median(share) < 1 - _FULL:
                column = int(share.argmax())
                self._taxel("short_taxel", row, column)
                self._bad_row[row] = self._bad_column[column] = True
                self.bad[row] = self.bad[:, column] = True

    def _row_pins(self) -> None:
        m = self._m
        for row in _where(~self._bad_row):
            if m.dark[row] > _UP:
                high = min(m.prompt[row], m.dark[row]) > _AT_SUPPLY
                self._row("high_row" if high else "pull_up", row, f"{m.dark[row]:.2f}")
            elif m.held[row, row] < _HELD / 5:
                if m.held_level[row]:
                    self._row("no_channel", row)
                elif m.shares[:, row].mean(axis=0).sum() > 0.05:
                    self._row("dead_row_pin", row)
                else:
                    self._row("grounded_row", row)

    def _column_pins(self) -> None:
        m = self._m
        for column in _where(~self._bad_column):
            if not m.column_low[column]:
                self._column("high_column", column)
            elif not m.column_high[column]:
                self._column("grounded_column", column)

    def _open(self) -> None:
        good, m = self.capacitance[~self.bad], self._m
        if not good.size:
            return
        low = (self.capacitance < _LOST * np.median(good)) & (
            np.maximum(m.late, self.capacitance) < _LOST * np.median(good)
        )
        figures = f"{np.median(good):.0f}"
        for row in _where(~self._bad_row):
            free = ~self._bad_column
            if free.sum() > 1 and low[row, free].all() and self._tau_s(row) > _LOSES_S:
                self._row("open_row", row, f"{self.capacitance[row].mean():.1f}", figures)
        for column in _where(~self._bad_column):
            free = ~self._bad_row
            if free.sum() > 1 and low[free, column].all():
                mean = self.capacitance[:, column].mean()
                self._column("open_column", column, f"{mean:.1f}", figures)

    def _worn(self) -> None:
        if self._loud:
            return
        grows = (self._growth > _GROWS) & ~self.bad
        for row in _where(~self._bad_row):
            free = ~self.bad[row]
            # A missing resistor or a long lead lets all of a row grow; but then its charge stays.
            if free.sum() > 1 and grows[row, free].all() and self._tau_s(row) < _FILLS_S:
                self._row("weak_row", row, f"{np.median(self._growth[row, free]):.1f}")
        for column in _where(~self._bad_column):
            free = ~self.bad[:, column]
            if free.sum() > 1 and grows[free, column].all():
                growth = np.median(self._growth[free, column])
                self._column("weak_column", column, f"{growth:.1f}")

    def _leaks(self) -> None:
        if self._loud:
            return
        for row in _where(~self._bad_row):
            free = ~self.bad[row]
            growth = self._growth[row] / np.median(self._growth[row, free]) if free.any() else None
            if growth is None:
                continue
            conducts = free & (growth > _GROWS) & (self._m.late_shares[row] > _CONDUCTS)
            for column in _where(conducts):
                if free.sum() - conducts.sum() >= 1:
                    self._taxel("leaky", row, column, f"{growth[column]:.1f}")
            if (self.bad[row] & free).any():
                self._bad_row[row] = True  # what leaks there is no resistor's fault

    def _row_parts(self) -> None:
        if self._reference_off or self._loud:
            return
        m = self._m
        for row in _where(~self._bad_row):
            ground_pf, bleed_mohm = self._row_pf(row), self._bleed_mohm(row)
            # Counts are never below zero, so noise alone reads as some charge.
            if m.dark_late[row] > _DAMP + 0.8 * self.scatter[row] / _COUNTS:
                self._row("damp", row, f"{m.dark_late[row]:.2f}")
            elif not _BLEED_MOHM[0] < bleed_mohm < _BLEED_MOHM[1]:
                if bleed_mohm > _BLEED_MOHM[1]:
                    self._row("no_bleed", row, f"{100 * m.held_late[row]:.0f} % after 4 ms")
                else:
                    self._row("small_bleed", row, f"{bleed_mohm:.2g}")
            elif ground_pf < _ROW_PF[0]:
                self._row("no_row_capacitor", row, f"{ground_pf:.0f}")
            elif ground_pf > _ROW_PF[1]:
                self._row("long_lead", row, f"{ground_pf:.0f}")

    def _row_only(self, code: str, row: int, *figures: object) -> None:
        self._say(code, f"row {row}", *figures)
        self._bad_row[row] = True
        self.bad[row] = True

    def _dead(self) -> None:
        good = self.capacitance[~self.bad]
        for row, column in np.argwhere(~self.bad):
            if self.capacitance[row, column] < _LOST * np.median(good):
                figures = f"{self.capacitance[row, column]:.1f}", f"{np.median(good):.0f}"
                self._taxel("dead", int(row), int(column), *figures)

    def _noise(self) -> None:
        free = ~self._bad_row
        if not free.any():
            return
        middle = float(np.median(self.scatter[free]))
        if middle > _NOISE and not self.faults:
            self._say("noise", "readings", f"{middle:.0f}")
            self._loud = True  # figures that take a quiet converter are not to be trusted

    def _crackles(self) -> None:
        free = ~self._bad_row
        if not free.any() or self._reference_off:
            return
        middle = float(np.median(self.scatter[free]))
        for row in _where(free):
            if self.scatter[row] > _NOISY * max(middle, 1.0) + 2.0:
                self._row("noisy", row, f"{self.scatter[row]:.0f}", f"{middle:.0f}")

    def _speed(self) -> None:
        m = self._m
        frame_s = schedule.frame_s(m.wiring, m.conversion_s / 3, m.conversion_s)
        if frame_s > _BUSY / self._rate_hz:
            words = (
                f"a conversion takes {1e6 * m.conversion_s:.0f} us, so a scan takes "
                f"{1e3 * frame_s:.0f} of the frame's {1e3 / self._rate_hz:.0f} ms"
            )
            self._say("slow", "scan", words)

    # --- figures ------------------------------------------------------------------------------

    def _tau_s(self, row: int) -> float:
        """Return with which time constant a row loses its charge, seconds."""
        m = self._m
        before, after = m.held[row, row], m.held_late[row] - max(0.0, m.dark_late[row])
        ratio = max(after, m.step) / max(before, m.step)
        return LATE_S / -float(np.log(ratio)) if ratio < 0.999 else np.inf

    def _taxels_pf(self, row: int) -> float:
        """Return what the taxels of a row usually have, pF, as many as there are."""
        there = self.capacitance[row] > _LOST * np.median(self.capacitance[row])
        return TAXEL_PF * float(there.sum())

    def _row_pf(self, row: int) -> float:
        """Return what a row has to ground, pF, if its taxels are as usual."""
        share = float(np.clip(self._m.shares[:, row].mean(axis=0).sum(), 0.01, 0.99))
        return self._taxels_pf(row) * (1.0 - share) / share

    def _bleed_mohm(self, row: int) -> float:
        """Return its resistor, megohms, from what it keeps and its usual capacitance."""
        total_pf = self._taxels_pf(row) + float(np.clip(self._row_pf(row), 40.0, 600.0))
        tau_s = self._tau_s(row)
        if tau_s < LATE_S / 2:  # then its share is spoilt by the loss, too
            total_pf = self._taxels_pf(row) + self._m.wiring.circuit.row_pf
        return tau_s * 1e6 / total_pf

    def _hum(self) -> tuple[float, float, bool]:
        """Return the strongest hum: amplitude (of the reading), hertz, and whether it is sure."""
        values, times = self._m.burst
        mean = float(values.mean())
        if mean <= 0.0:
            return 0.0, 0.0, False
        best = (0.0, 0.0, False)
        for hertz in (50.0, 60.0):
            turn = 2 * np.pi * hertz * times
            basis = np.stack([np.ones_like(turn), np.sin(turn), np.cos(turn)], axis=1)
            solved, *_ = np.linalg.lstsq(basis, values / mean, rcond=None)
            left = float((values / mean - basis @ solved).std())
            amplitude = float(np.hypot(solved[1], solved[2]))
            sure = amplitude > _SURE * left * np.sqrt(2.0 / len(values))
            best = max(best, (amplitude, hertz, sure))
        return best


def judge(measured: Measurements | UnresponsiveBoard, rate_hz: float) -> list[Row]:
    """Return what is wrong with a board, what explains most first; [] where nothing is."""
    if isinstance(measured, UnresponsiveBoard):
        return [_silent(measured)]
    return WiringChecks(measured, rate_hz).faults


def sound(measured: Measurements, faults: list[Row]) -> Iterator[Row]:
    """Yield rows on what was found to be good."""
    leads = WiringChecks(measured, 10.0)
    named = {fault.name.split()[0] for fault in faults}
    if "converter" not in named:
        yield Row("converter", Verdict.GOOD, f"{measured.wiring.converter.type} answers")
    if not {"row", "column", "membrane"} & named:
        yield Row("electrodes", Verdict.GOOD, f"{leads._rows} rows, {leads._columns} columns")
    good = leads.capacitance[~leads.bad]
    if good.size and "membrane" not in named:
        spread = f"{good.mean():.1f} pF (SD {good.std():.1f})"
        yield Row("taxels", Verdict.GOOD, f"{good.size} of {leads.bad.size}: {spread}")
    if "readings" not in named:
        middle = float(np.median(leads.scatter))
        yield Row("readings", Verdict.GOOD, f"scatter by {middle:.1f} counts of 4096")
    if "scan" not in named:
        yield Row("clock", Verdict.GOOD, f"a conversion takes {1e6 * measured.conversion_s:.0f} us")


def _where(mask: NDArray[np.bool_]) -> list[int]:
    """Return where a mask is true."""
    return [int(i) for i in np.flatnonzero(mask)]


def _silent(found: UnresponsiveBoard) -> Row:
    if found.zeros:
        code, figures = "silent_converter", ""
    elif found.failed == 1.0:
        code, figures = "no_converter", found.reason
    else:
        code = "bus_errors"
        figures = f"{100 * found.failed:.0f} % of the transfers failed: {found.reason}"
    sentence = SENTENCES[code]
    name = "bus" if code == "bus_errors" else "converter"
    return Row(name, Verdict.FAULT, sentence.found.format(figures), sentence.advice, code)
