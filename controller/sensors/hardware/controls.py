"""Controls around the orb: label button, status LED and pump, by gpiozero."""

from contextlib import ExitStack
from typing import Any

from controller.sensors.hardware import HardwareError
from controller.sensors.hardware.wiring import Wiring


class Controls:
    """The button, the LED and the pump of a wiring, as far as it has them."""

    def __init__(self, factory: Any, wiring: Wiring) -> None:
        """Take their pins; LED and pump are off.

        Args:
            factory: gpiozero's.
            wiring: Which pins.

        Raises:
            HardwareError: A pin is in use by another program.
        """
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
