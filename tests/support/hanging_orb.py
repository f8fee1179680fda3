"""`controller` with a sensor whose `read` hangs while a finger is held.

Whatever the sensor is, it is read, and its frames are replaced by those of a simulated finger that
comes after LANDS_S and stays. After HANGS_AFTER_S `read` hangs for HANG_S; the moment is printed on
standard error as `hangs at T`, on the monotonic clock.

With `--link rfcomm:` a TCP port stands for the radio; `listens at PORT` is printed. With `hid:` and
`usb:` reports go to a host in this process; `held at T` and `released at T` are printed.
"""

import asyncio
import os
import socket
import sys
import threading
import time
from collections.abc import Coroutine
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from controller.__main__ import main
from controller.links import hid, rfcomm, usb
from controller.links.bluetooth import serial_profile
from controller.links.bluetooth.hid.hid_device import HidDevice, HidTransport
from controller.links.bluetooth.hid.reports import GAMEPAD, RELEASED, Report
from controller.recognition.images.frames import Frame
from controller.recognition.images.scale import SKIN
from controller.sensors import base
from controller.sensors.geometry import Geometry
from controller.shared.protocol.messages import Contact
from tests.controller.sensors.test_mpr121 import FakeBus

LANDS_S: Final = 6.0  # a host has come by then
HANGS_AFTER_S: Final = 7.0
HANG_S: Final = 10.0
FINGER: Final = Contact(0, 2.0, 0.5, 9.0, 7.0)  # where it means down, which is held

_load = base.load


class Drum(base.Sensor):
    """A sensor of another package."""

    geometry = Geometry(5, 5, 10.0)
    device_id = "drum-1"

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz

    def read(self, t_s: float) -> Frame:
        return np.full((5, 5), 40.0, np.float32)


def note(event: str, value: float | None = None) -> None:
    """Print an event, and when it was, in one piece: other threads print, too."""
    os.write(2, f"\n{event} at {value or time.monotonic()}\n".encode())


class Host:
    """Host that reads reports of keys."""

    def __init__(self) -> None:
        self.held = False

    def take(self, report: Report) -> None:
        """Print changes between keys that are held and none."""
        if report.id == GAMEPAD and self.held != (report not in RELEASED):
            self.held = not self.held
            note("held" if self.held else "released")


class Gadget:
    """A USB port with a host."""

    configured = True

    def __init__(self, *_: object) -> None:
        self.write = Host().take

    def remove(self) -> None:
        """There is nothing to remove."""


class Radio(HidTransport):
    """Bluetooth with a host that is connected."""

    def __init__(self, device: HidDevice, *_: object, **__: object) -> None:
        super().__init__(device, "Orb")
        self._host = Host()

    async def begin(self, *_: object) -> None:
        self._hid.open(self)
        self._hid.arrive("AA:00:00:00:00:01")

    async def end(self) -> None:
        self._hid.close()

    def send(self, report: Report) -> None:
        self._host.take(report)

    def drop(self, address: str) -> None:
        """The host stays."""

    def _changed(self, *_: object) -> None:
        """Nothing changes."""


class Loop:
    """Thread of a service, without BlueZ."""

    state = "ready"

    def __init__(self, service: Any, *_: object) -> None:
        self._service, self._loop = service, asyncio.new_event_loop()
        service.address = "F1:F1:F1:F1:F1:F1"
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)

    def start(self) -> None:
        self._thread.start()
        if isinstance(self._service, Radio):
            self.submit(self._service.begin())
        else:
            threading.Thread(target=self._listen, daemon=True).start()

    def submit(self, task: Coroutine[Any, Any, Any]) -> None:
        asyncio.run_coroutine_threadsafe(task, self._loop)

    def close(self) -> None:
        if isinstance(self._service, Radio):
            self.submit(self._service.end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def _listen(self) -> None:
        """Hand connections to the service, as BlueZ hands over channels."""
        with socket.create_server(("127.0.0.1", 0)) as listener:
            note("listens", listener.getsockname()[1])
            while True:
                connection, _ = listener.accept()
                connection.setblocking(False)
                self._service.arrive(connection)


class SerialService:
    """The serial port's profile, without BlueZ."""

    def __init__(self, accept: Any, leave: object) -> None:
        self.arrive = lambda connection: accept(connection, "a laptop", "/laptop")


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
            note("hangs")
            time.sleep(HANG_S)
        return finger.read(t_s)

    sensor.signal = SKIN
    changed: Any = sensor
    changed.read = read
    return sensor


if __name__ == "__main__":
    base.load = load
    changes: Any = [(hid, "_transport", Radio), (usb, "Gadget", Gadget)]
    changes += [(module, "RegistrationThread", Loop) for module in (hid, rfcomm)]
    changes += [(serial_profile, "SerialService", SerialService)]
    for module, name, fake in changes:
        setattr(module, name, fake)
    bus: Any = SimpleNamespace(SMBus=lambda number: FakeBus(0x5A, 0x5B, 0x5C))
    sys.modules["smbus2"] = bus
    sys.exit(main(sys.argv[1:]))
