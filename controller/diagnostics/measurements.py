"""Electrical measurements on a board, real or emulated, by its pins and its converter.

The orb must not be touched meanwhile. It takes a second or two.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from controller.diagnostics.report import Row, fault
from controller.sensors.hardware import HardwareAwayError
from controller.sensors.hardware.board import Board
from controller.sensors.hardware.converters import CHANNELS
from controller.sensors.hardware.inversion import picofarads
from controller.sensors.hardware.scanner import Scan, Scanner
from controller.sensors.hardware.wiring import Wiring
from controller.shared.aliases import Array, Mask

LATE_S: Final = 4e-3  # a quarter of R_m times a row's capacitance: leaks and worn films show
_CHARGE_S: Final = 200e-6  # a pin charges its electrode in far less
_FILL_S: Final = 10e-3  # ... and even a film of megohms in this
_TRIES: Final = 40  # conversions that tell whether a converter answers
_SCANS: Final = 12
_LATE_SCANS: Final = 4
_RAMP: Final = 100  # conversions of one charge as it leaks away
_AGAIN: Final = 6  # readings of which a mean is taken


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """Measurements of a board; counts as shares of full scale, so 0 ... 1."""

    wiring: Wiring  # of the board
    step: float  # the converter's step, of full scale
    scan_s: float  # what one scan takes
    values: Array  # conversions of one row's charge as it leaks away, counts, (n,)
    dark: Array  # each row by itself, with no column raised, (rows,)
    dark_late: Array  # the same after `LATE_S`, (rows,)
    held: Array  # row i charged by its pin and let go: what channel k reads, (rows, rows)
    held_late: Array  # the same `LATE_S` later, by its own channel, (rows,)
    held_level: Mask  # whether its pin reads high just after it let go, (rows,)
    row_touch: Array  # row i driven high and row k floating: what channel k reads, (rows, rows)
    column_high: Mask  # whether a column stays high when its pin lets go, (columns,)
    column_low: Mask  # whether it stays low, (columns,)
    # column i driven high: whether column k, floating, is high, (columns, columns)
    column_touch: Mask
    shares: Array  # scans, (n, rows, columns)
    picofarads: Array  # what the driver makes of them, (n, rows, columns)
    late_shares: Array  # scans that wait for `LATE_S`, their mean, (rows, columns)
    late: Array  # what the driver makes of them, (rows, columns)

    def time_constants_s(self) -> Array:
        """Return the time constant with which each row loses its charge, (rows,), seconds."""
        before, after = np.diag(self.held), self.held_late - np.maximum(0.0, self.dark_late)
        ratio = np.maximum(after, self.step) / np.maximum(before, self.step)
        tau_s = LATE_S / -np.log(np.minimum(ratio, 0.999))
        return np.where(ratio < 0.999, tau_s, np.inf)


def measure(board: Board) -> Measurements | Row:
    """Measure a board, or return why it cannot be; all electrodes are grounded afterwards."""
    try:
        return _silence(board) or _Probe(board).measured()
    except HardwareAwayError as error:
        return fault("bus_errors", "bus", str(error))


def _silence(board: Board) -> Row | None:
    """Return why a converter does not answer while every row is at the supply; None: it does."""
    electrodes = board.wiring.electrodes
    failed, reason, most = 0, "", 0
    for pin in electrodes.rows:
        board.pins.drive(pin, True)
    for number in range(_TRIES):
        try:
            count = board.convert(electrodes.channels[number % len(electrodes.channels)])
        except HardwareAwayError as error:
            failed, reason = failed + 1, str(error)
        else:
            most = max(most, count)
    for pin in electrodes.rows:
        board.pins.drive(pin, False)
    if failed == _TRIES:
        return fault("no_converter", "converter", reason)
    if failed:
        share = f"{100 * failed / _TRIES:.0f} % of the transfers failed"
        return fault("bus_errors", "bus", f"{share}: {reason}")
    return fault("silent_converter", "converter") if most == 0 else None


class _Probe:
    """Measures one board."""

    def __init__(self, board: Board) -> None:
        # One row at a time: what is wrong with one then shows in that one.
        board = replace(board, wiring=replace(board.wiring, scheme="taxel"))
        self._board, self._wiring = board, board.wiring
        self._full = float(1 << board.chip.bits)
        self._rows, self._columns = board.wiring.electrodes.rows, board.wiring.electrodes.columns

    def measured(self) -> Measurements:
        """Return all measurements."""
        wiring, scanner = self._wiring, Scanner(self._board)
        times = replace(wiring.times, settle_s=LATE_S, discharge_s=LATE_S)
        patient = Scanner(replace(self._board, wiring=replace(wiring, times=times)))
        dark, dark_late = scanner.dark(_AGAIN), patient.dark(_AGAIN)
        held, held_late, held_level, row_touch = self._row_tests()
        decays = np.diag(held) - held_late  # whatever is wrong with some rows, the middle one
        values = self._ramp(int(np.argsort(decays)[len(decays) // 2]))
        column_high, column_low, column_touch = self._column_tests()
        began_s = self._board.clock()
        scans = [scanner.scan() for _ in range(_SCANS)]
        scan_s = (self._board.clock() - began_s) / _SCANS
        late = [patient.scan() for _ in range(_LATE_SCANS)]
        shares = np.array([scan.counts for scan in scans]) / self._full
        return Measurements(
            wiring=wiring,
            step=1.0 / self._full,
            scan_s=scan_s,
            values=values,
            dark=dark / self._full,
            dark_late=dark_late / self._full,
            held=held,
            held_late=held_late,
            held_level=held_level,
            row_touch=row_touch,
            column_high=column_high,
            column_low=column_low,
            column_touch=column_touch,
            shares=shares,
            picofarads=self._picofarads(scans, dark),
            late_shares=np.mean([scan.counts for scan in late], axis=0) / self._full,
            late=self._picofarads(late, dark_late).mean(axis=0),
        )

    def _picofarads(self, scans: list[Scan], dark: Array) -> Array:
        """Return scans as the driver reads them, (n, rows, columns), picofarads."""
        full = round(self._full)
        return np.array(
            [picofarads(self._wiring, scan.counts, scan.age_s, dark, full) for scan in scans]
        )

    def _convert(self, row: int) -> float:
        """Return what a row's channel reads, of full scale; the sampling capacitor is emptied."""
        channel, ground = self._wiring.electrodes.channels[row], self._wiring.converter.ground
        if ground is not None:
            self._board.convert(channel - channel % CHANNELS + ground)
        return self._board.convert(channel) / self._full

    def _charge(self, pin: int, up: bool, seconds: float) -> None:
        """Drive an electrode to the supply or to ground for a time, and let it float."""
        self._board.pins.drive(pin, up)
        self._board.wait(seconds)
        self._board.pins.release(pin)

    def _row_tests(self) -> tuple[Array, Array, Mask, Array]:
        """Return `held`, `held_late`, `held_level` and `row_touch`, (rows, ...)."""
        pins, wait, rows = self._board.pins, self._board.wait, len(self._rows)
        late, level = np.zeros(rows), np.zeros(rows, dtype=np.bool_)
        held, touch = np.zeros((rows, rows)), np.zeros((rows, rows))
        for i, pin in enumerate(self._rows):
            for k in range(rows):
                for _ in range(_AGAIN if i == k else 1):
                    self._charge(pin, True, _FILL_S if i == k else _CHARGE_S)
                    held[i, k] += self._convert(k) / (_AGAIN if i == k else 1)
            for _ in range(_AGAIN):
                self._charge(pin, True, _FILL_S)
                wait(LATE_S)
                late[i] += self._convert(i) / _AGAIN
            self._charge(pin, True, _CHARGE_S)
            level[i] = pins.level(pin)
            pins.drive(pin, True)
            for k, other in enumerate(self._rows):
                if k != i:
                    pins.release(other)
                    wait(_CHARGE_S)
                    touch[i, k] = self._convert(k)
                    pins.drive(other, False)
            pins.drive(pin, False)
        return held, late, level, touch

    def _ramp(self, row: int) -> Array:
        """Return conversions on the way down from the supply, (n,), counts."""
        pin, values = self._rows[row], np.zeros(_RAMP)
        self._charge(pin, True, _CHARGE_S)
        for i in range(_RAMP):
            values[i] = self._board.convert(self._wiring.electrodes.channels[row])
            self._board.wait(LATE_S / 8)
        self._board.pins.drive(pin, False)
        return values

    def _column_tests(self) -> tuple[Mask, Mask, Mask]:
        """Return `column_high`, `column_low`, (columns,), and `column_touch`."""
        pins, wait, columns = self._board.pins, self._board.wait, len(self._columns)
        high, low = np.zeros(columns, dtype=np.bool_), np.zeros(columns, dtype=np.bool_)
        touch = np.zeros((columns, columns), dtype=np.bool_)
        for i, pin in enumerate(self._columns):
            for up, told in ((True, high), (False, low)):
                self._charge(pin, up, _FILL_S)
                wait(_CHARGE_S)
                told[i] = pins.level(pin) is up
                pins.drive(pin, False)
            pins.drive(pin, True)
            for k, other in enumerate(self._columns):
                if k != i:
                    pins.release(other)
                    wait(_CHARGE_S)
                    touch[i, k] = pins.level(other)
                    pins.drive(other, False)
            pins.drive(pin, False)
        return high, low, touch
