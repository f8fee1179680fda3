"""Emulated hardware: a driver's picofarads are those of the skin, and faults are felt."""

import gc
import sys
from dataclasses import dataclass, replace
from types import ModuleType
from typing import get_args

import numpy as np
import pytest

pytest.importorskip("gpiozero", reason="the emulated hardware uses gpiozero's mock pins")

from gpiozero.pins.mock import MockFactory

from controller.sensors import base as sensors
from controller.sensors.geometry import SensorAwayError, SensorError
from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.emulated.board import EmulatedBoard
from controller.sensors.hardware.emulated.circuit import KINDS, Circuit, WiringFault
from controller.sensors.hardware.pins import GpioPins
from controller.sensors.hardware.wiring import CircuitWiring, Electrodes, Scheme, Wiring
from controller.shared.protocol.messages import Contact
from controller.simulator.dome.readout import ReadoutModel


def _lit(bench: EmulatedBoard) -> bool:
    """Whether the LED shines."""
    return bench.wiring.led is not None and bench.factory.outputs[bench.wiring.led]


@pytest.mark.parametrize("scheme", get_args(Scheme))
def test_a_driver_reads_what_the_skin_is(scheme: Scheme) -> None:
    bench = EmulatedBoard(Wiring(scheme=scheme, circuit=CircuitWiring()), seed=3)
    driver = Driver(bench.board)
    rest = np.mean([driver.frame() for _ in range(8)], axis=0)
    assert rest == pytest.approx(bench.picofarads, rel=0.05)  # nobody has measured its rows
    pressed = bench.picofarads.copy()
    pressed[2, 2] *= 0.6
    pressed[2, 3] *= 0.9
    z = pressed / bench.picofarads
    bench.touch(pressed)
    image = np.mean([driver.frame() for _ in range(8)], axis=0) / rest
    assert image == pytest.approx(z, abs=0.006)  # what the rows have cancels


def test_every_fault_can_be_switched_on_and_off_again() -> None:
    place = {"taxel": ":1,3", "row": ":1", "rows": ":1", "column": ":3", "columns": ":3", "": ""}
    bench = EmulatedBoard(seed=3)
    for kind, known in KINDS.items():
        fault = WiringFault.parse(kind + place[known.place])
        bench.switch([fault])
        assert bench.faults == (fault,)
        bench.switch([fault], on=False)
    assert Driver(bench.board).frame() == pytest.approx(bench.picofarads, rel=0.08)


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("no_converter", "no mcp3208 answers on SPI 0.0"),
        ("unplugged", "the membrane is plugged in"),
        ("bus_errors", "SPI 0.0 fails: Input/output error"),
    ],
)
@pytest.mark.parametrize("noise_lsb", [1.0, 42.0])  # the presets'
def test_what_is_unplugged_blinks_and_comes_back(fault: str, told: str, noise_lsb: float) -> None:
    bench = EmulatedBoard(seed=3, model=ReadoutModel(noise_lsb=noise_lsb))
    driver = Driver(bench.board)
    before = driver.frame(0.0)
    assert _lit(bench)
    bench.switch([WiringFault.parse(fault)])
    lit = []
    for k in range(4):
        with pytest.raises(SensorAwayError, match=told):
            driver.frame(0.1 * k)
        lit.append(_lit(bench))
    assert lit == [False, True, False, True]
    bench.switch(bench.faults, on=False)
    for _ in range(2):  # a plug bounces
        with pytest.raises(SensorAwayError, match="coming back"):
            driver.frame(0.9)
    assert driver.frame(1.0) == pytest.approx(before, rel=0.03 if noise_lsb < 2.0 else 0.5)
    assert _lit(bench)


def test_the_label_button_is_down_up_or_not_there() -> None:
    bench = EmulatedBoard(seed=3)
    driver = Driver(bench.board)
    for down, told in ((False, "null"), (True, ""), (False, "null")):
        bench.press(down)
        assert driver.button() == told
    assert Driver(EmulatedBoard(replace(Wiring(), button=None)).board).button() is None


@pytest.mark.slow
def test_the_pump_inflates_the_orb_and_stops() -> None:
    bench = EmulatedBoard(seed=3)
    bench.kpa = 0.0
    driver = Driver(bench.board)
    pumped = []
    for k in range(150):
        driver.frame(k / 10)
        pumped.append(bench.pumping)
        bench.breathe(0.1)
    assert pumped[:60] == [True] * 60
    assert not pumped[-1]
    assert driver.pressure_kpa == pytest.approx(bench.kpa, abs=0.02)
    assert 2.1 < bench.kpa < 2.3


