"""The SPI bus, by spidev."""

from typing import Any

from controller.errors import how_to_install
from controller.sensors.hardware import HardwareAwayError, MissingHardwareError


class SpiDev:
    """One chip on a bus of this computer; a bus that has gone is looked for again."""

    def __init__(self, bus: int, device: int, clock_hz: int) -> None:
        """Open it.

        Raises:
            MissingHardwareError: The library is missing, or the bus may not be opened.
            HardwareAwayError: There is no such bus.
        """
        try:
            import spidev
        except ImportError:
            raise MissingHardwareError(
                f"the converter needs spidev; {how_to_install('pi')}, or try --sensor emulated"
            ) from None
        self._make, self._at, self._clock_hz = spidev.SpiDev, (bus, device), clock_hz
        self._spi: Any = None
        where = f"/dev/spidev{bus}.{device}"
        try:
            self._open()
        except PermissionError:
            raise MissingHardwareError(
                f"{where} may not be opened; add yourself to the group spi and log in anew "
                "(docs/hardware.md)"
            ) from None
        except OSError as error:
            raise HardwareAwayError(
                f"{where} cannot be opened: {error.strerror or error}; switch SPI on with "
                "raspi-config (docs/hardware.md)"
            ) from None

    def transfer(self, data: bytes) -> bytes:
        """Write bytes, and return as many that were read meanwhile.

        Raises:
            OSError: The bus fails.
        """
        if self._spi is None:
            self._open()
        try:
            return bytes(self._spi.xfer2(list(data)))
        except OSError:
            self.close()
            raise

    def close(self) -> None:
        """Release the bus."""
        spi, self._spi = self._spi, None
        if spi is not None:
            spi.close()

    def _open(self) -> None:
        spi = self._make()
        spi.open(*self._at)
        spi.max_speed_hz, spi.mode = self._clock_hz, 0
        self._spi = spi
