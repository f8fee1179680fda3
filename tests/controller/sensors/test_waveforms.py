"""The driver against ngspice: sixty random orbs, at rest and touched, by mock pins and SPI bytes.

`tests/reference/waveforms.py` made the data; it shares no line with the driver's formulas. The mock
pins tell which column stands high and which rows float; the converter's samples are looked up, and
are refused when they come at another time than ngspice's.
"""

from dataclasses import replace

import numpy as np
import pytest

from controller.shared.aliases import Array
from tests.reference import spice, waveforms

pytest.importorskip("gpiozero", reason="the driver's pins are gpiozero's mock pins")

from typing import Any

from gpiozero.pins.mock import MockFactory

from controller.sensors.hardware.board import Board
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.emulated.board import FakeChip
from controller.sensors.hardware.emulated.pins import CircuitFactory
from controller.sensors.hardware.pins import Controls, GpioPins
from controller.sensors.hardware.wiring import CHIPS, CircuitWiring, Scheme, Wiring
from controller.simulator.dome.readout import ReadoutModel, read

pytestmark = pytest.mark.slow


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


DATA = np.load(waveforms.FILE)
TRUE_PF = DATA["picofarads"].astype(np.float64)  # (orbs, rest and touched, rows, columns)
TRUE_Z = TRUE_PF[:, 1] / TRUE_PF[:, 0]


def driven(name: str, wiring: Wiring, noise_lsb: float = 1.0) -> Array:
    """What the driver makes of what ngspice saw, pF, like `TRUE_PF`."""
    rng = np.random.default_rng(0)
    volts = DATA[name] * waveforms.STEP_V
    return np.array(
        [
            [Driver(board(wiring, held, rng, noise_lsb)).frame() for held in states]
            for states in volts
        ],
        dtype=np.float64,
    )


def wired(scheme: Scheme, chip: str = "mcp3208") -> Wiring:
    """The default wiring without pump, and without what the bundle wants left of neighbours."""
    circuit = CircuitWiring()
    wiring = replace(Wiring(scheme=scheme), pump=None, circuit=circuit)
    return replace(wiring, converter=replace(wiring.converter, type=chip))


@pytest.mark.parametrize(("scheme", "worst"), [("taxel", 0.006), ("column", 0.011)])
def test_every_taxel_of_every_orb_is_read_right(scheme: Scheme, worst: float) -> None:
    frames = driven(scheme, wired(scheme), noise_lsb=0.0)
    z = frames[:, 1] / frames[:, 0]
    assert np.abs(z - TRUE_Z).max() < worst
    assert np.sqrt(np.mean((z - TRUE_Z) ** 2, axis=0)).max() < 0.004  # place by place
    # Absolutely, by the nominal row capacitance that a builder takes: two percent.
    ratio = frames / TRUE_PF
    assert ratio.mean() == pytest.approx(1.0, abs=0.03)
    assert ratio.std() < 0.03


def test_ten_bits_with_noise_read_an_image_within_a_percent() -> None:
    frames = driven("column", wired("column", "mcp3008"))
    error = frames[:, 1] / frames[:, 0] - TRUE_Z
    assert np.sqrt(np.mean(error**2)) < 0.01


def test_a_series_capacitor_costs_accuracy() -> None:
    # C_m and a follower, as figure 4b has it: what passes is a quarter, and sags meanwhile.
    wiring = replace(wired("taxel"), circuit=CircuitWiring(row_pf=127.0, reach=0.23))
    frames = driven("coupled", wiring, noise_lsb=0.0)
    error = frames[:, 1] / frames[:, 0] - TRUE_Z
    assert 0.005 < np.sqrt(np.mean(error**2)) < 0.02


def virtual() -> Array:
    """What the virtual orb's read-out makes of the same orbs, pF, like `TRUE_PF`."""
    orbs, _, rows, columns = TRUE_PF.shape
    model = replace(ReadoutModel(), noise_lsb=0.0, mains=0.0)
    shape = (2 * orbs, rows, columns)
    told, _ = read(
        model, TRUE_PF.reshape(shape), np.zeros(shape[:2]), np.zeros(shape), np.array(0.2),
        np.zeros(shape),
    )  # fmt: skip
    return told.reshape(TRUE_PF.shape)


def test_the_virtual_orbs_read_out_says_the_same_but_for_its_ghosts() -> None:
    # controller/simulator/dome/readout.py leaves a share of a row's neighbours in the reading.
    told = virtual()
    error = told[:, 1] / told[:, 0] - TRUE_Z
    assert np.sqrt(np.mean(error**2)) < 0.04
    assert np.abs(error).max() < 0.2
    slope = np.polyfit(TRUE_Z.ravel() - 1.0, (told[:, 1] / told[:, 0]).ravel() - 1.0, 1)[0]
    assert 0.85 < slope < 1.05


def test_the_driver_leaves_as_much_of_the_neighbours_as_the_virtual_orb() -> None:
    wiring = replace(wired("column"), circuit=CircuitWiring())
    frames, told = driven("column", wiring, noise_lsb=0.0), virtual()
    error = frames[:, 1] / frames[:, 0] - told[:, 1] / told[:, 0]
    assert np.abs(error).max() < 0.012
