"""The virtual orb behind a real orb's driver: mock pins, a fake converter, a simulated circuit.

What `--sensor orb` does on a Raspberry Pi, every computer can try with this: the same wiring, the
same schedule, the same picofarads. It has the virtual orb's hand, and a host may touch it.
"""

from dataclasses import replace

import numpy as np

from controller.hardware.driver import Driver
from controller.hardware.emulated.bench import Bench, BenchModel
from controller.hardware.wiring import Wiring
from controller.preprocess import Frame
from controller.sensors import SensorOptions
from controller.sensors import virtual as virtuals
from controller.sensors.virtual import Virtual


def create(options: SensorOptions) -> "Emulated":
    """Return the orb, hand and session of a seed, behind a driver.

    Raises:
        SensorError: The preset, a fault or the wiring cannot be used, or gpiozero is missing.
    """
    return Emulated(virtuals.create(options), options.seed)


class Emulated:
    """A `VirtualSensor`, read as a real orb is."""

    virtual = True

    def __init__(self, orb: Virtual, seed: int, wiring: Wiring | None = None) -> None:
        """Wire a virtual orb to emulated hardware."""
        self.orb = orb
        readout = orb.model.electronics.readout
        model = replace(
            BenchModel(),
            noise_lsb=readout.noise_lsb, mains=readout.mains, mains_hz=readout.mains_hz,
            finger_pf=readout.finger_pf,
        )  # fmt: skip
        skin, _ = orb.skin
        seeds = np.random.SeedSequence([seed, 1])
        self.bench = Bench(wiring, seeds, model=model, picofarads=skin)
        self.driver = Driver(self.bench.board)
        self.geometry, self.rate_hz = orb.geometry, orb.rate_hz
        self.device_id = f"emulated-{seed}"
        # All but reading is the virtual orb's.
        self.touch, self.perform, self.truths = orb.touch, orb.perform, orb.truths
        self.button, self.label = orb.button, orb.label

    def read(self, t_s: float) -> Frame:
        """Return the scan that ends at `t_s`, (rows, columns), picofarads."""
        self.orb.read(t_s)
        self.bench.touch(*self.orb.skin)
        return self.driver.frame()

    def close(self) -> None:
        """Release the pins."""
        self.driver.close()
