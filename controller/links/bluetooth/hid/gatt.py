"""HID over GATT through BlueZ: services and advertisement, as objects on D-Bus.

BlueZ calls these objects when a host reads, writes or subscribes, and sends changed values to
subscribers. The kernel advertises whenever no host is connected. BlueZ cannot advertise to one host
only, so every paired host may connect, and `HidDevice` selects the active one. Outside of the
pairing window, the advertisement is not discoverable.

Names of interfaces, properties and methods are BlueZ's: doc/org.bluez.GattCharacteristic.rst and
related files. Annotations of methods are evaluated as D-Bus types: no `from __future__` here.
"""

import asyncio
import contextlib
import logging
from collections.abc import Callable, Coroutine
from typing import Annotated, Any, Final

from dbus_fast import Message, MessageType, PropertyAccess, Variant
from dbus_fast.annotations import DBusBytes, DBusDict, DBusSignature
from dbus_fast.service import ServiceInterface, dbus_method, dbus_property

from controller.links.bluetooth.hid.gatt_services import (
    APPEARANCE,
    HID,
    SERVICES,
    Characteristic,
    ServiceValues,
)
from controller.links.bluetooth.hid.hid_device import HidDevice, HidTransport
from controller.links.bluetooth.hid.reports import Report
from controller.links.bluetooth.registration import logged
from controller.shared.bluetooth.bluez import (
    ADAPTER,
    BLUEZ,
    DEVICE,
    BluetoothError,
    Bus,
    Properties,
    bonded,
    devices,
)

APPLICATION: Final = "/orbtouch/hid"
ADVERTISEMENT: Final = "/orbtouch/advertisement"
GATT: Final = "org.bluez.GattManager1"
ADVERTISING: Final = "org.bluez.LEAdvertisingManager1"
CHARACTERISTIC: Final = "org.bluez.GattCharacteristic1"
INTERVAL_MS: Final = (30, 60)  # between two advertisements, for a fast reconnection
CLOSE_S: Final = 2.0  # timeout of calls that end the connection

log = logging.getLogger(__name__)


class GattTransport(HidTransport):
    """Services and advertisement of a HID device, registered with BlueZ."""

    def __init__(self, device: HidDevice, name: str) -> None:
        """Prepare the services of a device; hosts show its name."""
        super().__init__(device, name)
        self._bus: Bus | None = None
        self._values = ServiceValues(name)
        self._paths: dict[str, str] = {}  # of characteristics, by name
        self._discoverable = False
        self._advertised = False
        self._changing = asyncio.Lock()  # serialises changes of the advertisement
        self._tasks: set[asyncio.Task[None]] = set()

    # --- the registration ---

    async def begin(self, bus: Bus, adapter: str) -> None:
        """Register with BlueZ; BluetoothError if it refuses."""
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
        for host in self._devices.values():
            if host.get("Connected") and self._is_known(host):
                self._hid.arrive(host["Address"])

    async def end(self) -> None:
        """Release all keys on the host, disconnect it, and unregister."""
        active = self._hid.hosts.active
        self._hid.close()  # sends the last reports if a host is connected
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
        value = self._values.read(name, offset)
        if name == "report_map" and device in self._devices:
            address = self._devices[device]["Address"]
            asyncio.get_running_loop().call_soon(self._hid.arrive, address)
        return value

    def write(self, name: str, value: bytes, offset: int) -> None:
        """Store a value that a host writes."""
        self._values.write(name, value, offset)

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
            bus.export(service, _service(uuid))
            for place, one in enumerate(characteristics):
                path = f"{service}/char{place}"
                self._paths[one.name] = path
                bus.export(path, _characteristic(one, service, self))
                for last, (kind, value) in enumerate(one.descriptors):
                    bus.export(f"{path}/desc{last}", _descriptor(kind, value, path))

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
            body=[CHARACTERISTIC, {"Value": Variant("ay", value)}, []],
        )
        self._bus.raw.send(signal)

    async def _disconnect(self, bus: Bus, address: str) -> None:
        for path, host in self._devices.items():
            if host.get("Address") == address:
                await bus.call(path, DEVICE, "Disconnect", timeout_s=CLOSE_S)

    async def _advertise(self) -> None:
        """Replace the registered advertisement by one with the current properties."""
        async with self._changing:
            if (bus := self._bus) is None:
                return
            if self._advertised:
                await bus.call(
                    self._adapter, ADVERTISING, "UnregisterAdvertisement", "o", ADVERTISEMENT
                )
                bus.unexport(ADVERTISEMENT)
            bus.export(ADVERTISEMENT, _advertisement(self._name, self._discoverable))
            await bus.call(
                self._adapter, ADVERTISING, "RegisterAdvertisement", "oa{sv}", ADVERTISEMENT, {}
            )
            self._advertised = True

    def _do(self, task: Coroutine[Any, Any, None]) -> None:
        """Run a task without waiting; errors are logged."""
        running = asyncio.get_running_loop().create_task(logged(task))
        self._tasks.add(running)
        running.add_done_callback(self._tasks.discard)


