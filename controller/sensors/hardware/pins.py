"""The board's pins, by gpiozero: on a Raspberry Pi through lgpio, in tests on mock pins."""

import os
import tempfile
from collections.abc import Iterable
from typing import Any

from controller.errors import how_to_install
from controller.sensors.hardware import HardwareError, MissingHardwareError


class GpioPins:
    """Pins as electrodes: driven to either side, or floating."""

    def __init__(self, factory: Any, pins: Iterable[int]) -> None:
        """Take pins, and ground them.

        Args:
            factory: gpiozero's, closed with us.
            pins: GPIO numbers.

        Raises:
            HardwareError: A pin does not exist, or is in use by another program.
        """
        from gpiozero import GPIODevice, GPIOZeroError

        self.factory = factory
        self._devices: list[Any] = []
        self._pins: dict[int, Any] = {}
        try:
            for number in pins:
                device = GPIODevice(number, pin_factory=factory)
                self._devices.append(device)
                self._pins[number] = device.pin
                device.pin.output_with_state(0)
        except (GPIOZeroError, OSError) as error:
            self.close()
            raise HardwareError(f"cannot use GPIO {number}: {error}") from None

    def drive(self, pin: int, high: bool) -> None:
        """Make it an output: to the supply, or to ground."""
        here = self._pins[pin]
        if here.function == "output":
            here.state = int(high)
        else:
            here.output_with_state(int(high))

    def release(self, pin: int) -> None:
        """Make it an input without any pull: the pin floats."""
        self._pins[pin].input_with_pull("floating")

    def level(self, pin: int) -> bool:
        """Return whether it is high, from any driver."""
        return bool(self._pins[pin].state)

    def close(self) -> None:
        """Release all: they float, or rest on their pulls."""
        for device in self._devices:
            device.close()
        self.factory.close()


def raspberry() -> Any:
    """Return gpiozero's factory of this computer's pins.

    Raises:
        MissingHardwareError: A library is missing, or this computer's pins cannot be had.
    """
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
            "elsewhere try --sensor emulated (docs/hardware.md)"
        ) from None
