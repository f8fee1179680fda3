"""A host that has nothing of ours: BlueZ and the kernel's input devices, as a desktop uses them.

`Desktop` is a host over GATT, whose every part is BlueZ's.
"""

from __future__ import annotations

import asyncio
import contextlib
import select
import time
from collections.abc import Coroutine
from typing import Any

from controller.links.bluetooth.bluez import (  # fmt: skip
    DEVICE,
    BluetoothError,
    Bus,
    Objects,
    Properties,
    devices,
    variant,
)

from .guest import ANSWER_S, CaseError, Guest

HOST = "/org/bluez/hci0"
ORB = "/org/bluez/hci1"
ADAPTER = "org.bluez.Adapter1"
PAIR_S = 60.0
_ASKED, _PATIENCE_S = 4, 10.0


class Desktop:
    """The host on hci0, over GATT."""

    def __init__(self, guest: Guest) -> None:
        """Connect to BlueZ."""
        self.guest = guest
        self.host, self.orb = guest.addresses
        self._loop = asyncio.new_event_loop()
        self._bus = self._do(Bus.connect())

    def find(self) -> None:
        """Look for the orb."""
        self._do(self._bus.set(HOST, ADAPTER, "Powered", "b", True))
        looks = {"Transport": variant("s", "le")}
        self._do(self._bus.call(HOST, ADAPTER, "SetDiscoveryFilter", "a{sv}", looks))
        self._do(self._bus.call(HOST, ADAPTER, "StartDiscovery"))
        self.guest.until(lambda: self.path, "the orb to be found")
        with contextlib.suppress(BluetoothError):  # it may be about to stop by itself
            self._do(self._bus.call(HOST, ADAPTER, "StopDiscovery"))

    def pair(self) -> None:
        """Pair with the orb and trust it."""
        self._do(self._bus.call(self.path, DEVICE, "Pair", timeout_s=PAIR_S))
        self._do(self._bus.set(self.path, DEVICE, "Trusted", "b", True))

    def connect(self) -> None:
        """Ask for the orb, if it is not there already."""
        with contextlib.suppress(BluetoothError):
            self._do(self._bus.call(self.path, DEVICE, "Connect", timeout_s=PAIR_S))

    def drop(self) -> None:
        """Let the orb's side drop the link, as when it is carried away."""
        path = f"{ORB}/dev_{self.host.replace(':', '_')}"
        self._do(self._bus.call(path, DEVICE, "Disconnect"))

    @property
    def path(self) -> str:
        """The orb's object, "" if it is not known."""
        found = devices(self._objects(), HOST)
        return next((path for path, it in found.items() if it["Address"] == self.orb), "")

    @property
    def known(self) -> Properties:
        """What BlueZ knows of the orb, its battery included."""
        interfaces = self._objects().get(self.path, {})
        return {**interfaces.get(DEVICE, {}), **interfaces.get("org.bluez.Battery1", {})}

    def settled(self) -> bool:
        """Return whether BlueZ has looked at everything that the orb offers."""
        return bool(self.known.get("ServicesResolved"))

    def inputs(self) -> dict[str, Any]:
        """Return the kernel's devices that the orb has become: "keyboard" and "pad"; {}: none."""
        import evdev

        found = {}
        for place in evdev.list_devices():
            with contextlib.suppress(OSError):
                device = evdev.InputDevice(place)
                if device.info.bustype == evdev.ecodes.BUS_BLUETOOTH:
                    codes = device.capabilities().get(evdev.ecodes.EV_KEY, [])
                    found["keyboard" if evdev.ecodes.KEY_LEFT in codes else "pad"] = device
        return found if {"keyboard", "pad"} <= set(found) else {}

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()
        self._do(self._bus.lost())
        self._loop.close()

    def _objects(self) -> Objects:
        """Return all that BlueZ knows.

        In a crowded virtual machine bluetoothd has left one connection without an answer while it
        answered others; so it is asked again on a new one.
        """
        for _ in range(_ASKED):
            try:
                found: Objects = self._do(asyncio.wait_for(self._bus.objects(), _PATIENCE_S))
                return found
            except (BluetoothError, TimeoutError):
                self._bus.close()
                self._bus = self._do(Bus.connect())
        raise CaseError("bluetoothd does not answer")

    def _do(self, task: Coroutine[Any, Any, Any]) -> Any:
        return self._loop.run_until_complete(task)


def events(device: Any, count: int, timeout_s: float = ANSWER_S) -> list[tuple[float, str, int]]:
    """Return the next events of keys, buttons and axes: (kernel's time, name, value)."""
    import evdev

    found: list[tuple[float, str, int]] = []
    end_s = time.monotonic() + timeout_s
    while len(found) < count:
        if not select.select([device.fd], [], [], max(0.0, end_s - time.monotonic()))[0]:
            raise CaseError(f"{device.path} told {found}, not {count} events")
        for event in device.read():
            if event.type in (evdev.ecodes.EV_KEY, evdev.ecodes.EV_ABS):
                names = evdev.ecodes.bytype[event.type][event.code]
                name = names if isinstance(names, str) else names[0]
                found.append((event.timestamp(), name, event.value))
    return found


def until_told(device: Any, name: str, value: int) -> None:
    """Return when a device has told something."""
    while all(event[1:] != (name, value) for event in events(device, 1)):
        pass


def drain(device: Any) -> None:
    """Forget the events that are there."""
    with contextlib.suppress(BlockingIOError):
        list(device.read())
