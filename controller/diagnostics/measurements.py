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
from controller.sensors.hardware.scanner import Scanner
from controller.sensors.hardware.wiring import Wiring
from controller.shared.aliases import Array, Mask

LATE_S: Final = 4e-3  # a quarter of R_m times a row's capacitance: other resistors show
CHARGE_S: Final = 200e-6  # a pin charges its electrode in far less
CONVERSIONS: Final = 40  # that show whether a converter answers
SCANS: Final = 12
READINGS: Final = 6  # of which a mean is taken


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """Measurements of a board; counts as shares of full scale, so 0 ... 1."""

    wiring: Wiring  # of the board
    step: float  # the converter's step, of full scale
    scan_s: float  # duration of one scan
    dark: Array  # each row by itself, with no column raised, (rows,)
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

    def time_constants_s(self) -> Array:
        """Return the time constant with which each row loses its charge, (rows,), seconds."""
        before = np.maximum(np.diag(self.held), self.step)
        ratio = np.minimum(np.maximum(self.held_late, self.step) / before, 0.999)
        return np.asarray(LATE_S / -np.log(ratio))


def measure(board: Board) -> Measurements | Row:
    """Measure a board, or return why it cannot be; all electrodes are grounded afterwards."""
    try:
        return _silence(board) or _Probe(board).measured()
    except HardwareAwayError as error:
        return fault("bus_errors", "bus", str(error))


def _silence(board: Board) -> Row | None:
    """Return why a converter does not answer while every row is at the supply; None: it does."""
    electrodes = board.wiring.electrodes
    values, reason = [], ""
    for pin in electrodes.rows:
        board.pins.drive(pin, True)
    for number in range(CONVERSIONS):
        try:
            values.append(board.convert(electrodes.channels[number % len(electrodes.channels)]))
        except HardwareAwayError as error:
            reason = str(error)
    for pin in electrodes.rows:
        board.pins.drive(pin, False)
    if not any(values):
        return fault("no_converter", "converter", reason or "it reads 0 of every row at 3.3 V")
    if reason:
        share = f"{100 - 100 * len(values) / CONVERSIONS:.0f} % of the transfers failed"
        return fault("bus_errors", "bus", f"{share}: {reason}")
    return None


class _Probe:
    """Measurements of one board."""

    def __init__(self, board: Board) -> None:
        # One row at a time: what is wrong with one then shows in that one.
        board = replace(board, wiring=replace(board.wiring, scheme="taxel"))
        self._board, self._wiring = board, board.wiring
        self._full = float(1 << board.chip.bits)
        self._rows, self._columns = board.wiring.electrodes.rows, board.wiring.electrodes.columns

    def measured(self) -> Measurements:
        """Return all measurements."""
        scanner = Scanner(self._board)
        dark = scanner.dark(READINGS)
        held, held_late, held_level, row_touch = self._row_tests()
        column_high, column_low, column_touch = self._column_tests()
        began_s = self._board.clock()
        scans = [scanner.scan() for _ in range(SCANS)]
        scan_s = (self._board.clock() - began_s) / SCANS
        full, wiring = round(self._full), self._wiring
        taxels_pf = [picofarads(wiring, scan.counts, scan.age_s, dark, full) for scan in scans]
        return Measurements(
            wiring=wiring,
            step=1.0 / self._full,
            scan_s=scan_s,
            dark=dark / self._full,
            held=held,
            held_late=held_late,
            held_level=held_level,
            row_touch=row_touch,
            column_high=column_high,
            column_low=column_low,
            column_touch=column_touch,
            shares=np.array([scan.counts for scan in scans]) / self._full,
            picofarads=np.array(taxels_pf),
        )

    def _convert(self, row: int) -> float:
        """Return what a row's channel reads, of full scale; the sampling capacitor is emptied."""
        channel, ground = self._wiring.electrodes.channels[row], self._wiring.converter.ground
        if ground is not None:
            self._board.convert(channel - channel % CHANNELS + ground)
        return self._board.convert(channel) / self._full

    def _charge(self, pin: int, up: bool) -> None:
        """Drive an electrode to the supply or to ground, and let it float."""
        self._board.pins.drive(pin, up)
        self._board.wait(CHARGE_S)
        self._board.pins.release(pin)

    def _row_tests(self) -> tuple[Array, Array, Mask, Array]:
        """Return `held`, `held_late`, `held_level` and `row_touch`, (rows, ...)."""
        pins, wait, rows = self._board.pins, self._board.wait, len(self._rows)
        late, level = np.zeros(rows), np.zeros(rows, dtype=np.bool_)
        held, touch = np.zeros((rows, rows)), np.zeros((rows, rows))
        for i, pin in enumerate(self._rows):
            for k in range(rows):
                readings = READINGS if i == k else 1
                for _ in range(readings):
                    self._charge(pin, True)
                    held[i, k] += self._convert(k) / readings
            for _ in range(READINGS):
                self._charge(pin, True)
                wait(LATE_S)
                late[i] += self._convert(i) / READINGS
            self._charge(pin, True)
            level[i] = pins.level(pin)
            pins.drive(pin, True)
            for k, other in enumerate(self._rows):
                if k != i:
                    pins.release(other)
                    wait(CHARGE_S)
                    touch[i, k] = self._convert(k)
                    pins.drive(other, False)
            pins.drive(pin, False)
        return held, late, level, touch

    def _column_tests(self) -> tuple[Mask, Mask, Mask]:
        """Return `column_high`, `column_low`, (columns,), and `column_touch`."""
        pins, wait, columns = self._board.pins, self._board.wait, len(self._columns)
        high, low = np.zeros(columns, dtype=np.bool_), np.zeros(columns, dtype=np.bool_)
        touch = np.zeros((columns, columns), dtype=np.bool_)
        for i, pin in enumerate(self._columns):
            for up, told in ((True, high), (False, low)):
                self._charge(pin, up)
                wait(CHARGE_S)
                told[i] = pins.level(pin) is up
                pins.drive(pin, False)
            pins.drive(pin, True)
            for k, other in enumerate(self._columns):
                if k != i:
                    pins.release(other)
                    wait(CHARGE_S)
                    touch[i, k] = pins.level(other)
                    pins.drive(other, False)
            pins.drive(pin, False)
        return high, low, touch
