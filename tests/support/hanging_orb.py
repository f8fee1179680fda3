"""`controller` with a sensor whose `read` hangs while a finger is held.

Whatever the sensor is, it is read, and its frames are replaced by those of a simulated finger that
comes after LANDS_S and stays. After HANGS_AFTER_S `read` hangs for HANG_S; the moment is printed on
standard error as `hangs at T`, on the monotonic clock.
"""

import sys
import time
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from controller.__main__ import main
from controller.protocol.messages import Contact
from controller.recognition.frames import Frame
from controller.recognition.scale import SKIN
from controller.sensors import base
from tests.controller.sensors.test_mpr121 import FakeBus

LANDS_S: Final = 6.0  # a host has come by then
HANGS_AFTER_S: Final = 7.0
HANG_S: Final = 10.0
FINGER: Final = Contact(0, 2.0, 0.5, 9.0, 7.0)  # where it means down, which is held

_load = base.load


class Drum(base.Sensor):
    """A sensor of another package."""

    geometry = base.Geometry(5, 5, 10.0)
    device_id = "drum-1"

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz

    def read(self, t_s: float) -> Frame:
        return np.full((5, 5), 40.0, np.float32)


def load(spec: str, rate_hz: float | None = None, **given: object) -> base.Sensor:
    """Return a sensor as `controller.sensors.base.load`, with another `read`."""
    if spec == "drum":  # as of another package
        sensor: base.Sensor = Drum(rate_hz or 40.0)
    else:
        sensor = _load(spec, rate_hz, **given)
    finger, own, state = _load("virtual", sensor.rate_hz, seed=1), sensor.read, {"hung": False}

    def read(t_s: float) -> Frame:
        own(t_s)
        finger.touch((FINGER,) if t_s >= LANDS_S else (), t_s)
        if t_s >= HANGS_AFTER_S and not state["hung"]:
            state["hung"] = True
            print(f"hangs at {time.monotonic()}", file=sys.stderr, flush=True)
            time.sleep(HANG_S)
        return finger.read(t_s)

    sensor.signal = SKIN
    changed: Any = sensor
    changed.read = read
    return sensor


if __name__ == "__main__":
    base.load = load
    fake: Any = SimpleNamespace(SMBus=lambda number: FakeBus(0x5A, 0x5B, 0x5C))
    sys.modules["smbus2"] = fake
    sys.exit(main(sys.argv[1:]))
