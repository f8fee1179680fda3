"""A host that has nothing of ours: BlueZ and the kernel's input devices, as a desktop uses them."""

from __future__ import annotations

import asyncio
import contextlib
import select
import time
from collections.abc import Coroutine
from typing import Any

from controller.bluetooth.bluez import DEVICE, BluetoothError, Bus, Properties, devices, variant

from .guest import CaseError, Guest

ADAPTER = "/org/bluez/hci0"
PAIR_S = 60.0


class Desktop:
    """The host on hci0."""

    def __init__(self, guest: Guest, orb: str, transport: str) -> None:
        """Connect to BlueZ.

        Args:
            guest: Where this runs.
            orb: The orb's address.
            transport: "le" or "bredr".
        """
        self._guest, self._orb, self._transport = guest, orb, transport
        self._loop = asyncio.new_event_loop()
        self._bus = self._do(Bus.connect())

    def pair(self) -> Properties:
        """Find the orb, pair with it, trust it and connect; return what BlueZ knows of it."""
        self._do(self._bus.set(ADAPTER, "org.bluez.Adapter1", "Powered", "b", True))
        looks = {"Transport": variant("s", self._transport)}
        self._do(
            self._bus.call(ADAPTER, "org.bluez.Adapter1", "SetDiscoveryFilter", "a{sv}", looks)
        )
        self._do(self._bus.call(ADAPTER, "org.bluez.Adapter1", "StartDiscovery"))
        self._guest.until(lambda: self.path, "the orb to be found", 40.0)
        self._do(self._bus.call(ADAPTER, "org.bluez.Adapter1", "StopDiscovery"))
        self.call("Pair")
        self._do(self._bus.set(self.path, DEVICE, "Trusted", "b", True))
        with contextlib.suppress(BluetoothError):  # it may be there already
            self.call("Connect")
        return self.known

    def call(self, member: str) -> None:
        """Call a method of the orb's object."""
        self._do(self._bus.call(self.path, DEVICE, member, timeout_s=PAIR_S))

    @property
    def path(self) -> str:
        """The orb's object, "" if it is not known."""
        found = devices(self._do(self._bus.objects()), ADAPTER)
        return next((path for path, it in found.items() if it["Address"] == self._orb), "")

    @property
    def known(self) -> Properties:
        """What BlueZ knows of the orb, its battery included."""
        objects = self._do(self._bus.objects())
        battery = objects.get(self.path, {}).get("org.bluez.Battery1", {})
        return {**objects.get(self.path, {}).get(DEVICE, {}), **battery}

    def inputs(self) -> dict[str, Any]:
        """Return the kernel's devices that the orb has become: "keyboard" and "pad"."""
        import evdev

        found = {}
        for place in evdev.list_devices():
            with contextlib.suppress(OSError):
                device = evdev.InputDevice(place)
                if "OrbTouch" in device.name:
                    codes = device.capabilities().get(evdev.ecodes.EV_KEY, [])
                    found["keyboard" if evdev.ecodes.KEY_LEFT in codes else "pad"] = device
        return found if {"keyboard", "pad"} <= set(found) else {}

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()
        self._do(self._bus.lost())
        self._loop.close()

    def _do(self, task: Coroutine[Any, Any, Any]) -> Any:
        return self._loop.run_until_complete(task)


def events(device: Any, count: int, timeout_s: float = 10.0) -> list[tuple[float, str, int]]:
    """Return the next events of keys, buttons and axes: (when it was read, its name, its value)."""
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
                found.append((time.perf_counter(), name, event.value))
    return found


def drain(device: Any) -> None:
    """Forget the events that are there."""
    with contextlib.suppress(BlockingIOError):
        list(device.read())
