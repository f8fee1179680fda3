"""D-Bus client: one connection to the system bus, BlueZ's objects as plain values, identifiers.

Everything here runs on one asyncio loop, on the thread of `controller.links.bluetooth.registration`
in a device. Methods are called by signature without introspection, since BlueZ's interface is
fixed and every round trip takes time.
"""

from __future__ import annotations

import asyncio
import os
import tomllib
from collections.abc import Callable
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

from controller.shared.errors import TroubleError, how_to_install

if TYPE_CHECKING:
    from dbus_fast import Message
    from dbus_fast.service import ServiceInterface

BLUEZ: Final = "org.bluez"
ROOT: Final = "/org/bluez"  # object of AgentManager1 and ProfileManager1
ADAPTER: Final = "org.bluez.Adapter1"
DEVICE: Final = "org.bluez.Device1"
PAIRING_S: Final = 120  # duration of the pairing window
CALL_S: Final = 25.0  # D-Bus's own timeout; pairing and connecting have a longer one
_DBUS: Final = "org.freedesktop.DBus"
_PROPERTIES: Final = "org.freedesktop.DBus.Properties"
_OBJECTS: Final = "org.freedesktop.DBus.ObjectManager"

# The orb's own service, which distinguishes it from other serial ports.
SERVICE_UUID: Final = "6f726274-6f75-4368-9c1e-5a0d3f6b2a71"
# The standard serial port service, for which Windows and macOS create an ordinary port.
# A custom service record must name its RFCOMM channel, 1 to 30; BlueZ's own profiles have 9 to 17.
CHANNEL: Final = 22
ALIAS: Final = "OrbTouch"

AGENT_PATH: Final = "/orbtouch/agent"
SERIAL_PATH: Final = "/orbtouch/serial"

Properties = dict[str, Any]  # of one interface, variants unwrapped
Objects = dict[str, dict[str, Properties]]  # path → interface → properties
# Called with (path, interface, changes); None instead of changes: the interface was removed.
# A start or end of BlueZ itself has path "", interface "", changes {"running": bool}.
Listener = Callable[[str, str, Properties | None], None]


class BluetoothError(TroubleError, OSError):
    """Bluetooth cannot be used here; one sentence with what to do, and the D-Bus error's `name`."""

    def __init__(self, message: str, name: str = "") -> None:
        super().__init__(message)
        self.name = name


def available() -> bool:
    """Return whether the package dbus-fast is installed."""
    try:
        import dbus_fast  # noqa: F401
    except ImportError:
        return False
    return True


