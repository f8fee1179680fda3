"""HID over GATT through BlueZ: services and advertisement, as objects on D-Bus.

BlueZ calls these objects when a host reads, writes or subscribes, and sends changed values to
subscribers. The kernel advertises whenever no host is connected. BlueZ cannot advertise to one host
only, so every paired host may connect, and `HidDevice` selects the active one. Outside of the
pairing window, the advertisement is not discoverable.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Coroutine
from typing import Any, Final

from dbus_fast import DBusError, Message, MessageType, Variant

from controller.links.bluetooth.bluez import (
    ADAPTER,
    BLUEZ,
    DEVICE,
    BluetoothError,
    Bus,
    Properties,
    bonded,
    devices,
)
from controller.links.bluetooth.hid import dbus_objects
from controller.links.bluetooth.hid.gatt_services import SERVICES, OfferError, ServiceValues
from controller.links.bluetooth.hid.hid_device import HidDevice, HidTransport
from controller.links.bluetooth.hid.reports import Report
from controller.links.bluetooth.registration import logged

APPLICATION: Final = "/orbtouch/hid"
ADVERTISEMENT: Final = "/orbtouch/advertisement"
GATT: Final = "org.bluez.GattManager1"
ADVERTISING: Final = "org.bluez.LEAdvertisingManager1"
BATTERY_S: Final = 60.0  # between two readings of the battery
CLOSE_S: Final = 2.0  # timeout of calls that end the connection

log = logging.getLogger(__name__)


class GattTransport(HidTransport):
    """Services and advertisement, registered with BlueZ."""

    def __init__(self, device: HidDevice, name: str, charge: Callable[[], int]) -> None:
        """Prepare the services; `charge` returns the battery's charge in percent."""
        super().__init__(device, name)
        self._charge = charge
        self._values = ServiceValues(name, charge())
        self._battery: asyncio.TimerHandle | None = None
        self._paths: dict[str, str] = {}  # of characteristics, by name
        self._discoverable = False
        self._advertised = False
        self._changing = asyncio.Lock()  # serialises changes of the advertisement
        self._tasks: set[asyncio.Task[None]] = set()

    # --- the registration ---

    async def begin(self, bus: Bus, adapter: str) -> None:
        """Register with BlueZ.

        Raises:
            BluetoothError: BlueZ refuses it; the message is one sentence.
        """
        self._bus, self._adapter, self._advertised = bus, adapter, False
        objects = await bus.objects()
        for name in (GATT, ADVERTISING):
            if name not in objects.get(adapter, {}):
                raise BluetoothError(
                    f"this adapter cannot be a low energy gamepad (BlueZ offers no {name}); "
                    "use --link hid:classic, or another adapter"
                )
        self._devices = devices(objects, adapter)
        self._discoverable = bool(objects[adapter][ADAPTER].get("Discoverable"))
        self._export(bus)
        await bus.call(adapter, GATT, "RegisterApplication", "oa{sv}", APPLICATION, {})
        bus.listen(self._follow)
        await self._advertise()
        self._hid.open(self)
        self._read_battery()
        for host in self._devices.values():
            if host.get("Connected") and self._is_known(host):
                self._hid.arrive(host["Address"])

    async def end(self) -> None:
        """Release all keys on the host, disconnect it, and unregister."""
        active = self._hid.hosts.active
        self._hid.close()  # sends the last reports if a host is connected
        if self._battery is not None:
            self._battery.cancel()
        bus, self._bus = self._bus, None
        if bus is None:
            return
        with contextlib.suppress(BluetoothError):
            if active:  # D-Bus keeps the order: BlueZ gets the reports first
                await self._disconnect(bus, active)
            await bus.call(
                self._adapter, GATT, "UnregisterApplication", "o", APPLICATION, timeout_s=CLOSE_S
            )

    # --- called by the device ---

    def send(self, report: Report) -> None:
        """Send a report to all subscribers: `HidDevice` has disconnected all hosts but one."""
        for name, value in self._values.report(report):
            self._notify(name, value)

    def drop(self, address: str) -> None:
        """Disconnect a host."""
        if self._bus is not None:
            self._do(self._disconnect(self._bus, address))

    # --- called by BlueZ ---

    def read(self, name: str, offset: int, device: str) -> bytes:
        """Return a value for a host; a host that reads the report map is about to subscribe."""
        try:
            value = self._values.read(name, offset)
        except OfferError as error:
            raise DBusError(error.name, str(error)) from None
        if name == "report_map" and device in self._devices:
            address = self._devices[device]["Address"]
            asyncio.get_running_loop().call_soon(self._hid.arrive, address)
        return value

    def write(self, name: str, value: bytes, offset: int) -> None:
        """Store a value that a host writes."""
        try:
            self._values.write(name, value, offset)
        except OfferError as error:
            raise DBusError(error.name, str(error)) from None

    def subscribed(self, name: str) -> None:
        """Report released keys to all connected paired hosts, since BlueZ names no subscriber.

        This includes unknown hosts: they may have cached the report map before their address was
        removed from `host_store`.
        """
        log.debug("a host is subscribed to %s", name)
        for host in tuple(self._devices.values()):
            if host.get("Connected") and bonded(host):
                self._hid.arrive(host["Address"])

    def _follow(self, path: str, interface: str, changes: Properties | None) -> None:
        ours = path == self._adapter and interface == ADAPTER
        if path == "" or (ours and changes is None):
            self._bus = None  # bluetoothd or the adapter is lost
        elif ours and changes and "Discoverable" in changes:
            self._discoverable = changes["Discoverable"]
            self._do(self._advertise())
        super()._follow(path, interface, changes)

    def _changed(self, before: Properties, after: Properties) -> None:
        connected, was_connected = after.get("Connected"), before.get("Connected")
        if connected and self._is_known(after):
            if not was_connected or before.get("Address") != after["Address"]:
                self._hid.arrive(after["Address"])
        elif was_connected and not connected:
            self._hid.leave(before["Address"])
        if not any(host.get("Connected") for host in self._devices.values()):
            self._values.reset()

    # --- helpers ---

    def _is_known(self, host: Properties) -> bool:
        """Return whether a host is paired and was active before; others may use rfcomm only."""
        return bonded(host) and host.get("Address") in self._hid.hosts.known.hosts

    def _export(self, bus: Bus) -> None:
        """Export all services as a tree of objects."""
        for number, (uuid, characteristics) in enumerate(SERVICES.items()):
            service = f"{APPLICATION}/service{number}"
            bus.export(service, dbus_objects.service(uuid))
            for place, one in enumerate(characteristics):
                path = f"{service}/char{place}"
                self._paths[one.name] = path
                bus.export(path, dbus_objects.characteristic(one, service, self))
                for last, (kind, value) in enumerate(one.descriptors):
                    bus.export(f"{path}/desc{last}", dbus_objects.descriptor(kind, value, path))

    def _read_battery(self) -> None:
        """Notify hosts of a changed battery level, and schedule the next reading."""
        for name, value in self._values.charge(self._charge()):
            self._notify(name, value)
        loop = asyncio.get_running_loop()
        self._battery = loop.call_later(BATTERY_S, self._read_battery)

    def _notify(self, name: str, value: bytes) -> None:
        """Signal a changed value to BlueZ, and to no other program on this machine."""
        if self._bus is None:
            return
        signal = Message(
            message_type=MessageType.SIGNAL,
            destination=BLUEZ,
            path=self._paths[name],
            interface="org.freedesktop.DBus.Properties",
            member="PropertiesChanged",
            signature="sa{sv}as",
            body=[dbus_objects.CHARACTERISTIC, {"Value": Variant("ay", value)}, []],
        )
        self._bus.raw.send(signal)

    async def _disconnect(self, bus: Bus, address: str) -> None:
        for path, host in self._devices.items():
            if host.get("Address") == address:
                await bus.call(path, DEVICE, "Disconnect", timeout_s=CLOSE_S)

    async def _advertise(self) -> None:
        """Replace the registered advertisement by one with the current properties.

        Raises:
            BluetoothError: BlueZ refuses it.
        """
        async with self._changing:
            if (bus := self._bus) is None:
                return
            if self._advertised:
                await bus.call(
                    self._adapter, ADVERTISING, "UnregisterAdvertisement", "o", ADVERTISEMENT
                )
                bus.unexport(ADVERTISEMENT)
            bus.export(ADVERTISEMENT, dbus_objects.advertisement(self._name, self._discoverable))
            await bus.call(
                self._adapter, ADVERTISING, "RegisterAdvertisement", "oa{sv}", ADVERTISEMENT, {}
            )
            self._advertised = True

    def _do(self, task: Coroutine[Any, Any, None]) -> None:
        """Run a task without waiting; errors are logged."""
        running = asyncio.get_running_loop().create_task(logged(task))
        self._tasks.add(running)
        running.add_done_callback(self._tasks.discard)
