"""Link over a Bluetooth serial port: rfcomm:, or rfcomm:hci1 for one adapter."""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable
from functools import partial

from controller.links.base import Access, LinkAwayError, LinkError
from controller.links.bluetooth.registration import BluetoothLink, RegistrationThread
from controller.links.byte_link import StreamLink
from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.bluez import CHANNEL, BluetoothError
from controller.shared.errors import how_to_install
from controller.shared.protocol.messages import Welcome
from controller.shared.request_queue import RequestQueue

PEERS = 4  # connections at a time; one of them is the host, the others are refused

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: Access) -> RfcommLink:
    """Register the serial port on an adapter; LinkError if Bluetooth is missing or taken."""
    adapter = url.partition(":")[2]
    if adapter.startswith("//"):
        raise LinkError(
            f"{url} is where a host connects to; the orb itself waits: --link rfcomm:, or "
            "rfcomm:hci1 for one adapter of several"
        )
    if not bluez.available():
        raise LinkAwayError(f"rfcomm: needs dbus-fast; {how_to_install('bluetooth')}")
    return RfcommLink(adapter, welcome, access)


class RfcommLink(StreamLink, BluetoothLink):
    """Link to one bonded host at a time, over an encrypted connection.

    It registers again when bluetoothd or the adapter returns. `url` is rfcomm://ADDRESS:CHANNEL.
    """

    authenticated = True  # only bonded hosts on encrypted connections are accepted

    def __init__(self, adapter: str, welcome: Welcome, access: Access) -> None:
        """Register with BlueZ, and start."""
        from controller.links.bluetooth.serial_profile import SerialService

        super().__init__(welcome, access)
        self._calls: RequestQueue[Callable[[], None]] = RequestQueue()  # for the I/O thread
        self._paths: dict[socket.socket, str] = {}  # BlueZ's path of each device
        service = SerialService(self._accept, self._leave)
        self._registration = RegistrationThread(service, adapter)
        try:
            self._registration.start()
        except BluetoothError as error:
            self._shut()
            raise LinkAwayError(f"cannot wait for hosts over Bluetooth: {error}") from None
        self.url = f"rfcomm://{service.address}:{CHANNEL}"
        self.start()

    def close(self) -> None:
        """Send Bye, unregister, and end both threads."""
        super().close()
        self._registration.close()

    # --- on the registration's thread ---

    def _accept(self, connection: socket.socket, host: str, path: str) -> None:
        self._calls.put(partial(self._join, connection, host, path))
        self._wake()

    def _leave(self, path: str) -> None:
        self._calls.put(partial(self._part, path))
        self._wake()

    # --- on the I/O thread ---

    def _woken(self, events: int) -> None:
        super()._woken(events)
        for call in self._calls.take():
            call()

    def _join(self, connection: socket.socket, host: str, path: str) -> None:
        self._paths = {one: its for one, its in self._paths.items() if one.fileno() >= 0}  # open
        if len(self._paths) >= PEERS:
            connection.close()
            return
        log.info("%s opened the serial port", host)
        self._paths[connection] = path
        self._attach(connection)

    def _part(self, path: str) -> None:
        for peer in tuple(self._peers):
            if isinstance(peer.stream, socket.socket) and self._paths.get(peer.stream) == path:
                self._detach(peer, "it was disconnected")
