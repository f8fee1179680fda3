"""gpiozero's mock pins, soldered to the emulated circuit."""

from typing import Any

from gpiozero.pins.mock import MockFactory, MockPin

from controller.sensors.hardware.emulated.circuit import Circuit


class CircuitPin(MockPin):  # type: ignore[misc]  # gpiozero has no types
    """A mock pin whose electrode follows it, and whose level is the electrode's."""

    def close(self) -> None:
        """Let go of the pin, without letting time pass in the circuit.

        gpiozero closes a device when it is collected as garbage, at any moment. NumPy must not
        run then: Python 3.11 crashes if a collection that comes in the middle of a change of a
        context variable, as NumPy's error state is one, changes that variable.
        """
        self.when_changed = None
        self._function = "input"

    def _get_state(self) -> Any:
        number = self._gpio()
        if self._function == "input" and self.factory.holds(number):
            return self.factory.circuit.volts(number) > self.factory.circuit.supply_v / 2
        return super()._get_state()

    def _set_state(self, value: Any) -> None:
        super()._set_state(value)
        self.factory.driven(self._gpio(), bool(value))

    def _set_function(self, value: Any) -> None:
        super()._set_function(value)
        if value == "output":
            self.factory.driven(self._gpio(), bool(self._state))
        else:
            self.factory.released(self._gpio())

    def _gpio(self) -> int:
        return int(self.info.name.removeprefix("GPIO"))


class CircuitFactory(MockFactory):  # type: ignore[misc]
    """Makes mock pins of a board whose electrodes are a circuit's.

    Attributes:
        circuit: Whose.
        outputs: What all other pins were last set to.
    """

    def __init__(self, circuit: Circuit, electrodes: frozenset[int], pin_s: float) -> None:
        """Solder the electrodes' pins to a circuit; a change of one takes `pin_s`."""
        super().__init__(pin_class=CircuitPin)
        self.circuit, self.outputs, self.pin_s = circuit, dict[int, bool](), pin_s
        self._electrodes = electrodes

    def holds(self, pin: int) -> bool:
        """Return whether a pin is an electrode."""
        return pin in self._electrodes

    def driven(self, pin: int, high: bool) -> None:
        """Let a pin drive, and time pass."""
        if self.holds(pin):
            self.circuit.drive(pin, high)
            self.circuit.advance(self.pin_s)
        else:
            self.outputs[pin] = high

    def released(self, pin: int) -> None:
        """Let a pin float, and time pass."""
        if self.holds(pin):
            self.circuit.release(pin)
            self.circuit.advance(self.pin_s)
