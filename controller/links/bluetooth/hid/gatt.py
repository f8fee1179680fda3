"""HID over GATT through BlueZ: our services and our advertisement, as objects on D-Bus.

BlueZ calls us when a host reads, writes or begins to listen; a value that we say has changed, it
sends to whoever listens. The kernel advertises whenever no host is connected. Advertising to one
host only is nothing that BlueZ offers, so the orb is found by all, and `HidDevice` decides which
host stays; while no pairing is asked for, it tells strangers not to look at it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, Final

from dbus_fast import DBusError, Message, MessageType, Variant

from controller.links.bluetooth.bluez import (
    ADAPTER,
    BLUEZ,
    DEVICE,
    BluetoothError,
    Properties,
    bonded,
    devices,
)
from controller.links.bluetooth.hid import dbus_objects
from controller.links.bluetooth.hid.gatt_services import SERVICES, OfferError, ServiceValues

if TYPE_CHECKING:
    from controller.links.bluetooth.bluez import Bus
    from controller.links.bluetooth.hid.hid_device import HidDevice
    from controller.links.bluetooth.hid.reports import Report

APPLICATION: Final = "/orbtouch/hid"
ADVERTISEMENT: Final = "/orbtouch/advertisement"
GATT: Final = "org.bluez.GattManager1"
ADVERTISING: Final = "org.bluez.LEAdvertisingManager1"
BATTERY_S: Final = 60.0  # between two looks at the battery
FAREWELL_S: Final = 2.0  # for BlueZ to take the last report

log = logging.getLogger(__name__)


class GattPart:
    """Keeps the services registered, and tells `HidDevice` who comes and goes."""

    def __init__(self, pad: HidDevice, name: str, charge: Callable[[], int]) -> None:
        """Prepare.

        Args:
            pad: What is down, and for whom.
            name: Under which hosts find the orb.
            charge: Tells the battery's charge in percent, whenever it is asked.
        """
        self._pad, self._name, self._charge = pad, name, charge
        self._offer = ServiceValues(name, charge())
        self._battery: asyncio.TimerHandle | None = None
        self._bus: Bus | None = None
        self._adapter = ""
        self._devices: dict[str, Properties] = {}
        self._paths: dict[str, str] = {}  # of characteristics, by name
        self._discoverable = False
        self._advertised = False
        self._changing = asyncio.Lock()  # one change of the advertisement at a time
        self._tasks: set[asyncio.Task[None]] = set()

    # --- the keeper's side ---

    async def begin(self, bus: Bus, adapter: str) -> None:
        """Register with BlueZ.

        Raises:
            BluetoothError: It does not want us; one sentence says why.
        """
        self._bus, self._adapter, self._advertised = bus, adapter, False
        objects = await bus.objects()
        self._require(objects.get(adapter, {}))
        self._devices = devices(objects, adapter)
        self._discoverable = bool(objects[adapter][ADAPTER].get("Discoverable"))
        self._export(bus)
        await bus.call(adapter, GATT, "RegisterApplication", "oa{sv}", APPLICATION, {})
        bus.listen(self._hear)
        await self._advertise()
        self._pad.open(self)
        self._look_at_battery()
        for device in self._devices.values():
            if device.get("Connected") and self._is_ours(device):
                self._pad.arrive(device["Address"])

    async def end(self) -> None:
        """Say that nothing is down, let the host go, and let BlueZ forget us."""
        active = self._pad.hosts.active
        self._pad.close()  # sends the last reports, if there is still a way
        if self._battery is not None:
            self._battery.cancel()
        bus, self._bus = self._bus, None
        if bus is None:
            return
        with contextlib.suppress(BluetoothError):
            if active:  # D-Bus keeps the order: the reports are with BlueZ before this
                await self._disconnect(bus, active)
            await bus.call(
                self._adapter, GATT, "UnregisterApplication", "o", APPLICATION,
                timeout_s=FAREWELL_S,
            )  # fmt: skip

    # --- the pad's side ---

    def send(self, report: Report) -> None:
        """Send a report to whoever listens: `HidDevice` has sent away all hosts but one."""
        for name, value in self._offer.report(report):
            self._changed(name, value)

    def drop(self, address: str) -> None:
        """Disconnect a host."""
        if self._bus is not None:
            self._do(self._disconnect(self._bus, address))

    def seek(self, wanted: bool) -> None:
        """Do nothing: the kernel itself advertises while we have no host, and only then."""

    # --- BlueZ's side ---

    def read(self, name: str, offset: int, device: str) -> bytes:
        """Answer a host that reads; one that reads the report map wants to listen to us."""
        try:
            value = self._offer.read(name, offset)
        except OfferError as error:
            raise DBusError(error.name, str(error)) from None
        if name == "report_map" and device in self._devices:
            address = self._devices[device]["Address"]
            asyncio.get_running_loop().call_soon(self._pad.arrive, address)
        return value

    def write(self, name: str, value: bytes, offset: int) -> None:
        """Take what a host writes."""
        try:
            self._offer.write(name, value, offset)
        except OfferError as error:
            raise DBusError(error.name, str(error)) from None

    def listened(self, name: str) -> None:
        """Somebody has begun to listen: tell once more that nothing is down.

        BlueZ does not say who. A host that is not known yet is taken for one of ours as well, for
        it may remember our report map from before we forgot it.
        """
        log.debug("a host listens to %s", name)
        for device in tuple(self._devices.values()):
            if device.get("Connected") and bonded(device):
                self._pad.arrive(device["Address"])

    def _hear(self, path: str, interface: str, changes: Properties | None) -> None:
        """Follow hosts and the pairing window."""
        if path == "":
            self._bus = None  # bluetoothd has gone, and with it everybody
            return
        if path == self._adapter and interface == ADAPTER:
            if changes is None:
                self._bus = None
            elif "Discoverable" in changes:
                self._discoverable = changes["Discoverable"]
                self._do(self._advertise())
        if interface != DEVICE or not path.startswith(f"{self._adapter}/"):
            return
        device = self._devices.setdefault(path, {})
        before = (device.get("Address", ""), bool(device.get("Connected")))
        if changes is None:
            del self._devices[path]
        else:
            device.update(changes)
        address, there = device.get("Address", ""), bool(changes and device.get("Connected"))
        if there and self._is_ours(device):
            if (address, there) != before:
                self._pad.arrive(address)
        elif before[1] and not there:
            self._pad.leave(before[0])
        if not any(device.get("Connected") for device in self._devices.values()):
            self._offer.forget()

    # --- helpers ---

    def _is_ours(self, device: Properties) -> bool:
        """Return whether a host is paired and was here before; others may be here for the port."""
        return bonded(device) and device.get("Address") in self._pad.hosts.known.hosts

    def _require(self, interfaces: dict[str, Properties]) -> None:
        for name in (GATT, ADVERTISING):
            if name not in interfaces:
                raise BluetoothError(
                    f"this adapter cannot be a low energy gamepad (BlueZ offers no {name}); "
                    "use --link hid:classic, or another adapter"
                )

    def _export(self, bus: Bus) -> None:
        """Offer all services to BlueZ, as a tree of objects."""
        for number, (uuid, characteristics) in enumerate(SERVICES.items()):
            service = f"{APPLICATION}/service{number}"
            bus.export(service, dbus_objects.service(uuid))
            for place, one in enumerate(characteristics):
                path = f"{service}/char{place}"
                self._paths[one.name] = path
                bus.export(path, dbus_objects.characteristic(one, service, self))
                for last, (kind, value) in enumerate(one.descriptors):
                    bus.export(f"{path}/desc{last}", dbus_objects.descriptor(kind, value, path))

    def _look_at_battery(self) -> None:
        """Tell whoever listens when the battery's level has changed; look again by and by."""
        for name, value in self._offer.charge(self._charge()):
            self._changed(name, value)
        loop = asyncio.get_running_loop()
        self._battery = loop.call_later(BATTERY_S, self._look_at_battery)

    def _changed(self, name: str, value: bytes) -> None:
        """Tell BlueZ, and nobody else on this machine, that a value has changed."""
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
        for path, device in self._devices.items():
            if device.get("Address") == address:
                await bus.call(path, DEVICE, "Disconnect", timeout_s=FAREWELL_S)

    async def _advertise(self) -> None:
        """Register the advertisement as it should be now, in place of the one before.

        Raises:
            BluetoothError: BlueZ does not want it.
        """
        async with self._changing:
            bus = self._bus
            if bus is None:
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
        """Run something beside; what fails is logged."""
        running = asyncio.get_running_loop().create_task(_logged(task))
        self._tasks.add(running)
        running.add_done_callback(self._tasks.discard)


async def _logged(task: Coroutine[Any, Any, None]) -> None:
    try:
        await task
    except BluetoothError as error:
        log.warning("Bluetooth: %s", error)
