"""The board of a real orb: this computer's pins and its SPI bus."""

import hashlib
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Final

from controller.sensors.hardware.board import Board, Spi
from controller.sensors.hardware.controls import Controls
from controller.sensors.hardware.converters import find
from controller.sensors.hardware.pins import GpioPins, raspberry
from controller.sensors.hardware.spi import SpiDev
from controller.sensors.hardware.wiring import Wiring

_SPIN_S: Final = 200e-6  # sleeping is late by a tenth of a millisecond: short waits are spun


def open_board(wiring: Wiring) -> Board:
    """Return the board, all electrodes grounded.

    Raises:
        HardwareError: A library is missing, or something may not be opened.
        HardwareAwayError: The bus is not there.
    """
    chip, where, electrodes = find(wiring.converter.type), wiring.converter, wiring.electrodes
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
    return Board(wiring, pins, chip, tuple(buses), knobs, wait, time.perf_counter)


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
