"""MPR121 touch controllers on I2C: 1 to 4 chips of 12 electrodes, by smbus2.

Source: NXP, MPR121 data sheet rev. 4 and application notes AN3889, AN3890. A chip charges each
electrode with a current for a time and measures its voltage, so its counts are inverse to C.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recognition.images.frames import Frame
from controller.recognition.images.scale import PICOFARAD
from controller.sensors.base import Sensor, SensorOptions
from controller.sensors.hardware import HardwareAwayError, HardwareError, MissingHardwareError
from controller.sensors.hardware.description import Description, affordable, read
from controller.shared.errors import how_to_install

ELECTRODES: Final = 12  # of a chip
FASTEST_HZ: Final = 100.0
_DATA, _BYTES = 0x04, 26  # filtered data: 10 bits in two bytes, low first, of 13 electrodes
_TIME_US = 0.5  # of the charge, in the settings below
_SETTINGS: Final = (  # register and value, in order
    (0x80, 0x63),  # soft reset: stop mode
    (0x5D, 0x21),  # 0.5 µs; second filter 4 samples, one each 2 ms
    (0x7B, 0x00),  # no automatic configuration, which would change current and time
)
_RUN: Final = (0x5E, 0x40 | ELECTRODES)  # without the chip's own baseline


@dataclass(frozen=True)
class Options(SensorOptions):
    """Options of the chips: their description."""

    wiring: Path | None = None


def create(options: Options, rate_hz: float | None = None) -> "Mpr121":
    """Return the sensor after a first frame, or raise HardwareError."""
    description = read(options.wiring, "mpr121")
    try:
        import smbus2  # an extra
    except ImportError:
        remedy = how_to_install("i2c")
        raise MissingHardwareError(f"--sensor mpr121 needs smbus2; {remedy}") from None
    try:
        bus = smbus2.SMBus(description.bus)
    except OSError as error:
        why = f"cannot open /dev/i2c-{description.bus}: {(error.strerror or str(error)).lower()}"
        raise MissingHardwareError(f"{why}; enable I2C, and join the group i2c") from None
    try:
        sensor = Mpr121(description, bus, rate_hz)
        sensor.read(0.0)
    except BaseException:
        bus.close()
        raise
    return sensor


class Mpr121(Sensor):
    """Chips on a bus, which may be a fake of smbus2.SMBus."""

    hardware = "mpr121"
    description: Description

    def __init__(self, description: Description, bus: Any, rate_hz: float | None = None) -> None:
        """Configure the chips; HardwareError if one does not answer, or has too few electrodes."""
        chips = len(description.addresses)
        if description.length > chips * ELECTRODES:
            raise HardwareError(
                f"the description needs more than the {chips * ELECTRODES} electrodes of its "
                "chips; add addresses, or shorten the grid (orbtouch docs sensors)"
            )
        self.description = replace(description, unit=PICOFARAD, sign="rises")
        self._bus = bus
        self.geometry, self.signal = description.geometry, self.description.signal
        self.device_id = description.name
        self.rate_hz = affordable(description.rate_hz or FASTEST_HZ, rate_hz)
        charge = description.charge_ua
        self._k = 1024 * charge * _TIME_US / description.supply_v  # pF times counts
        for address in description.addresses:
            for register, value in (*_SETTINGS, (0x5C, charge), _RUN):
                self._ask(address, bus.write_byte_data, register, value)

    def read(self, t_s: float) -> Frame:
        """Return the capacitances, (rows, columns), pF; HardwareAwayError if a chip is silent."""
        blocks = [
            self._ask(address, self._bus.read_i2c_block_data, _DATA, _BYTES)
            for address in self.description.addresses
        ]
        pairs = np.array(blocks).reshape(len(blocks), -1, 2)[:, :ELECTRODES]
        counts = (pairs[..., 0] + 256 * pairs[..., 1]).ravel() & 0x3FF
        return self.description.frame((self._k / np.maximum(counts, 1)).astype(np.float32))

    def close(self) -> None:
        """Close the bus."""
        self._bus.close()

    def _ask(self, address: int, call: Any, *words: int) -> Any:
        """Return what the bus returns for a chip, or raise HardwareAwayError."""
        try:
            return call(address, *words)
        except OSError as error:
            raise HardwareAwayError(
                f"no MPR121 answers at {address:#04x} of /dev/i2c-{self.description.bus} "
                f"({(error.strerror or str(error)).lower()}); check wiring and addresses"
            ) from None