def test_a_driver_that_ends_leaves_pump_and_led_off() -> None:
    bench = EmulatedBoard(seed=3)
    bench.kpa = 1.0
    driver = Driver(bench.board)
    driver.frame(0.0)
    assert (bench.pumping, _lit(bench)) == (True, True)
    driver.close()
    assert (bench.pumping, _lit(bench)) == (False, False)


def test_two_things_on_one_pin_are_refused_by_the_board() -> None:
    factory = MockFactory()
    taken = GpioPins(factory, (5, 6))
    with pytest.raises(HardwareError, match="cannot use GPIO 6"):
        GpioPins(factory, (4, 6))
    taken.close()


COARSE = replace(Wiring(), converter=replace(Wiring().converter, type="mcp3008"))
LARGE = replace(
    Wiring(),
    electrodes=Electrodes(
        (4, 5, 6, 12, 13, 19, 26), (14, 15, 16, 17, 18, 20, 21, 22, 23),
        (0, 1, 2, 3, 4, 8, 9, 10, 11),
    ),
    converter=replace(Wiring().converter, devices=(0, 1)),
    button=None, led=None, pump=None,
)  # fmt: skip


@pytest.mark.parametrize("wiring", [COARSE, LARGE])
def test_ten_bits_and_two_converters_will_do(wiring: Wiring) -> None:
    bench = EmulatedBoard(wiring, seed=3)
    driver = Driver(bench.board)
    frame = np.mean([driver.frame() for _ in range(8)], axis=0)
    assert frame == pytest.approx(bench.picofarads, rel=0.06)


def test_the_emulated_orb_is_the_virtual_orb_behind_a_driver() -> None:
    pressed, plain = (sensors.load(n, 10.0, seed=7) for n in ("emulated", "virtual"))
    images = []
    for sensor in (pressed, plain):
        sensor.touch((Contact(0, 1.0, 3.0, 9.0, 7.0),), 2.0)
        frames = np.array([sensor.read(k / 10) for k in range(1, 31)])
        images.append(frames[-3:].mean(axis=0) / frames[:18].mean(axis=0))
        sensor.close()
    assert np.unravel_index(images[0].argmin(), (5, 5)) == (1, 1)
    assert images[0] == pytest.approx(images[1], abs=0.03)


def test_a_fault_of_the_skin_and_one_of_the_wiring_can_be_asked_for_together() -> None:
    spec = "emulated:fault=dead:1,1,fault=open_row:3,fault=air_leak=0.2"
    emulated = sensors.load(spec, 10.0)
    frame = np.mean([emulated.read(k / 10) for k in range(1, 8)], axis=0)
    assert (frame[3] < 2.0).all()
    assert frame[1, 1] < 2.0
    assert (np.delete(frame, (1, 3), axis=0) > 20.0).all()


def test_pins_collected_as_garbage_leave_the_circuit_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Collection may come at any moment, when NumPy must not run (see `CircuitPin.close`)."""
    driver = Driver(EmulatedBoard(seed=1).board)
    driver.frame()

    def touched(*arguments: object) -> None:
        raise AssertionError("the circuit was computed")

    for name in ("drive", "release", "advance"):
        monkeypatch.setattr(Circuit, name, touched)
    del driver
    gc.collect()


def test_a_sensor_with_an_option_of_its_own_is_one_file(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True)
    class Options(sensors.SensorOptions):
        gain: float = 1.0

    def create(options: Options, rate_hz: float | None) -> tuple[float, float | None]:
        return options.gain, rate_hz

    module = ModuleType("controller.sensors.plate")
    module.__dict__.update(Options=Options, create=create)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(sensors, "names", lambda: ["plate"])
    # The seed is of no use for a plate.
    assert sensors.load("plate:gain=2.5", 20.0, seed=3) == (2.5, 20.0)  # type: ignore[comparison-overlap]
    with pytest.raises(SensorError, match="plate has no option 'size'; it has gain"):
        sensors.load("plate:size=3")
    with pytest.raises(SensorError, match="plate:gain=much needs a value of the type float"):
        sensors.load("plate:gain=much")
