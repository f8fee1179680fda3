"""The board of a real orb: this computer's pins by gpiozero, and its SPI bus by spidev."""

import hashlib
import os
import tempfile
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Final

from controller.sensors.hardware import HardwareAwayError, MissingHardwareError
from controller.sensors.hardware.board import Board, Spi
from controller.sensors.hardware.pins import Controls, GpioPins
from controller.sensors.hardware.wiring import CHIPS, Wiring
from controller.shared.errors import how_to_install

_SPIN_S: Final = 200e-6  # sleeping is late by a tenth of a millisecond: short waits are spun


def open_board(wiring: Wiring) -> Board:
    """Return the board, all electrodes grounded, or raise HardwareError."""
    where, electrodes = wiring.converter, wiring.electrodes
    with ExitStack() as opened:
        pins = GpioPins(raspberry(), (*electrodes.columns, *electrodes.rows))
        opened.callback(pins.close)
        knobs = Controls(pins.factory, wiring)
        opened.callback(knobs.close)
        buses: list[Spi] = []
        for device in where.devices:
            buses.append(SpiDev(where.bus, device, where.clock_hz))
            opened.callback(buses[-1].close)
        opened.pop_all()
    return Board(wiring, pins, CHIPS[where.type], tuple(buses), knobs, wait, time.perf_counter)


def wait(seconds: float) -> None:
    """Wait, exactly."""
    until = time.perf_counter() + seconds
    if seconds > _SPIN_S:
        time.sleep(seconds - _SPIN_S)
    while time.perf_counter() < until:
        pass


def serial() -> str:
    """Return eight digits that tell this computer from others, "" if nothing does."""
    for place in ("/sys/firmware/devicetree/base/serial-number", "/etc/machine-id"):
        with suppress(OSError):
            return hashlib.sha256(Path(place).read_bytes()).hexdigest()[:8]
    return ""


def raspberry() -> Any:
    """Return gpiozero's factory of this computer's pins, or raise MissingHardwareError."""
    # lgpio leaves a pipe in the folder where it is imported.
    os.environ.setdefault("LG_WD", tempfile.gettempdir())
    try:
        import lgpio
        from gpiozero import GPIOZeroError
        from gpiozero.pins.lgpio import LGPIOFactory
    except ImportError as error:
        raise MissingHardwareError(
            f"the orb's pins need {error.name}; {how_to_install('pi')}, or try --sensor emulated"
        ) from None
    try:
        return LGPIOFactory()
    except (GPIOZeroError, OSError, lgpio.error) as error:
        raise MissingHardwareError(
            f"cannot open this computer's pins: {error}; on a Raspberry Pi join the group gpio, "
            "elsewhere try --sensor emulated (orbtouch docs hardware)"
        ) from None


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
                "(orbtouch docs hardware)"
            ) from None
        except OSError as error:
            raise HardwareAwayError(
                f"{where} cannot be opened: {error.strerror or error}; switch SPI on with "
                "raspi-config (orbtouch docs hardware)"
            ) from None

    def transfer(self, data: bytes) -> bytes:
        """Write bytes, and return as many that were read meanwhile, or raise OSError."""
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
