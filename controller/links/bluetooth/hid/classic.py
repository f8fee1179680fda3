"""Classic HID through BlueZ: a service record in bluetoothd, and two channels as sockets.

bluetoothd's input plugin, which is for hosts, opens the same two channels of every adapter, so it
must be disabled (bluetoothd --noplugin=input). HID over GATT works beside it.
"""

import asyncio
import contextlib
import errno
import logging
import socket
from typing import Final

from dbus_fast.service import ServiceInterface

from controller.links.bluetooth.hid.hid_device import HidDevice, HidTransport
from controller.links.bluetooth.hid.l2cap import CONTROL, INTERRUPT, UUID, HidChannels, record
from controller.links.bluetooth.hid.reports import Report, supersedes
from controller.links.bluetooth.serial_profile import BT_SECURITY, MANAGER, MEDIUM, SOL_BLUETOOTH
from controller.shared.bluetooth.bluez import (
    ADAPTER,
    ROOT,
    BluetoothError,
    Bus,
    Properties,
    bonded,
    devices,
    variant,
)

PROFILE: Final = "/orbtouch/classic"
CONNECT_S: Final = 12.0  # for an absent host a connection fails after about five
PAUSES_S: Final = (1.0, 2.0, 4.0, 8.0, 15.0)  # between two attempts to reach the last active host
PACKET: Final = 1024  # bytes; more than either channel ever carries
WAITING: Final = 64  # limit of queued reports; a slower host is disconnected

log = logging.getLogger(__name__)


class L2capSockets:
    """The kernel's L2CAP sockets."""

    def listen(self, address: str, port: int) -> socket.socket:
        """Return a listening socket for encrypted connections at an adapter."""
        listener = self._socket()
        try:
            listener.bind((address, port))
            listener.listen(2)
        except OSError:
            listener.close()
            raise
        return listener

    async def connect(self, local: str, address: str, port: int) -> socket.socket:
        """Return an encrypted connection to a host."""
        connection = self._socket()
        try:
            connection.bind((local, 0))
            await asyncio.get_running_loop().sock_connect(connection, (address, port))
        except BaseException:
            connection.close()
            raise
        return connection

    def accept(self, listener: socket.socket) -> tuple[socket.socket, str]:
        """Return a new connection and the host's address."""
        connection, (address, *_) = listener.accept()
        return connection, address

    def _socket(self) -> socket.socket:
        if not hasattr(socket, "AF_BLUETOOTH"):
            raise OSError(errno.EAFNOSUPPORT, "no Bluetooth sockets")
        fresh = socket.socket(socket.AF_BLUETOOTH, socket.SOCK_SEQPACKET, socket.BTPROTO_L2CAP)
        fresh.setblocking(False)
        fresh.setsockopt(SOL_BLUETOOTH, BT_SECURITY, bytes([MEDIUM, 0]))
        return fresh


class _Host:
    """The channels of one host, of which one may not be connected yet."""

    def __init__(self) -> None:
        self.sockets: dict[int, socket.socket] = {}
        self.channels = HidChannels()
        self.waiting: list[bytes] = []  # for the interrupt channel


