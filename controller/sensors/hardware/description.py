"""Description of a sensor in a TOML file: where it is read, its grid, and what its readings are.

One form for all sensors but the orb's own (`controller.sensors.hardware.wiring`).
"""

from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import tomli_w
from numpy.typing import NDArray

from controller.recognition.images.frames import Frame
from controller.recognition.images.scale import SIGNS, Signal
from controller.recordings.recording import MAX_TAXELS
from controller.sensors.geometry import RATE_HZ, Geometry, SensorError
from controller.sensors.hardware.wiring import located, named, number, numbers
from controller.shared import config
from controller.shared.config import ConfigError

UNNAMED: Final = "skin"  # of sensors whose description gives no name
_SLOWEST: Final = 0.85  # of the rate that is asked for: beyond that too many frames come twice


@dataclass(frozen=True, slots=True)
class Description:
    """A sensor; `docs/sensors.md` explains the entries."""

    name: str = named(UNNAMED)  # what it is called, in recordings and to hosts
    port: str = ""  # of `lines`: a serial port, or tcp:HOST:PORT
    baud: int = number(115_200, 300, 4_000_000)  # of a serial port
    bus: int = number(1, 0, 255)  # of a sensor on I2C: N of /dev/i2c-N
    addresses: tuple[int, ...] = numbers((0x5A,), 0x7F, 4)  # of its chips, in order
    supply_v: float = number(3.3, 1.0, 5.5)  # of its chips
    charge_ua: int = number(16, 1, 63)  # current that charges an electrode of MPR121
    rows: int = number(0, 1, MAX_TAXELS)
    columns: int = number(0, 1, MAX_TAXELS)
    pitch_mm: float = number(10.0, 0.1, 1000.0)  # distance of two taxels
    rate_hz: float = number(0.0, 0.1, 1000.0)  # frames per second; 0: to be measured
    values: int = number(0, 1, MAX_TAXELS)  # of a frame as it is read; 0: one a taxel
    # the value, from 0, that each taxel is read from, row by row; (): as they come
    order: tuple[int, ...] = numbers((), MAX_TAXELS - 1, MAX_TAXELS)
    sign: Literal["falls", "rises"] = "falls"  # what the readings do under a touch
    unit: str = field(default="counts", metadata={"pattern": "[ -~µ]{1,16}"})  # of the readings
    # a firm touch in the unit: mean change of all taxels / 0.08; 0: learned from the first touches
    scale: float = number(0.0, 1e-6, 1e9)

    @property
    def geometry(self) -> Geometry:
        """The grid."""
        return Geometry(self.rows, self.columns, self.pitch_mm)

    @property
    def signal(self) -> Signal:
        """What the readings are."""
        return Signal(self.unit, SIGNS[self.sign], self.scale)

    @property
    def length(self) -> int:
        """Values of a frame as it is read; 0 if unknown."""
        return self.values or max(self.rows * self.columns, *(one + 1 for one in self.order), 0)

    def frame(self, values: NDArray[np.float32]) -> Frame:
        """Return values as they are read, (length,), in the places of their taxels."""
        taxels = self.rows * self.columns
        chosen = values[list(self.order)] if self.order else values[:taxels]
        return np.asarray(chosen, dtype=np.float32).reshape(self.rows, self.columns)

    def gridded(self, values: int) -> "Description":
        """Return the same, with a grid for so many values if it has none: a square, or one row."""
        side = round(values**0.5)
        if self.rows:
            return self
        grid = (side, side) if side * side == values else (1, values)
        return replace(self, rows=grid[0], columns=grid[1])

    def text(self) -> str:
        """Return the entries that are not the usual ones, as TOML."""
        return tomli_w.dumps(
            {
                one.name: list(value) if isinstance(value, tuple) else value
                for one in fields(self)
                if (value := getattr(self, one.name)) != one.default
            }
        )


def affordable(fastest_hz: float, wanted_hz: float | None) -> float:
    """Return the rate at which a sensor of a rate is read: as wanted, or what comes close.

    The clocks of the sensor and of the loop differ, so some frames may be read twice.
    """
    return min(wanted_hz or RATE_HZ, fastest_hz / _SLOWEST)


def read(path: Path | None, sensor: str) -> Description:
    """Return the description in a file, or raise SensorError."""
    if path is None:
        raise SensorError(
            f"--sensor {sensor} needs a description: {sensor}:wiring=FILE.toml or builtin:NAME "
            "(orbtouch docs sensors)"
        )
    return config.checked(located(path), _description, SensorError, "orbtouch docs sensors")


def _description(table: dict[str, Any]) -> Description:
    """Return a description, or raise ConfigError: its size is missing, or taxels have no value."""
    found = config.settings(Description, table)
    taxels = found.rows * found.columns
    if not taxels:
        raise ConfigError("needs rows and columns, the size of the grid", "", "rows")
    if taxels > MAX_TAXELS:
        raise ConfigError(f"has {taxels} taxels; {MAX_TAXELS} are allowed", "", "rows")
    if found.order and len(found.order) != taxels:
        words = f"has an order of {len(found.order)} values for {taxels} taxels"
        raise ConfigError(words, "", "order")
    least = max(found.order, default=taxels - 1) + 1
    if found.values and found.values < least:
        words = f"has values = {found.values}, but its taxels need {least}"
        raise ConfigError(words, "", "values")
    return found
