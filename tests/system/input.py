"""A host that has nothing of ours: BlueZ and the kernel's input devices, as a desktop uses them.

`Desktop` is a host over GATT, whose every part is BlueZ's. `ClassicDesktop` does by hand what
BlueZ's input plugin does, and hands both channels to the kernel's HID protocol: that plugin would
take the orb's own channels away, as both ends here have one bluetoothd.
"""

from __future__ import annotations

import array
import asyncio
import contextlib
import fcntl
import math
import select
import socket
import struct
import threading
import time
from collections.abc import Coroutine
from typing import Any

from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.pairing_agent import SCREEN, PairingAgent

from .guest import ANSWER_S, CaseError, Guest

HOST = "/org/bluez/hci0"
ORB = "/org/bluez/hci1"
ADAPTER = "org.bluez.Adapter1"
PAIR_S = 60.0
_ASKED, _PATIENCE_S = 4, 10.0


class Desktop:
    """The host on hci0, over GATT."""

    transport = "le"

    def __init__(self, guest: Guest) -> None:
        self.guest = guest
        self.host, self.orb = guest.addresses
        self._loop = asyncio.new_event_loop()
        self._bus = self._do(bluez.Bus.connect())

    def find(self) -> None:
        self._do(self._bus.set(HOST, ADAPTER, "Powered", "b", True))
        looks = {"Transport": bluez.variant("s", self.transport)}
        self._do(self._bus.call(HOST, ADAPTER, "SetDiscoveryFilter", "a{sv}", looks))
        self._do(self._bus.call(HOST, ADAPTER, "StartDiscovery"))
        self.guest.until(lambda: self.path, "the orb to be found")
        with contextlib.suppress(bluez.BluetoothError):  # it may be about to stop by itself
            self._do(self._bus.call(HOST, ADAPTER, "StopDiscovery"))

    def pair(self) -> None:
        """Pair with the orb and trust it."""
        self._do(self._bus.call(self.path, bluez.DEVICE, "Pair", timeout_s=PAIR_S))
        self._do(self._bus.set(self.path, bluez.DEVICE, "Trusted", "b", True))

    def connect(self) -> None:
        """Ask for the orb, if it is not there already."""
        with contextlib.suppress(bluez.BluetoothError):
            self._do(self._bus.call(self.path, bluez.DEVICE, "Connect", timeout_s=PAIR_S))

    def drop(self) -> None:
        """Let the orb's side drop the link, as when it is carried away."""
        path = f"{ORB}/dev_{self.host.replace(':', '_')}"
        self._do(self._bus.call(path, bluez.DEVICE, "Disconnect"))

    @property
    def path(self) -> str:
        """The orb's object, "" if it is not known."""
        found = bluez.devices(self._objects(), HOST)
        return next((path for path, it in found.items() if it["Address"] == self.orb), "")

    @property
    def known(self) -> bluez.Properties:
        """What BlueZ knows of the orb, its battery included."""
        interfaces = self._objects().get(self.path, {})
        return {**interfaces.get(bluez.DEVICE, {}), **interfaces.get("org.bluez.Battery1", {})}

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
        self._bus.close()
        self._do(self._bus.lost())
        self._loop.close()

    def _objects(self) -> bluez.Objects:
        """Return all that BlueZ knows; in a crowded machine bluetoothd may not answer at first."""
        for _ in range(_ASKED):
            try:
                found: bluez.Objects = self._do(asyncio.wait_for(self._bus.objects(), _PATIENCE_S))
                return found
            except (bluez.BluetoothError, TimeoutError):
                self._bus.close()
                self._bus = self._do(bluez.Bus.connect())
        raise CaseError("bluetoothd does not answer")

    def _do(self, task: Coroutine[Any, Any, Any]) -> Any:
        return self._loop.run_until_complete(task)


class SerialDesktop(Desktop):
    """The Bluetooth settings of the host on hci0, for an orb that is a serial port."""

    transport = "bredr"

    def __init__(self, guest: Guest) -> None:
        super().__init__(guest)
        self.shown: list[str] = []  # digits that were confirmed

    def pair_with_digits(self) -> None:
        """Pair, and confirm the digits that are shown."""
        self.find()
        self._do(self._show())
        self.pair()

    async def _show(self) -> None:
        """Let BlueZ ask this connection's agent, as that of the caller of Pair."""
        agent = PairingAgent(self._bus, self._confirm)
        await agent.register(SCREEN, default=False)
        agent._closes_s = math.inf

    async def _confirm(self, orb: str, digits: str) -> bool:
        self.shown.append(digits)
        return True


class ClassicDesktop(Desktop):
    """The host on hci0, over classic Bluetooth."""

    transport = "bredr"
    ports = (0x11, 0x13)

    def __init__(self, guest: Guest) -> None:
        """Connect to BlueZ, and wait for orbs that come back."""
        super().__init__(guest)
        self.descriptor = b""
        self._kernel = socket.socket(socket.AF_BLUETOOTH, socket.SOCK_RAW, _HIDP)
        self._listeners = [_l2cap(self.host, port) for port in self.ports]
        for listener in self._listeners:
            listener.listen(1)
        self._thread = threading.Thread(target=self._welcome, daemon=True)

    def connect(self) -> None:
        """Read the orb's record, open both channels and hand them to the kernel."""
        record = self.guest.run("sdptool", "browse", "--xml", self.orb)
        after = record.partition('<attribute id="0x0206">')[2].partition("</attribute>")[0]
        self.descriptor = bytes.fromhex(after.partition('encoding="hex" value="')[2].split('"')[0])
        channels = []
        for port in self.ports:
            channel = _l2cap(self.host, 0)
            channel.connect((self.orb, port))
            channels.append(channel)
        self._hand_over(channels)
        self._thread.start()

    def settled(self) -> bool:
        """Return True: the kernel looks at nothing but the reports."""
        return True

    def _welcome(self) -> None:
        """Do the same for an orb that comes by itself."""
        with contextlib.suppress(OSError):
            while True:
                self._hand_over([listener.accept()[0] for listener in self._listeners])

    def _hand_over(self, channels: list[socket.socket]) -> None:
        """Let the kernel speak HID over these: linux/net/bluetooth/hidp/hidp.h."""
        descriptor = array.array("B", self.descriptor)
        address, size = descriptor.buffer_info()
        request = struct.pack(
            "@iiHHPBBHHHII128s",
            channels[0].fileno(), channels[1].fileno(), 0x0111, size, address, 0, 8,
            0x1209, 1, 0x0100, 0, 0, b"OrbTouch",
        )  # fmt: skip
        fcntl.ioctl(self._kernel, _ADD, request)
        for channel in channels:
            channel.close()  # the kernel has its own hold on them


_HIDP = 6  # the protocol's number: linux/include/net/bluetooth/bluetooth.h
_ADD = 0x400448C8  # HIDPCONNADD


def _l2cap(address: str, port: int) -> socket.socket:
    fresh = socket.socket(socket.AF_BLUETOOTH, socket.SOCK_SEQPACKET, socket.BTPROTO_L2CAP)
    fresh.setsockopt(274, 4, bytes([2, 0]))  # encrypted
    fresh.bind((address, port))
    return fresh


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
