"""Serial port service: BlueZ accepts and encrypts connections, and passes on their sockets."""

import contextlib
import logging
import socket
from collections.abc import Callable
from importlib.resources import files
from typing import Annotated, Any, Final

from dbus_fast import DBusError
from dbus_fast.annotations import DBusObjectPath, DBusSignature, DBusUnixFd
from dbus_fast.service import ServiceInterface, dbus_method

from controller.links.bluetooth.registration import Registration

# Annotations are evaluated as D-Bus types: no `from __future__ import annotations` here.
from controller.shared.bluetooth.bluez import (
    ADAPTER,
    ALIAS,
    CHANNEL,
    ROOT,
    SERIAL_PATH,
    SERVICE_UUID,
    Bus,
    bonded,
    devices,
    named,
    variant,
)

MANAGER: Final = "org.bluez.ProfileManager1"
SOL_BLUETOOTH: Final = 274  # Linux, include/net/bluetooth/bluetooth.h, like the next two
BT_SECURITY: Final = 4
MEDIUM: Final = 2  # encrypted, with a key from pairing

_SERVICE_RECORD: Final = (files(__package__) / "service_record.xml").read_text("utf-8")

# Called with a connected socket, name and address of its host, and the host's path in BlueZ.
Accept = Callable[[socket.socket, str, str], None]

log = logging.getLogger(__name__)


class SerialService(ServiceInterface, Registration):
    """Serial port profile, for bonded hosts only.

    Attributes:
        address: The adapter's address.
    """

    def __init__(self, accept: Accept, leave: Callable[[str], None]) -> None:
        """Prepare the service.

        `accept` is called with every connected host, on the registration's thread; `leave` with the
        path of a device that BlueZ is about to disconnect.
        """
        super().__init__("org.bluez.Profile1")
        self.address = ""
        self._accept, self._leave = accept, leave
        self._bus: Bus | None = None
        self._adapter = ""

    async def begin(self, bus: Bus, adapter: str) -> None:
        """Register the service and its record; BluetoothError if another program has."""
        self.address = await bus.get(adapter, ADAPTER, "Address")
        bus.export(SERIAL_PATH, self)
        options = {
            "Name": variant("s", ALIAS),
            "Role": variant("s", "server"),
            "Channel": variant("q", CHANNEL),
            "RequireAuthentication": variant("b", True),
            "RequireAuthorization": variant("b", True),
            "ServiceRecord": variant("s", record()),
        }
        arguments = (SERIAL_PATH, SERVICE_UUID, options)
        await bus.call(ROOT, MANAGER, "RegisterProfile", "osa{sv}", *arguments)
        self._bus, self._adapter = bus, adapter

    async def end(self) -> None:
        """Release the bus; connected hosts stay connected."""
        self._bus = None

    @dbus_method()
    def Release(self) -> None:  # noqa: N802
        """Handle the end of the registration."""

    @dbus_method()
    async def NewConnection(  # noqa: N802
        self,
        device: DBusObjectPath,
        fd: DBusUnixFd,
        properties: Annotated[dict[str, Any], DBusSignature("a{sv}")],
    ) -> None:
        """Check a connected host, and pass its socket on."""
        connection = socket.socket(fileno=fd)
        try:
            host = await self._checked(device, connection)
        except DBusError as error:
            log.warning("a connection from %s was refused: %s", device.rpartition("/")[2], error)
            connection.close()
            raise
        connection.setblocking(False)
        self._accept(connection, host, device)

    @dbus_method()
    def RequestDisconnection(self, device: DBusObjectPath) -> None:  # noqa: N802
        """Handle a disconnection that BlueZ is about to make."""
        self._leave(device)

    async def _checked(self, device: str, connection: socket.socket) -> str:
        """Return name and address of a host; raise if it may not connect."""
        if self._bus is None or not device.startswith(self._adapter + "/"):
            raise DBusError("org.bluez.Error.Rejected", "not on this adapter")
        found = devices(await self._bus.objects()).get(device, {})
        if not bonded(found):
            raise DBusError("org.bluez.Error.Rejected", "not paired")
        if not _encrypted(connection):
            raise DBusError("org.bluez.Error.Rejected", "not encrypted")
        return named(found)


def _encrypted(connection: socket.socket) -> bool:
    """Return whether the kernel encrypts this connection; True for other sockets than Bluetooth."""
    if connection.family != getattr(socket, "AF_BLUETOOTH", 31):
        return True  # in tests; BlueZ passes Bluetooth sockets only
    with contextlib.suppress(OSError):
        level = connection.getsockopt(SOL_BLUETOOTH, BT_SECURITY, 2)
        return level[0] >= MEDIUM
    return False


def record(channel: int = CHANNEL) -> str:
    """Return the SDP service record in BlueZ's XML, for an RFCOMM channel, 1 to 30."""
    return _SERVICE_RECORD.format(uuid=SERVICE_UUID, channel=channel, name=ALIAS)
