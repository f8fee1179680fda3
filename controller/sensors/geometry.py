"""Grid and usual rate of a sensor, and its errors."""

from dataclasses import dataclass

from controller.shared.errors import TroubleError, UserError

RATE_HZ = 40.0  # of sensors that no bundle says otherwise for; the paper has 10 (section 4.1)


class SensorError(UserError, ValueError):
    """The sensor cannot be used; the message gives the reason, in one sentence."""


class SensorAwayError(SensorError, TroubleError):
    """The sensor gives no frame now, but may give the next one."""


@dataclass(frozen=True, slots=True)
class Geometry:
    """The grid of taxels; the pitch is the distance of two."""

    rows: int
    columns: int
    pitch_mm: float