class Bus:
    """A connection to BlueZ over the system bus, made by `connect`."""

    def __init__(self, connection: Any) -> None:
        self.raw = connection  # dbus_fast.aio.MessageBus, for other calls
        self._listeners: list[Listener] = []

    @classmethod
    async def connect(cls) -> Bus:
        """Connect to the system bus, or to DBUS_SYSTEM_BUS_ADDRESS."""
        if not available():
            raise BluetoothError(
                f"Bluetooth needs the package dbus-fast; {how_to_install('bluetooth')}"
            )
        from dbus_fast import AuthError, BusType, DBusError
        from dbus_fast.aio import MessageBus

        try:
            connection = MessageBus(bus_type=BusType.SYSTEM, negotiate_unix_fd=True)
            await asyncio.wait_for(connection.connect(), CALL_S)
        except (OSError, AuthError, DBusError, TimeoutError, ValueError) as error:
            address = os.environ.get("DBUS_SYSTEM_BUS_ADDRESS", "the system bus")
            raise BluetoothError(
                f"cannot reach {address}, where BlueZ is ({error}); Bluetooth needs Linux with "
                "D-Bus and BlueZ: sudo apt install bluez, or use another --link"
            ) from error
        bus = cls(connection)
        connection.add_message_handler(bus._dispatch)
        await bus._subscribe()
        return bus

    async def call(
        self,
        path: str,
        interface: str,
        member: str,
        signature: str = "",
        *body: Any,
        timeout_s: float = CALL_S,
        to: str = BLUEZ,
    ) -> Any:
        """Call the method `member` of an object; return its one value, a list of several, or None.

        `signature` is the D-Bus types of the body; variants in it are `variant(...)`.
        BluetoothError if the call failed, or timed out.
        """
        from dbus_fast import DBusError, Message, MessageFlag, MessageType
        from dbus_fast.unpack import unpack_variants

        message = Message(
            # A query must not start a bluetoothd that was stopped on purpose.
            flags=MessageFlag.NO_AUTOSTART,
            destination=to,
            path=path,
            interface=interface,
            member=member,
            signature=signature,
            body=list(body),
        )
        try:
            reply = await asyncio.wait_for(self.raw.call(message), timeout_s)
        except TimeoutError:
            raise BluetoothError(f"{member} got no answer in {timeout_s:g} s") from None
        except (DBusError, EOFError, OSError) as error:
            raise BluetoothError(f"{member}: the bus was lost ({error})") from error
        if reply is None:
            return None
        if reply.message_type is MessageType.ERROR:
            text = str(reply.body[0]) if reply.body else ""
            name = str(reply.error_name)
            raise BluetoothError(f"{member}: {explain(name, text)}", name)
        values = unpack_variants(reply.body)
        return values[0] if len(values) == 1 else (values or None)

    async def running(self) -> bool:
        """Return whether bluetoothd is running."""
        return bool(await self.call("/", _DBUS, "NameHasOwner", "s", BLUEZ, to=_DBUS))

    async def objects(self) -> Objects:
        """Return all objects of BlueZ; none if it is not running."""
        try:
            found: Objects = await self.call("/", _OBJECTS, "GetManagedObjects")
        except BluetoothError as error:
            if error.name in _ABSENT_ERRORS:
                return {}
            raise
        return found

    async def adapter(self, name: str = "") -> str:
        """Return the path of an adapter: "hci1", an address, or "" for the first."""
        found = adapters(await self.objects())
        for path, properties in found.items():
            if name in ("", path.rpartition("/")[2], properties.get("Address")):
                return path
        if not await self.running():
            raise BluetoothError(_WORDS[_ABSENT_ERRORS[0]])
        if name and found:
            there = ", ".join(path.rpartition("/")[2] for path in found)
            raise BluetoothError(f"there is no Bluetooth adapter {name}; there is {there}")
        raise BluetoothError(
            "there is no Bluetooth adapter; plug one in, or wake the built-in one: "
            "rfkill unblock bluetooth"
        )

    async def get(self, path: str, interface: str, name: str) -> Any:
        """Return a property."""
        return await self.call(path, _PROPERTIES, "Get", "ss", interface, name)

    async def device(self, path: str) -> Properties:
        """Return the properties of a device."""
        found: Properties = await self.call(path, _PROPERTIES, "GetAll", "s", DEVICE)
        return found

    async def set(self, path: str, interface: str, name: str, signature: str, value: Any) -> None:
        """Set a property of a D-Bus type, such as "b" or "u"."""
        wrapped = variant(signature, value)
        await self.call(path, _PROPERTIES, "Set", "ssv", interface, name, wrapped)

    async def switch_on(self, adapter: str) -> None:
        """Switch an adapter on, under the orb's name unless its user gave it another."""
        if not await self.get(adapter, ADAPTER, "Powered"):
            await self.set(adapter, ADAPTER, "Powered", "b", True)
        if await self.get(adapter, ADAPTER, "Alias") == await self.get(adapter, ADAPTER, "Name"):
            await self.set(adapter, ADAPTER, "Alias", "s", ALIAS)

    def export(self, path: str, interface: ServiceInterface) -> None:
        """Export an object on the bus."""
        self.raw.export(path, interface)

    def unexport(self, path: str) -> None:
        """Remove an exported object, if there is one."""
        self.raw.unexport(path)

    def listen(self, listener: Listener) -> None:
        """Call a listener for every change, on the loop's thread."""
        self._listeners.append(listener)

    async def lost(self) -> None:
        """Return when the connection has ended."""
        from dbus_fast import DBusError

        try:
            await self.raw.wait_for_disconnect()
        except (DBusError, EOFError, OSError):
            return

    def close(self) -> None:
        """End the connection, which removes all registrations with BlueZ."""
        self.raw.disconnect()

    async def _subscribe(self) -> None:
        """Subscribe to BlueZ's signals."""
        for rule in (
            f"type='signal',sender='{BLUEZ}',interface='{_PROPERTIES}'",
            f"type='signal',sender='{BLUEZ}',interface='{_OBJECTS}'",
            f"type='signal',sender='{_DBUS}',member='NameOwnerChanged',arg0='{BLUEZ}'",
        ):
            await self.call("/org/freedesktop/DBus", _DBUS, "AddMatch", "s", rule, to=_DBUS)

    def _dispatch(self, message: Message) -> None:
        """Call the listeners with a signal of BlueZ."""
        from dbus_fast import MessageType
        from dbus_fast.unpack import unpack_variants

        if message.message_type is not MessageType.SIGNAL:
            return
        body = unpack_variants(message.body)
        changes: list[tuple[str, str, Properties | None]] = []
        if message.member == "PropertiesChanged" and message.interface == _PROPERTIES:
            changes = [(message.path or "", body[0], body[1])]
        elif message.member == "InterfacesAdded":
            changes = [(body[0], interface, values) for interface, values in body[1].items()]
        elif message.member == "InterfacesRemoved":
            changes = [(body[0], interface, None) for interface in body[1]]
        elif message.member == "NameOwnerChanged" and body[0] == BLUEZ:
            changes = [("", "", {"running": bool(body[2])})]
        for change in changes:
            for listener in tuple(self._listeners):
                listener(*change)


def variant(signature: str, value: Any) -> Any:
    """Return a value as a D-Bus variant."""
    from dbus_fast import Variant

    return Variant(signature, value)


def adapters(objects: Objects) -> dict[str, Properties]:
    """Return the adapters among BlueZ's objects, by path, sorted."""
    return {path: objects[path][ADAPTER] for path in sorted(objects) if ADAPTER in objects[path]}


def devices(objects: Objects, adapter: str = "") -> dict[str, Properties]:
    """Return the devices among BlueZ's objects, by path; all, or those of one adapter's path."""
    return {
        path: objects[path][DEVICE]
        for path in sorted(objects)
        if DEVICE in objects[path] and adapter in ("", objects[path][DEVICE].get("Adapter"))
    }


def bonded(device: Properties) -> bool:
    """Return whether a device is bonded."""
    return bool(device.get("Bonded", device.get("Paired", False)))  # BlueZ before 5.64: Paired


def named(device: Properties) -> str:
    """Return name and address of a device."""
    return f"{device.get('Alias', 'a host')} ({device.get('Address', '')})"


def explain(name: str, text: str) -> str:
    """Return the meaning of a D-Bus error and advice."""
    return _WORDS[name].format(text=text or name) if name in _WORDS else text or name


_SENTENCES: Final = tomllib.loads((files(__package__) / "bluez.toml").read_text("utf-8"))
_WORDS: Final = {
    **{f"{_DBUS}.Error.{name}": words for name, words in _SENTENCES["freedesktop"].items()},
    **{f"{BLUEZ}.Error.{name}": words for name, words in _SENTENCES["bluez"].items()},
}
_ABSENT_ERRORS: Final = (f"{_DBUS}.Error.ServiceUnknown", f"{_DBUS}.Error.NameHasNoOwner")
