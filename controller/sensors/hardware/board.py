"""The hardware that a scan needs: pins, converters and a clock. Real or emulated, all alike."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from controller.sensors.hardware import HardwareAwayError
from controller.sensors.hardware.pins import Controls, GpioPins
from controller.sensors.hardware.wiring import CHANNELS, Chip, Wiring


class Spi(Protocol):
    """One chip on an SPI bus."""

    def transfer(self, data: bytes) -> bytes:
        """Write bytes, and return as many that were read meanwhile, or raise OSError."""

    def close(self) -> None:
        """Release the bus."""


@dataclass(frozen=True, slots=True)
class Board:
    """One orb's hardware, open."""

    wiring: Wiring  # what hangs on it
    pins: GpioPins  # its pins
    chip: Chip  # the type of its converters
    buses: tuple[Spi, ...]  # one a converter
    knobs: Controls  # button, LED and pump
    wait: Callable[[float], None]  # waits for so many seconds
    clock: Callable[[], float]  # seconds that never go back

    def convert(self, channel: int) -> int:
        """Return one conversion, counts, by a channel of all, or raise HardwareAwayError."""
        which, input_ = divmod(channel, CHANNELS)
        try:
            answer = self.buses[which].transfer(self.chip.request(input_))
        except OSError as error:
            words = f"{self._device(which)} fails: {error.strerror or error}"
            raise HardwareAwayError(words) from None
        count = self.chip.decode(answer)
        if count is None:
            raise HardwareAwayError(
                f"no {self.wiring.converter.type} answers on {self._device(which)}; check its "
                "supply and leads"
            )
        return count

    def close(self) -> None:
        """Ground all electrodes, and release everything."""
        self.knobs.close()
        for bus in self.buses:
            bus.close()
        self.pins.close()

    def _device(self, which: int) -> str:
        """Return what one converter's bus is called."""
        where = self.wiring.converter
        return f"SPI {where.bus}.{where.devices[which]}"
