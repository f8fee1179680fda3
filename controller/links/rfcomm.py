"""A link that waits for bonded hosts over Bluetooth: rfcomm:, or rfcomm:hci1 for one adapter."""

from __future__ import annotations

import contextlib
import logging
import queue
import socket

from controller.errors import how_to_install
from controller.links.base import Access, LinkAwayError, LinkError
from controller.links.bluetooth import bluez
from controller.links.bluetooth.bluez import BluetoothError
from controller.links.bluetooth.identifiers import CHANNEL
from controller.links.byte_link import StreamLink
from controller.protocol.messages import Welcome

PEERS = 4  # connections at a time; one of them is the host, the others get a refusal

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: Access) -> RfcommLink:
    """Offer the serial port service on an adapter, and wait for hosts.

    Raises:
        LinkError: There is no Bluetooth, or it is another program's.
    """
    adapter = url.partition(":")[2]
    if adapter.startswith("//"):
        raise LinkError(
            f"{url} is where a host connects to; the orb itself waits: --link rfcomm:, or "
            "rfcomm:hci1 for one adapter of several"
        )
    if not bluez.available():
        raise LinkAwayError(f"rfcomm: needs dbus-fast; {how_to_install('bluetooth')}")
    return RfcommLink(adapter, welcome, access)


class RfcommLink(StreamLink):
    """One host at a time, bonded and encrypted; bluetoothd and the adapter may come and go.

    Attributes:
        url: Where hosts connect to: rfcomm://ADDRESS:CHANNEL.
    """

    authenticated = True  # only bonded hosts on an encrypted line are let in

    def __init__(self, adapter: str, welcome: Welcome, access: Access) -> None:
        """Register with BlueZ, and begin."""
        from controller.links.bluetooth.registration import RegistrationThread
        from controller.links.bluetooth.serial_profile import SerialService

        super().__init__(welcome, access)
        self._arrived: queue.SimpleQueue[tuple[socket.socket, str, str]] = queue.SimpleQueue()
        self._leaving: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._paths: dict[socket.socket, str] = {}  # of each one's device in BlueZ
        service = SerialService(self._accept, self._leave)
        self._keeper = RegistrationThread([service], adapter)
        try:
            self._keeper.start()
        except BluetoothError as error:
            self._shut()
            raise LinkAwayError(f"cannot wait for hosts over Bluetooth: {error}") from None
        self.url = f"rfcomm://{service.address}:{CHANNEL}"
        self.start()

    @property
    def state(self) -> str:
        """Whether Bluetooth is "ready", or what is missing."""
        return self._keeper.state

    def pair(self, seconds: int) -> None:
        """Let new hosts find and pair with us for a while, without waiting."""
        self._keeper.pair(seconds)

    def close(self) -> None:
        """Send Bye, unregister, and end both threads."""
        super().close()
        self._keeper.close()

    # --- the keeper's side ---

    def _accept(self, connection: socket.socket, who: str, path: str) -> None:
        self._arrived.put((connection, who, path))
        self._wake()

    def _leave(self, path: str) -> None:
        self._leaving.put(path)
        self._wake()

    # --- the thread's side ---

    def _woken(self, events: int) -> None:
        super()._woken(events)
        with contextlib.suppress(queue.Empty):
            while True:
                self._join(*self._arrived.get_nowait())
        with contextlib.suppress(queue.Empty):
            while True:
                self._part(self._leaving.get_nowait())

    def _join(self, connection: socket.socket, who: str, path: str) -> None:
        self._paths = {open_: its for open_, its in self._paths.items() if open_.fileno() >= 0}
        if len(self._paths) >= PEERS:
            connection.close()
            return
        log.info("%s opened the serial port", who)
        self._paths[connection] = path
        self._attach(connection)

    def _part(self, path: str) -> None:
        for peer in tuple(self._peers):
            if isinstance(peer.stream, socket.socket) and self._paths.get(peer.stream) == path:
                self._detach(peer, "it was disconnected")
