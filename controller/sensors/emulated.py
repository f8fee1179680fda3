"""The virtual orb behind a real orb's driver: mock pins, a fake converter, a simulated circuit.

What `--sensor orb` does on a Raspberry Pi, every computer can try with this: the same wiring, the
same schedule, the same button and pump. It has the virtual orb's hand, and a host may touch it.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from controller.recognition.images.frames import Frame
from controller.sensors import virtual as virtuals
from controller.sensors.geometry import RATE_HZ
from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.emulated.board import EmulatedBoard
from controller.sensors.hardware.emulated.circuit import WiringFault
from controller.sensors.hardware.wiring import read
from controller.sensors.virtual import Virtual
from controller.simulator.dome.faults import Fault, FaultError
from controller.simulator.orb import PresetError, preset

_FLAT = 0.35  # C / C0 of a dome without air: about what docs/simulator.md says of the taxels' mean


@dataclass(frozen=True)
class Options(virtuals.Options):
    """Options of a virtual orb, whose faults may be of its wiring; None is docs/hardware.md's."""

    wiring: Path | None = None


def create(options: Options, rate_hz: float | None = None) -> "Emulated":
    """Return the orb, hand and session of a seed, behind a driver, or raise SensorError."""
    wiring = read(options.wiring)
    names, others = _split(options.fault)
    try:
        model = replace(
            preset(options.preset),
            rows=wiring.rows,
            columns=wiring.columns,
            pitch_mm=wiring.pitch_mm,
        )
        faults = [WiringFault.parse(text, wiring.rows, wiring.columns) for text in names]
    except (PresetError, FaultError) as error:
        raise HardwareError(str(error)) from None
    rate_hz = Driver(EmulatedBoard(wiring, faults=faults).board).affordable(rate_hz or RATE_HZ)
    emulated = Emulated(replace(options, fault=others), rate_hz, model)
    emulated.hardware = " ".join(["virtual orb", *options.fault])
    readout, skin = model.electronics.readout, emulated.skin[0]
    seeds = np.random.SeedSequence([options.seed, 1])
    emulated.attach(EmulatedBoard(wiring, seeds, model=readout, picofarads=skin, faults=faults))
    return emulated


def _split(texts: tuple[str, ...]) -> tuple[list[str], tuple[str, ...]]:
    """Return the faults of the wiring, and those of the virtual orb, or raise HardwareError."""
    kinds = {text: re.split("[:=]", text)[0] for text in texts}
    known = dict.fromkeys([*WiringFault.kinds, *Fault.kinds])
    for text, kind in kinds.items():
        if kind not in known:
            raise HardwareError(f"there is no fault {text!r}; there are {', '.join(known)}")
    wiring = [text for text in texts if kinds[text] in WiringFault.kinds]
    return wiring, tuple(text for text in texts if kinds[text] not in WiringFault.kinds)


class Emulated(Virtual):
    """A virtual orb that is read through a driver.

    Attributes:
        bench: The emulated board.
        driver: The driver of the board.
    """

    bench: EmulatedBoard
    driver: Driver

    def attach(self, bench: EmulatedBoard) -> None:
        """Wire the orb to emulated hardware, before its first frame."""
        self.bench, self.driver = bench, Driver(bench.board)
        self.device_id = f"emulated-{self.seed}"
        self._now_s = 0.0

    def read(self, t_s: float) -> Frame:
        """Return the scan that ends at `t_s`, pF, or raise HardwareAwayError for a fault."""
        super().read(t_s)
        self.bench.breathe(t_s - self._now_s)
        self._now_s = t_s
        skin, fingers = self.skin
        self.bench.touch(skin * self._full(), fingers)
        return self.driver.frame(t_s)

    def button(self, t_s: float) -> str | None:
        """Return the label button's state, which the simulated user presses: "" down, "null" up."""
        self.bench.press(super().button(t_s) != "null")
        return self.driver.button()

    def close(self) -> None:
        """Release the pins."""
        self.driver.close()

    def _full(self) -> float:
        """Return C / C0 of an orb of this pressure, crudely."""
        pump = self.bench.wiring.pump
        return 1.0 if pump is None else _FLAT + (1.0 - _FLAT) * self.bench.kpa / pump.target_kpa
