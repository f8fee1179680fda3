"""The virtual orb behind a real orb's driver: mock pins, a fake converter, a simulated circuit.

What `--sensor orb` does on a Raspberry Pi, every computer can try with this: the same wiring, the
same schedule, the same button and pump. It has the virtual orb's hand, and a host may touch it.
"""

from dataclasses import replace

import numpy as np

from controller.recognition.frames import Frame
from controller.sensors import virtual as virtuals
from controller.sensors.base import SensorOptions
from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.emulated.board import BoardModel, EmulatedBoard
from controller.sensors.hardware.emulated.faults import KINDS, WiringFault
from controller.sensors.hardware.wiring_file import read, shipped
from controller.sensors.orb import refuse_haste
from controller.sensors.virtual import RATE_HZ, Virtual
from controller.simulator.faults import KINDS as SKIN_KINDS
from controller.simulator.presets import PresetError, preset

_FLAT = 0.35  # C / C0 of a dome without air: about what docs/simulator.md says of the taxels' mean


def create(options: SensorOptions) -> "Emulated":
    """Return the orb, hand and session of a seed, behind a driver.

    Raises:
        SensorError: The preset, a fault or the wiring cannot be used, or gpiozero is missing.
    """
    wiring = shipped() if options.wiring is None else read(options.wiring)
    rate_hz = options.rate_hz or RATE_HZ
    refuse_haste(wiring, rate_hz)
    names, others = _sorted(options.faults)
    try:
        model = replace(
            preset(options.preset),
            rows=wiring.rows, columns=wiring.columns, pitch_mm=wiring.pitch_mm,
        )  # fmt: skip
    except PresetError as error:
        raise HardwareError(str(error)) from None
    orb = virtuals.create(replace(options, faults=others), model)
    faults = [WiringFault.parse(text, wiring.rows, wiring.columns) for text in names]
    readout = model.electronics.readout
    around = replace(
        BoardModel(),
        noise_lsb=readout.noise_lsb, mains=readout.mains, mains_hz=readout.mains_hz,
        finger_pf=readout.finger_pf,
    )  # fmt: skip
    seeds = np.random.SeedSequence([options.seed, 1])
    bench = EmulatedBoard(wiring, seeds, model=around, picofarads=orb.skin[0], faults=faults)
    return Emulated(orb, bench, f"emulated-{options.seed}")


def _sorted(faults: tuple[str, ...]) -> tuple[list[str], tuple[str, ...]]:
    """Return faults of the wiring, and those of the virtual orb.

    Raises:
        HardwareError: One is neither.
    """
    wiring: list[str] = []
    skin: list[str] = []
    for text in faults:
        name = text.partition(":")[0].partition("=")[0]
        if name not in KINDS and name not in SKIN_KINDS:
            known = ", ".join(dict.fromkeys([*KINDS, *SKIN_KINDS]))
            raise HardwareError(f"there is no fault {text!r}; there are {known}")
        (wiring if name in KINDS else skin).append(text)
    return wiring, tuple(skin)


class Emulated:
    """A `VirtualSensor`, read as a real orb is.

    Attributes:
        orb: Its skin and its hand.
        bench: What it is wired to.
        driver: Reads it.
    """

    virtual = True

    def __init__(self, orb: Virtual, bench: EmulatedBoard, device_id: str) -> None:
        """Wire a virtual orb to emulated hardware."""
        self.orb, self.bench, self.driver = orb, bench, Driver(bench.board)
        self.geometry, self.rate_hz = orb.geometry, orb.rate_hz
        self.device_id = device_id
        self._now_s = 0.0
        # All but reading is the virtual orb's.
        self.touch, self.perform, self.truths = orb.touch, orb.perform, orb.truths
        self.label = orb.label

    def read(self, t_s: float) -> Frame:
        """Return the scan that ends at `t_s`, (rows, columns), picofarads.

        Raises:
            HardwareAwayError: A fault keeps the driver from reading.
        """
        self.orb.read(t_s)
        self.bench.breathe(t_s - self._now_s)
        self._now_s = t_s
        skin, fingers = self.orb.skin
        self.bench.touch(skin * self._full(), fingers)
        return self.driver.frame(t_s)

    def button(self, t_s: float) -> str | None:
        """Return what the label button says, which the hand's owner presses: "" down, "null" up."""
        self.bench.press(self.orb.button(t_s) != "null")
        return self.driver.button()

    def close(self) -> None:
        """Release the pins."""
        self.driver.close()

    def _full(self) -> float:
        """Return C / C0 of an orb of this pressure, crudely."""
        pump = self.bench.wiring.pump
        return 1.0 if pump is None else _FLAT + (1.0 - _FLAT) * self.bench.kpa / pump.target_kpa