# --- the objects on D-Bus ---


def _service(uuid: int) -> ServiceInterface:
    """Return a service without characteristics."""
    properties = {"UUID": ("s", f"{uuid:04x}"), "Primary": ("b", True)}
    return _with_properties(ServiceInterface, properties)("org.bluez.GattService1")


def _characteristic(one: Characteristic, path: str, transport: "GattTransport") -> ServiceInterface:
    """Return a characteristic of the service at a path; the transport reads and writes it."""
    properties = {
        "UUID": ("s", f"{one.uuid:04x}"),
        "Service": ("o", path),
        "Flags": ("as", list(one.flags)),
    }
    return _with_properties(_Characteristic, properties)(one.name, transport)


def _descriptor(uuid: int, value: bytes, path: str) -> ServiceInterface:
    """Return a constant descriptor of the characteristic at a path."""
    properties = {
        "UUID": ("s", f"{uuid:04x}"),
        "Characteristic": ("o", path),
        "Flags": ("as", ["encrypt-read"]),
    }
    return _with_properties(_Descriptor, properties)(value)


def _advertisement(name: str, discoverable: bool) -> ServiceInterface:
    """Return the advertisement of a name; if discoverable, for hosts that are not paired, too."""
    properties = {
        "Type": ("s", "peripheral"),  # hosts may connect
        "ServiceUUIDs": ("as", [f"{HID:04x}"]),
        "Appearance": ("q", APPEARANCE),
        "LocalName": ("s", name),
        "Discoverable": ("b", discoverable),
        "MinInterval": ("u", INTERVAL_MS[0]),
        "MaxInterval": ("u", INTERVAL_MS[1]),
    }
    return _with_properties(_Advertisement, properties)("org.bluez.LEAdvertisement1")


class _Characteristic(ServiceInterface):
    def __init__(self, name: str, transport: "GattTransport") -> None:
        super().__init__(CHARACTERISTIC)
        self._name, self._transport = name, transport

    @dbus_method()
    def ReadValue(self, options: DBusDict) -> DBusBytes:  # noqa: N802
        device = str(_option(options, "device", ""))
        return self._transport.read(self._name, int(_option(options, "offset", 0)), device)

    @dbus_method()
    def WriteValue(self, value: DBusBytes, options: DBusDict) -> None:  # noqa: N802
        self._transport.write(self._name, value, int(_option(options, "offset", 0)))

    @dbus_method()
    def StartNotify(self) -> None:  # noqa: N802
        self._transport.subscribed(self._name)

    @dbus_method()
    def StopNotify(self) -> None:  # noqa: N802
        log.debug("no host is subscribed to %s", self._name)


class _Descriptor(ServiceInterface):
    def __init__(self, value: bytes) -> None:
        super().__init__("org.bluez.GattDescriptor1")
        self._value = value

    @dbus_method()
    def ReadValue(self, options: DBusDict) -> DBusBytes:  # noqa: N802
        return self._value[int(_option(options, "offset", 0)) :]


class _Advertisement(ServiceInterface):
    @dbus_method()
    def Release(self) -> None:  # noqa: N802
        log.debug("BlueZ no longer advertises")


def _with_properties(
    kind: Any, properties: dict[str, tuple[str, Any]]
) -> Callable[..., ServiceInterface]:
    """Return a class with constant properties: the D-Bus type and the value of each."""
    return type(kind.__name__, (kind,), {n: _constant(n, *one) for n, one in properties.items()})


def _constant(name: str, signature: str, value: Any) -> Any:
    def read(self: Any) -> Any:
        return value

    read.__name__ = name  # dbus-fast finds it by name
    read.__annotations__["return"] = Annotated[Any, DBusSignature(signature)]
    return dbus_property(PropertyAccess.READ, name)(read)


def _option(options: dict[str, Any], name: str, default: Any) -> Any:
    return options[name].value if name in options else default
