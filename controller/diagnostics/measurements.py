"""Electrical measurements on a board, real or emulated, by its pins and its converter.

The orb must not be touched meanwhile. It takes a second or two.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from controller.diagnostics.report import Row, fault
from controller.sensors.hardware import HardwareAwayError
from controller.sensors.hardware.board import Board
from controller.sensors.hardware.inversion import Inversion
from controller.sensors.hardware.scanner import Scanner
from controller.sensors.hardware.wiring import CHANNELS
from controller.shared.aliases import Array

LATE_S: Final = 4e-3  # a quarter of R_m times a row's capacitance: other resistors show
CHARGE_S: Final = 200e-6  # a pin charges its electrode in far less
CONVERSION_COUNT: Final = 40  # that show whether a converter answers
SCAN_COUNT: Final = 12
READINGS: Final = 6  # of which a mean is taken


def measure(board: Board) -> "Measurements | Row":
    """Measure a board, or return why it cannot be; all electrodes are grounded afterwards."""
    try:
        return _silence(board) or Measurements(board)
    except HardwareAwayError as error:
        return fault("bus_errors", "bus", str(error))


def _silence(board: Board) -> Row | None:
    """Return why a converter does not answer while every row is at the supply; None: it does."""
    electrodes = board.wiring.electrodes
    values, reason = [], ""
    for pin in electrodes.rows:
        board.pins.drive(pin, True)
    for number in range(CONVERSION_COUNT):
        try:
            values.append(board.convert(electrodes.channels[number % len(electrodes.channels)]))
        except HardwareAwayError as error:
            reason = str(error)
    for pin in electrodes.rows:
        board.pins.drive(pin, False)
    if not any(values):
        return fault("no_converter", "converter", reason or "it reads 0 of every row at 3.3 V")
    if reason:
        share = f"{100 - 100 * len(values) / CONVERSION_COUNT:.0f} % of the transfers failed"
        return fault("bus_errors", "bus", f"{share}: {reason}")
    return None


class Measurements:
    """Measurements of a board; counts as shares of full scale, so 0 ... 1.

    Attributes:
        wiring: Wiring of the board.
        step: The converter's step, of full scale.
        scan_s: Duration of one scan.
        dark: Each row by itself, with no column raised, (rows,).
        held: Row i charged by its pin and let go: what channel k reads, (rows, rows).
        held_late: The same `LATE_S` later, by its own channel, (rows,).
        held_level: Whether its pin reads high just after it let go, (rows,).
        row_touch: Row i driven high and row k floating: what channel k reads, (rows, rows).
        column_high: Whether a column stays high when its pin lets go, (columns,).
        column_low: Whether it stays low, (columns,).
        column_touch: Column i driven high: whether column k, floating, is high, (columns, columns).
        shares: Scans, (n, rows, columns).
        picofarads: What the driver makes of them, (n, rows, columns).
    """

    def __init__(self, board: Board) -> None:
        """Measure everything, or raise HardwareAwayError."""
        # One row at a time: what is wrong with one then shows in that one.
        board = replace(board, wiring=replace(board.wiring, scheme="taxel"))
        self._board, self.wiring = board, board.wiring
        full = 1 << board.chip.bits
        self.step = 1.0 / full
        scanner = Scanner(board)
        dark = scanner.dark(READINGS)
        self.dark = dark * self.step
        self._test_rows()
        self._test_columns()
        began_s = board.clock()
        scans = [scanner.scan() for _ in range(SCAN_COUNT)]
        self.scan_s = (board.clock() - began_s) / SCAN_COUNT
        self.shares = np.array([scan.counts for scan in scans]) * self.step
        self.picofarads = np.array(
            [
                Inversion(self.wiring, full).picofarads(scan.counts, scan.age_s, dark)
                for scan in scans
            ]
        )

    def time_constants_s(self) -> Array:
        """Return the time constant with which each row loses its charge, (rows,), seconds."""
        before = np.maximum(np.diag(self.held), self.step)
        ratio = np.minimum(np.maximum(self.held_late, self.step) / before, 0.999)
        return np.asarray(LATE_S / -np.log(ratio))

    def _convert(self, row: int) -> float:
        """Return what a row's channel reads, of full scale; the sampling capacitor is emptied."""
        channel, ground = self.wiring.electrodes.channels[row], self.wiring.converter.ground
        if ground is not None:
            self._board.convert(channel - channel % CHANNELS + ground)
        return self._board.convert(channel) * self.step

    def _charge(self, pin: int, up: bool) -> None:
        """Drive an electrode to the supply or to ground, and let it float."""
        self._board.pins.drive(pin, up)
        self._board.wait(CHARGE_S)
        self._board.pins.release(pin)

    def _test_rows(self) -> None:
        """Measure `held`, `held_late`, `held_level` and `row_touch`."""
        pins, wait, electrodes = self._board.pins, self._board.wait, self.wiring.electrodes.rows
        rows = len(electrodes)
        self.held_late, self.held_level = np.zeros(rows), np.zeros(rows, dtype=np.bool_)
        self.held, self.row_touch = np.zeros((rows, rows)), np.zeros((rows, rows))
        for i, pin in enumerate(electrodes):
            for k in range(rows):
                readings = READINGS if i == k else 1
                for _ in range(readings):
                    self._charge(pin, True)
                    self.held[i, k] += self._convert(k) / readings
            for _ in range(READINGS):
                self._charge(pin, True)
                wait(LATE_S)
                self.held_late[i] += self._convert(i) / READINGS
            self._charge(pin, True)
            self.held_level[i] = pins.level(pin)
            pins.drive(pin, True)
            for k, other in enumerate(electrodes):
                if k != i:
                    pins.release(other)
                    wait(CHARGE_S)
                    self.row_touch[i, k] = self._convert(k)
                    pins.drive(other, False)
            pins.drive(pin, False)

    def _test_columns(self) -> None:
        """Measure `column_high`, `column_low` and `column_touch`."""
        pins, wait, electrodes = self._board.pins, self._board.wait, self.wiring.electrodes.columns
        columns = len(electrodes)
        self.column_high, self.column_low = np.zeros((2, columns), dtype=np.bool_)
        self.column_touch = np.zeros((columns, columns), dtype=np.bool_)
        for i, pin in enumerate(electrodes):
            for up, stays in ((True, self.column_high), (False, self.column_low)):
                self._charge(pin, up)
                wait(CHARGE_S)
                stays[i] = pins.level(pin) is up
                pins.drive(pin, False)
            pins.drive(pin, True)
            for k, other in enumerate(electrodes):
                if k != i:
                    pins.release(other)
                    wait(CHARGE_S)
                    self.column_touch[i, k] = pins.level(other)
                    pins.drive(other, False)
            pins.drive(pin, False)
