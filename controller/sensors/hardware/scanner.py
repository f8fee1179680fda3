"""Runs the schedule of a scan on a board: from electrodes to counts.

A slot grounds all electrodes, lets its rows float, raises its column, lets that settle, converts,
and lowers the column again.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from controller.sensors.hardware.board import Board
from controller.sensors.hardware.wiring import CHANNELS, Wiring
from controller.shared.aliases import Array


@dataclass(frozen=True, slots=True)
class Slot:
    """One charge: a column, and the rows that are read against it."""

    column: int | None  # which is raised; None: none is, so that what is read is the rows' own
    rows: tuple[int, ...]  # which float, in the order of conversion; all others are grounded


def slots(wiring: Wiring, columns: Iterable[int | None]) -> list[Slot]:
    """Return the slots of columns, one by one (paper, section 3.2).

    What rows read while no column is raised, None, is offset, leakage and injection.
    """
    rows = range(wiring.rows)
    together = [tuple(rows)] if wiring.scheme == "column" else [(row,) for row in rows]
    return [Slot(column, group) for column in columns for group in together]


@dataclass(frozen=True, slots=True)
class Scan:
    """Result of a frame's slots."""

    counts: Array  # mean of each reading's conversions, (rows, columns)
    age_s: Array  # their mean time since the column's rise, (rows, columns)


class Scanner:
    """Reads taxels of its `board` one by one, or a column at once."""

    def __init__(self, board: Board) -> None:
        """Ground all electrodes."""
        self.board = board
        self._wiring = wiring = board.wiring
        self._slots = slots(wiring, range(wiring.columns))
        self._dark_slots = slots(wiring, [None])
        for pin in (*wiring.electrodes.columns, *wiring.electrodes.rows):
            board.pins.drive(pin, False)

    def scan(self) -> Scan:
        """Return one frame, or raise HardwareAwayError."""
        shape = self._wiring.rows, self._wiring.columns
        counts, age_s = np.empty(shape), np.empty(shape)
        for slot in self._slots:
            assert slot.column is not None
            for row, (count, age) in zip(slot.rows, self.read(slot), strict=True):
                counts[row, slot.column], age_s[row, slot.column] = count, age
        return Scan(counts, age_s)

    def dark(self, readings: int) -> Array:
        """Return what each row reads while no column is raised, (rows,): the mean of some readings.

        It does not depend on what touches the orb. HardwareAwayError as of `scan`.
        """
        counts = np.zeros(self._wiring.rows)
        for _ in range(readings):
            for slot in self._dark_slots:
                for row, (count, _) in zip(slot.rows, self.read(slot), strict=True):
                    counts[row] += count / readings
        return counts

    def read(self, slot: Slot) -> list[tuple[float, float]]:
        """Return (mean counts, mean seconds since the column's rise) of one slot's rows.

        All electrodes are grounded afterwards, also if the converter does not answer.
        """
        board, times, electrodes = self.board, self._wiring.times, self._wiring.electrodes
        board.wait(times.discharge_s)
        try:
            for row in slot.rows:
                if self._wiring.converter.ground is None:
                    board.convert(electrodes.channels[row])  # empties the converter: see below
                board.pins.release(electrodes.rows[row])
            if slot.column is not None:
                board.pins.drive(electrodes.columns[slot.column], True)
            rise_s = board.clock()
            board.wait(times.settle_s)
            return [self._mean(electrodes.channels[row], rise_s) for row in slot.rows]
        finally:
            if slot.column is not None:
                board.pins.drive(electrodes.columns[slot.column], False)
            for row in slot.rows:
                board.pins.drive(electrodes.rows[row], False)

    def _mean(self, channel: int, rise_s: float) -> tuple[float, float]:
        """Return a channel's mean count, and how old the charge was in the middle of it."""
        ground = self._wiring.converter.ground
        if ground is not None:
            # The converter's own capacitor still holds the last reading, another row's: empty it.
            self.board.convert(channel - channel % CHANNELS + ground)
        samples, began_s = self._wiring.times.samples, self.board.clock()
        total = sum(self.board.convert(channel) for _ in range(samples))
        return total / samples, (began_s + self.board.clock()) / 2 - rise_s
