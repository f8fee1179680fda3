"""Hardware of a real orb: pins, converter, pump, and the circuit from picofarads to counts.

Pure: wiring, description, inversion, and in `driver` the pump. Edges: pins
(gpiozero), raspberry_pi (spidev). `emulated` puts a simulated circuit in place of the edges.
"""

from controller.sensors.geometry import SensorAwayError, SensorError
from controller.shared.errors import TroubleError


class HardwareError(SensorError):
    """The hardware cannot be used; the message says why and what to do, in one sentence."""


class MissingHardwareError(HardwareError, TroubleError):
    """This computer lacks a library, a device or a permission that the hardware needs."""


class HardwareAwayError(HardwareError, SensorAwayError):
    """The hardware does not answer now; it may again later."""
