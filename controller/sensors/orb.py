"""A real orb on this computer's pins: paper, section 3.2; docs/hardware.md."""

from dataclasses import dataclass
from pathlib import Path

from controller.recognition.images.frames import Frame
from controller.sensors.base import Sensor, SensorOptions
from controller.sensors.geometry import RATE_HZ, Geometry
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.raspberry_pi import open_board, serial
from controller.sensors.hardware.wiring import read


@dataclass(frozen=True)
class Options(SensorOptions):
    """Options of the orb: how it is wired; None: as docs/hardware.md draws it."""

    wiring: Path | None = None


def create(options: Options, rate_hz: float | None = None) -> "Orb":
    """Return the orb of a wiring, after a first frame.

    HardwareError if it cannot be opened; HardwareAwayError if nothing answers.
    """
    wiring = read(options.wiring)
    driver = Driver(open_board(wiring))
    try:
        driver.frame()  # whatever is missing is missed now
        rate_hz = driver.affordable(rate_hz or RATE_HZ)
    except BaseException:
        driver.close()
        raise
    number = serial()
    return Orb(driver, rate_hz, f"{wiring.name}-{number}" if number else wiring.name)


class Orb(Sensor):
    """A board with its driver, at a rate."""

    hardware = "orb"
    driver: Driver

    def __init__(self, driver: Driver, rate_hz: float, device_id: str) -> None:
        wiring = driver.board.wiring
        self.driver, self.rate_hz, self.device_id = driver, rate_hz, device_id
        self.geometry = Geometry(wiring.rows, wiring.columns, wiring.pitch_mm)

    def read(self, t_s: float) -> Frame:
        """Return a scan, (rows, columns), picofarads, or raise HardwareAwayError."""
        return self.driver.frame(t_s)

    def button(self, t_s: float) -> str | None:
        """Return what the label button says: "" down, "null" up; None: there is none."""
        return self.driver.button()

    def close(self) -> None:
        """Stop the pump and release the pins."""
        self.driver.close()
