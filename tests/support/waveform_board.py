"""A board whose converter reads what ngspice computed: mock pins and recorded volts.

The pins tell which column stands high and which rows float; the converter's samples are looked up,
and are refused when they come at another time than ngspice's.
"""

from typing import Any

import numpy as np
from gpiozero.pins.mock import MockFactory

from controller.sensors.hardware.board import Board
from controller.sensors.hardware.emulated.board import FakeChip
from controller.sensors.hardware.emulated.pins import CircuitFactory
from controller.sensors.hardware.pins import Controls, GpioPins
from controller.sensors.hardware.wiring import CHIPS, Wiring
from controller.shared.aliases import Array
from tests.reference import spice, waveforms

_LATE_S = 10e-6  # a sample may be this far from where ngspice took it


class Recorded:
    """What mock pins are soldered to: ngspice's converter."""

    supply_v = spice.SUPPLY_V

    def __init__(self, wiring: Wiring, held: Array) -> None:
        """Take what the converter holds, volts, (columns + 1, rows, samples); the last is dark."""
        self.now_s, self.high, self.since_s = 0.0, -1, 0.0
        self.floating: list[int] = []
        self._wiring, self._held = wiring, held
        self._next = np.zeros(wiring.rows, dtype=int)
        pins = wiring.electrodes
        self._column = {pin: i for i, pin in enumerate(pins.columns)}
        self._row = {pin: i for i, pin in enumerate(pins.rows)}

    def drive(self, pin: int, high: bool) -> None:
        if pin in self._column:
            if high:
                assert self.high < 0, "only one column stands high"
                self.high, self.since_s = self._column[pin], self.now_s
            elif self._column[pin] == self.high:
                self.high = -1
        elif self._row[pin] in self.floating:
            assert not high, "rows are never driven high"
            self.floating.remove(self._row[pin])

    def release(self, pin: int) -> None:
        row = self._row.get(pin)
        if row is not None:  # columns are let go of only in the end
            if row not in self.floating:
                self.floating.append(row)
            self._next[row] = 0

    def advance(self, seconds: float) -> None:
        self.now_s += seconds

    def volts(self, pin: int) -> float:
        return 0.0

    def sample(self, row: int) -> float:
        assert row in self.floating, "a row that is read floats"
        k = self._next[row]
        self._next[row] += 1
        if self.high >= 0:
            before = self.floating.index(row) * (1 + waveforms.SAMPLES) + 2 + k
            due = waveforms.PIN_S + waveforms.SETTLE_S + before * waveforms.TRANSFER_S
            assert abs(self.now_s - self.since_s - due) < _LATE_S, "ngspice sampled at another time"
        return float(self._held[self.high, row, k])


def board(wiring: Wiring, held: Array, rng: np.random.Generator, noise_lsb: float = 1.0) -> Board:
    """Return a board with recorded volts, and noise of the converter's own, counts of 4096."""
    circuit = Recorded(wiring, held)
    pins = (*wiring.electrodes.columns, *wiring.electrodes.rows)
    factory: MockFactory = CircuitFactory(circuit, frozenset(pins), waveforms.PIN_S)  # type: ignore[arg-type]
    rows = {channel: row for row, channel in enumerate(wiring.electrodes.channels)}

    def measure(channel: int) -> float:
        volts = circuit.sample(rows[channel]) if channel in rows else 0.0
        return float(volts / circuit.supply_v + rng.normal(0.0, noise_lsb) / 4096)

    chip = FakeChip(CHIPS[wiring.converter.type].bits, measure)

    class Bus:
        def transfer(self, data: bytes) -> bytes:
            circuit.advance(waveforms.TRANSFER_S)
            return chip.transfer(data)

        def close(self) -> None:
            pass

    buses: Any = (Bus(),)
    return Board(
        wiring, GpioPins(factory, pins), CHIPS[wiring.converter.type], buses,
        Controls(factory, wiring), circuit.advance, lambda: circuit.now_s,
    )  # fmt: skip
