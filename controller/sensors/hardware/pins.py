"""The board's pins, by gpiozero: on a Raspberry Pi through lgpio, in tests on mock pins."""

from collections.abc import Iterable
from contextlib import ExitStack
from typing import Any

from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.wiring import Wiring


class GpioPins:
    """Pins as electrodes: driven to either side, or floating."""

    def __init__(self, factory: Any, pins: Iterable[int]) -> None:
        """Take pins by GPIO numbers, and ground them; gpiozero's factory is closed with them."""
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


class Controls:
    """The label button, the status LED and the pump of a wiring, as far as it has them."""

    def __init__(self, factory: Any, wiring: Wiring) -> None:
        """Take their pins from gpiozero's factory; LED and pump are off."""
        from gpiozero import LED, Button, GPIOZeroError, OutputDevice

        self._button = self._led = self._pump = None
        with ExitStack() as taken:
            try:
                if wiring.button is not None:
                    self._button = Button(wiring.button, pull_up=True, pin_factory=factory)
                    taken.callback(self._button.close)
                if wiring.led is not None:
                    self._led = LED(wiring.led, pin_factory=factory)
                    taken.callback(self._led.close)
                if wiring.pump is not None:
                    self._pump = OutputDevice(wiring.pump.pin, pin_factory=factory)
            except (GPIOZeroError, OSError) as error:
                raise HardwareError(f"cannot use a pin: {error}") from None
            taken.pop_all()

    def pressed(self) -> bool | None:
        """Return whether the label button is down; None: there is none."""
        return None if self._button is None else bool(self._button.is_pressed)

    def light(self, on: bool) -> None:
        """Switch the LED."""
        if self._led is not None:
            self._led.value = int(on)

    def pump(self, on: bool) -> None:
        """Switch the pump."""
        if self._pump is not None:
            self._pump.value = int(on)

    def close(self) -> None:
        """Switch everything off, the pump first."""
        for device in (self._pump, self._led):
            if device is not None:
                device.off()
        for device in (self._pump, self._led, self._button):
            if device is not None:
                device.close()
