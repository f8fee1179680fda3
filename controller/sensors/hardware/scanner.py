"""Runs the schedule on a board: from electrodes to counts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.sensors.hardware import schedule
from controller.sensors.hardware.board import Board
from controller.sensors.hardware.schedule import Slot

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Scan:
    """Result of a frame's slots.

    Attributes:
        counts: Mean of each reading's conversions, (rows, columns).
        age_s: Their mean time since the column's rise, (rows, columns).
    """

    counts: Array
    age_s: Array


class Scanner:
    """Reads taxels one by one, or a column at once.

    Attributes:
        board: On which.
    """

    def __init__(self, board: Board) -> None:
        """Ground all electrodes."""
        self.board = board
        self._wiring = wiring = board.wiring
        self._shape = wiring.rows, wiring.columns
        self._slots = tuple(schedule.slots(wiring))
        self._dark_slots = tuple(schedule.dark(wiring))
        self.ground()

    def ground(self) -> None:
        """Ground all electrodes."""
        electrodes = self._wiring.electrodes
        for pin in (*electrodes.columns, *electrodes.rows):
            self.board.pins.drive(pin, False)

    def scan(self) -> Scan:
        """Return one frame.

        Raises:
            HardwareAwayError: The converter does not answer.
        """
        counts, age_s = np.empty(self._shape), np.empty(self._shape)
        for slot in self._slots:
            assert slot.column is not None
            for row, (count, age) in zip(slot.rows, self.read(slot), strict=True):
                counts[row, slot.column], age_s[row, slot.column] = count, age
        return Scan(counts, age_s)

    def dark(self, readings: int = 8) -> Array:
        """Return what each row reads while no column is raised, (rows,): the mean of some readings.

        It does not depend on what touches the orb.

        Raises:
            HardwareAwayError: The converter does not answer.
        """
        counts = np.zeros(self._shape[0])
        for _ in range(readings):
            for slot in self._dark_slots:
                for row, (count, _) in zip(slot.rows, self.read(slot), strict=True):
                    counts[row] += count / readings
        return counts

    def read(self, slot: Slot) -> list[tuple[float, float]]:
        """Return (mean counts, mean seconds since the column's rise) of one slot's rows.

        Raises:
            HardwareAwayError: The converter does not answer; all electrodes are grounded.
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
            inputs = self.board.chip.channels
            self.board.convert(channel - channel % inputs + ground)
        samples, began_s = self._wiring.times.samples, self.board.clock()
        total = sum(self.board.convert(channel) for _ in range(samples))
        return total / samples, (began_s + self.board.clock()) / 2 - rise_s