class ClassicTransport(HidTransport):
    """Service record and channels, registered with BlueZ."""

    def __init__(self, device: HidDevice, name: str, radio: L2capSockets | None = None) -> None:
        """Prepare the service; `radio` makes the sockets, by default the kernel's."""
        super().__init__(device, name)
        self._radio = L2capSockets() if radio is None else radio
        self._address = ""  # of the adapter
        self._listeners: list[socket.socket] = []
        self._hosts: dict[str, _Host] = {}  # by address
        self._connecting: asyncio.Task[None] | None = None

    # --- the registration ---

    async def begin(self, bus: Bus, adapter: str) -> None:
        """Register with BlueZ, and listen for hosts; BluetoothError if that is not possible."""
        objects = await bus.objects()
        self._adapter, self._devices = adapter, devices(objects, adapter)
        self._address = objects[adapter][ADAPTER]["Address"]
        loop = asyncio.get_running_loop()
        for port in (CONTROL, INTERRUPT):
            listener = self._listen(port)
            self._listeners.append(listener)
            loop.add_reader(listener, self._accept, listener, port)
        options = {
            "ServiceRecord": variant("s", record(self._name)),
            "Role": variant("s", "server"),
            "RequireAuthentication": variant("b", True),
            "RequireAuthorization": variant("b", False),
        }
        # BlueZ requires an object, but calls nothing of it: hosts connect to the listeners.
        bus.export(PROFILE, ServiceInterface("org.bluez.Profile1"))
        await bus.call(ROOT, MANAGER, "RegisterProfile", "osa{sv}", PROFILE, UUID, options)
        bus.listen(self._follow)
        self._hid.open(self)

    async def end(self) -> None:
        """Release all keys on the host, and close the channels."""
        self._hid.close()  # sends the last reports if a host is connected
        self.seek(False)
        loop = asyncio.get_running_loop()
        for listener in self._listeners:
            loop.remove_reader(listener)
            listener.close()
        self._listeners.clear()
        for address in list(self._hosts):
            self._close(address, "the orb is switched off")

    # --- called by the device ---

    def send(self, report: Report) -> None:
        """Send a report to the active host."""
        address = self._hid.hosts.active
        host = self._hosts.get(address)
        if host is not None and (message := host.channels.report(report)) is not None:
            last = host.waiting[-1] if host.waiting else bytes(2)
            if supersedes(report, Report(last[1], last[2:])):
                host.waiting.pop()  # a contact never waits behind another
            host.waiting.append(message)
            self._write(address, host)

    def drop(self, address: str) -> None:
        """Close a host's channels after the pending output."""
        asyncio.get_running_loop().call_soon(self._close, address, "another host is active")

    def seek(self, wanted: bool) -> None:
        """Start or stop connecting to the host that was active last."""
        if self._connecting is not None:
            self._connecting.cancel()
        loop = asyncio.get_running_loop()
        self._connecting = loop.create_task(self._reconnect()) if wanted else None

    def _changed(self, before: Properties, after: Properties) -> None:
        if bonded(before) and not bonded(after):
            self._close(before["Address"], "it is no longer paired")

    def _is_bonded(self, address: str) -> bool:
        return any(bonded(one) and one["Address"] == address for one in self._devices.values())

    # --- the channels ---

    def _listen(self, port: int) -> socket.socket:
        try:
            return self._radio.listen(self._address, port)
        except OSError as error:
            problem = {
                errno.EADDRINUSE: "bluetoothd's input plugin has the HID channels of this adapter; "
                "start bluetoothd with --noplugin=input (orbtouch docs hid), or use --link hid:",
                errno.EACCES: "only a service may wait on the HID channels; give it the capability "
                "CAP_NET_BIND_SERVICE, or use --link hid:",
                errno.EAFNOSUPPORT: "this Python was built without Bluetooth sockets; use the "
                "system's python3, or --link hid:, which needs none",
            }.get(error.errno or 0, f"cannot wait on the HID channels: {error.strerror or error}")
            raise BluetoothError(problem) from error

    def _accept(self, listener: socket.socket, port: int) -> None:
        with contextlib.suppress(OSError):  # closed before it was accepted
            connection, address = self._radio.accept(listener)
            connection.setblocking(False)
            if not self._is_bonded(address):
                log.warning("%s is not paired, and was refused", address)
                connection.close()
                return
            self._attach(address, port, connection)

    def _attach(self, address: str, port: int, connection: socket.socket) -> None:
        host = self._hosts.setdefault(address, _Host())
        if port in host.sockets:
            connection.close()
            return
        host.sockets[port] = connection
        asyncio.get_running_loop().add_reader(connection, self._read, address, port)
        if len(host.sockets) == 2:
            self._hid.arrive(address)

    def _read(self, address: str, port: int) -> None:
        host = self._hosts[address]
        try:
            message = host.sockets[port].recv(PACKET)
            if not message:
                raise ConnectionResetError("the host closed it")
            if port == CONTROL and (answer := host.channels.control(message)) is not None:
                host.sockets[port].send(answer)
        except BlockingIOError:
            return
        except OSError as error:
            self._close(address, str(error))
            return
        if host.channels.unplugged:
            self._close(address, "the host has unplugged it")

    def _write(self, address: str, host: _Host) -> None:
        """Send queued reports, as many as the channel accepts."""
        connection, loop = host.sockets.get(INTERRUPT), asyncio.get_running_loop()
        if connection is None:
            return
        try:
            while host.waiting:
                connection.send(host.waiting[0])
                del host.waiting[0]
            loop.remove_writer(connection)
        except BlockingIOError:
            if len(host.waiting) > WAITING:
                self._close(address, "the host takes no reports")
            else:
                loop.add_writer(connection, self._write, address, host)
        except OSError as error:
            loop.call_soon(self._close, address, str(error))

    def _close(self, address: str, reason: str) -> None:
        host = self._hosts.pop(address, None)
        if host is None:
            return
        log.info("the channels of host %s are closed: %s", address, reason)
        loop = asyncio.get_running_loop()
        for connection in (host.sockets.get(INTERRUPT), host.sockets.get(CONTROL)):
            if connection is not None:  # in the order of section 4.3.2 of the profile
                loop.remove_reader(connection)
                loop.remove_writer(connection)
                connection.close()
        self._hid.leave(address)

    async def _reconnect(self) -> None:
        """Connect to the last active host, again until it succeeds; `seek` cancels it."""
        attempt = 0
        while True:
            await asyncio.sleep(PAUSES_S[min(attempt, len(PAUSES_S) - 1)])
            attempt += 1
            address = self._hid.hosts.known.wanted
            if address in self._hosts or not self._is_bonded(address):
                continue
            fresh: dict[int, socket.socket] = {}
            with contextlib.suppress(OSError), contextlib.ExitStack() as stack:  # it may be away
                for port in (CONTROL, INTERRUPT):
                    connecting = self._radio.connect(self._address, address, port)
                    fresh[port] = await asyncio.wait_for(connecting, CONNECT_S)
                    stack.callback(fresh[port].close)
                stack.pop_all()
                for port, connection in fresh.items():
                    self._attach(address, port, connection)
