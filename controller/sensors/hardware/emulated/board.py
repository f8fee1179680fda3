"""An emulated board with an orb: the same interface as a real one's, and its faults."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from controller.sensors.hardware import MissingHardwareError
from controller.sensors.hardware.board import Board
from controller.sensors.hardware.emulated.circuit import Circuit, WiringFault
from controller.sensors.hardware.pins import Controls, GpioPins
from controller.sensors.hardware.wiring import CHANNELS, CHIPS, Wiring
from controller.shared.aliases import Array
from controller.shared.errors import how_to_install
from controller.simulator.dome.readout import NOMINAL_PF, ReadoutModel

_COUNTS: Final = 4096.0  # in which noise is given, whatever the converter
_SPREAD_PF: Final = 2.9  # of the taxels: paper, section 3.2
_PIN_S: Final = 15e-6  # what a change of a pin costs: a guess for a Raspberry Pi 4 under Python
_TRANSFER_S: Final = 20e-6  # what a conversion costs beside its bits: another
_INFLATE_KPA_S: Final = 0.3  # how fast the pump inflates the orb
_OTHER: Final = {"mcp3208": "mcp3008", "mcp3008": "mcp3208"}
_DEFLATE_PER_MIN: Final = 0.01  # share of its pressure that a sound orb loses


@dataclass
class FakeChip:
    """An MCP3008 or MCP3208, clocked in SPI mode 0."""

    bits: int  # its resolution
    measure: Callable[[int], float]  # returns what an input sees, of full scale, as it is sampled
    # lets so many bytes pass on the bus; returns whether the chip is there
    reached: Callable[[int], bool] = lambda size: True

    def transfer(self, data: bytes) -> bytes:
        """Clock all bits through: start, single-ended, three of channel, a pause, null, result."""
        if not self.reached(len(data)):
            return b"\xff" * len(data)
        total = 8 * len(data)
        told = int.from_bytes(data, "big")
        after = told.bit_length() - 1  # bits that follow the start bit
        answer = (1 << total) - 1  # high impedance, pulled up
        if after >= 4 and told >> (after - 1) & 1:
            count = round(self.measure(told >> (after - 4) & 0b111) * (1 << self.bits))
            count = min(max(count, 0), (1 << self.bits) - 1)
            # Four bits of address and one of sampling; then null, then the result, from the top.
            left = after - 5
            result = (
                count << (left - 1 - self.bits)
                if left > self.bits
                else count >> (self.bits + 1 - left)
            )
            if left > 0:
                answer = answer >> left << left | result & ((1 << left) - 1)
        return answer.to_bytes(len(data), "big")

    def close(self) -> None:
        """Nothing is held."""


class EmulatedBoard:
    """Emulated hardware.

    Attributes:
        board: The board for a driver, which closes it.
        circuit: The circuit on the board.
        wiring: The wiring of the board.
        kpa: The orb's pressure.
        picofarads: True capacitances of the taxels, (rows, columns).
        faults: Faults that are switched on.
    """

    def __init__(
        self,
        wiring: Wiring = Wiring(),  # noqa: B008 (it is frozen)
        seed: int | np.random.SeedSequence = 0,
        *,
        model: ReadoutModel = ReadoutModel(),  # noqa: B008 (it is frozen)
        faults: Sequence[WiringFault] = (),
        picofarads: Array | None = None,
    ) -> None:
        """Build an orb with faults; the seed draws the parts' tolerances and the noise.

        The model gives noise, hum and finger. The taxels, pF, (rows, columns), are drawn as well if
        they are not given. Without gpiozero it raises MissingHardwareError.
        """
        try:
            from controller.sensors.hardware.emulated.pins import CircuitFactory
        except ImportError as error:
            raise MissingHardwareError(
                f"emulated hardware needs {error.name}; {how_to_install('pi')}"
            ) from None
        self.wiring = wiring
        self._model = model
        parts, noise = np.random.default_rng(seed).spawn(2)
        self._noise = noise
        self.circuit = Circuit(wiring, parts)
        if picofarads is None:
            picofarads = parts.normal(NOMINAL_PF, _SPREAD_PF, (wiring.rows, wiring.columns))
        self._fingers = np.zeros(wiring.rows)
        self._phase = float(parts.uniform(0.0, 2 * np.pi))
        self.faults: tuple[WiringFault, ...] = ()
        electrodes = (*wiring.electrodes.columns, *wiring.electrodes.rows)
        factory = CircuitFactory(self.circuit, frozenset(electrodes), _PIN_S)
        self.factory = factory
        chip = CHIPS[wiring.converter.type]
        self._chips = [
            FakeChip(chip.bits, partial(self.look, i), self._transfer)
            for i in range(len(wiring.converter.devices))
        ]
        self.kpa = 0.0 if wiring.pump is None else wiring.pump.target_kpa
        self._row_of = {channel: row for row, channel in enumerate(wiring.electrodes.channels)}
        self.touch(picofarads)
        self.switch(faults)
        self.board = Board(
            wiring,
            GpioPins(factory, electrodes),
            chip,
            tuple(self._chips),
            Controls(factory, wiring),
            self.circuit.advance,
            lambda: self.circuit.now_s,
        )

    def touch(self, picofarads: Array, fingers: Array | None = None) -> None:
        """Set the taxels, pF, (rows, columns), and the finger over each row, 0 ... 1, (rows,)."""
        self.picofarads = np.array(picofarads, dtype=np.float64)
        if fingers is not None:
            self._fingers = fingers
        self.circuit.skin(self.picofarads, self._model.finger_pf * self._fingers)

    def press(self, down: bool) -> None:
        """Press the label button, or let go of it."""
        if self.wiring.button is not None:
            pin = self.factory.pin(self.wiring.button)
            (pin.drive_low if down else pin.drive_high)()

    @property
    def pumping(self) -> bool:
        """Whether the pump runs."""
        pump = self.wiring.pump
        return pump is not None and self.factory.outputs.get(pump.pin, False)

    def breathe(self, seconds: float) -> None:
        """Let time pass for the air: it leaks, and the pump brings more."""
        leak = _DEFLATE_PER_MIN + self._size("air_leak")
        self.kpa *= float(np.exp(-leak * seconds / 60.0))
        self.kpa += _INFLATE_KPA_S * seconds * self.pumping

    def switch(self, faults: Sequence[WiringFault], on: bool = True) -> None:
        """Switch faults on or off."""
        others = tuple(fault for fault in self.faults if fault not in faults)
        self.faults = (*others, *faults) if on else others
        self.circuit.break_(self.faults)
        self.factory.pin_s = _PIN_S * (self._size("slow_clock") or 1.0)
        type_ = self.wiring.converter.type
        for chip in self._chips:
            chip.bits = CHIPS[_OTHER[type_] if self._size("other_converter") else type_].bits

    # --- what the converter does ----------------------------------------------------------------

    def _transfer(self, size: int) -> bool:
        """Let bytes pass on the bus, and time; return whether a converter is there."""
        bits_s = 8 * size / self.wiring.converter.clock_hz
        self.circuit.advance((bits_s + _TRANSFER_S) * (self._size("slow_clock") or 1.0))
        if (share := self._size("bus_errors")) and self._noise.random() < share:
            raise OSError(5, "Input/output error")
        return not self._size("no_converter")

    def look(self, converter: int, input_: int) -> float:
        """Return the voltage at a converter's input, of full scale."""
        channel = converter * CHANNELS + input_
        row = self._row_of.get(channel)
        noise = 1.0 if row is None else self._model.noise_lsb
        for fault in self.faults:
            if fault.kind == "swapped_channels" and row in (fault.row, fault.row + 1):
                row = 2 * fault.row + 1 - row
            elif fault.kind == "no_channel" and row == fault.row:
                row = None
            elif fault.kind == "noise":
                noise = float(np.hypot(noise, fault.size))
        if row is None:
            volts = self._other(channel, input_, converter)
        else:
            volts = self.circuit.sample(row, converter)
            hum = self._model.mains * (1.0 + 3.0 * self._fingers[row])
            turn = 2 * np.pi * self._model.mains_hz * self.circuit.now_s + self._phase
            volts *= 1.0 + hum * np.sin(turn)
        reference = self.wiring.supply_v * (self._size("low_reference") or 1.0)
        return float(volts / reference + self._noise.normal(0.0, noise) / _COUNTS)

    def _other(self, channel: int, input_: int, converter: int) -> float:
        """Return the voltage of an input that no row hangs on."""
        pump, volts = self.wiring.pump, None
        if input_ == self.wiring.converter.ground:
            volts = 0.0
        elif pump is not None and channel == pump.channel:
            volts = pump.zero_v + pump.v_per_kpa * self.kpa
        return self.circuit.hold(volts, converter)

    def _size(self, kind: str) -> float:
        """Return the size of a fault, 0 if it is off."""
        return next((fault.size for fault in self.faults if fault.kind == kind), 0.0)
