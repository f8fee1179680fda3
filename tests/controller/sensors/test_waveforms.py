"""The driver against ngspice: sixty random orbs, at rest and touched, by mock pins and SPI bytes.

`tests/reference/waveforms.py` made the data; it shares no line with the driver's formulas.
"""

from dataclasses import replace

import numpy as np
import pytest

from controller.shared.aliases import Array
from tests.reference import waveforms

pytest.importorskip("gpiozero", reason="the driver's pins are gpiozero's mock pins")

from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.wiring import CircuitWiring, Scheme, Wiring
from controller.simulator.dome.readout import ReadoutModel, read
from tests.support.waveform_board import board

pytestmark = pytest.mark.slow


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
    circuit = CircuitWiring(ghosting=0.0)
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
    wiring = replace(wired("taxel"), circuit=CircuitWiring(row_pf=127.0, reach=0.23, ghosting=0.0))
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
