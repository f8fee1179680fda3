"""A virtual air between two Bluetooth devices, in pure Python: Bumble's controllers and stack.

`Air` is what a kernel and a radio would be: it connects RFCOMM by address, and tells the
orb's side of hosts that came. Bumble's virtual controllers encrypt no classic links: that a link is
encrypted is shown on a real kernel, in tests/system.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
import threading
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Coroutine
from typing import Any

from bumble import rfcomm
from bumble.controller import Controller
from bumble.core import UUID, PhysicalTransport
from bumble.device import Device, DeviceConfiguration
from bumble.hci import Address
from bumble.host import Host
from bumble.link import LocalLink
from bumble.sdp import DataElement, ServiceAttribute
from bumble.transport.common import AsyncPipeSink

LAPTOP, ORB = "F0:F0:F0:F0:F0:F0", "F1:F1:F1:F1:F1:F1"
HANDLE = 0x10001
CHUNK = 4096


class _Radio(Controller):
    acl_data_packet_length = 1021  # as real ones have; Bumble's own 27 is the least allowed


class Air:
    """A laptop and an orb on one virtual link; everything runs on a thread of its own."""

    def __init__(self, record: str, channel: int) -> None:
        """Power both on; `record` is as BlueZ takes it, `channel` the RFCOMM server's."""
        # called on the thread with the orb's end of every RFCOMM connection
        self.arrived: Callable[[socket.socket], None] = socket.socket.close
        self.channel = channel  # that `open_channel` connects to
        self._connections: dict[str, Any] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="air", daemon=True)
        self._thread.start()
        self._do(self._power_on(record, channel))

    def open_channel(self, address: str, local: str = "") -> socket.socket:
        """Connect to the RFCOMM channel, as `host.connection.rfcomm.open_channel` does."""
        near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        near.setblocking(False)
        try:
            self._do(self._open_dlc(address, self.channel, far))
        except BaseException:
            near.close()
            far.close()
            raise
        return near

    def close(self) -> None:
        self._do(self._end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    # --- the thread's side ---

    def _do(self, task: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(task, self._loop).result(timeout=20.0)

    async def _power_on(self, record: str, channel: int) -> None:
        untyped: Any = LocalLink
        link = untyped()
        self._laptop, self._orb = _device("laptop", LAPTOP, link), _device("orb", ORB, link)
        for device in (self._laptop, self._orb):
            await device.power_on()
        self._server = rfcomm.Server(self._orb)
        self._server.listen(self._accept, channel)
        self._orb.sdp_service_records = {HANDLE: attributes(record)}
        await self._orb.set_connectable(True)

    async def _end(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _connected(self, address: str) -> Any:
        if address != ORB:
            raise OSError(errno.EHOSTDOWN, os.strerror(errno.EHOSTDOWN))
        if address not in self._connections:
            self._connections[address] = await self._laptop.connect(
                Address(ORB, Address.PUBLIC_DEVICE_ADDRESS), transport=PhysicalTransport.BR_EDR
            )
        return self._connections[address]

    async def _open_dlc(self, address: str, channel: int, end: socket.socket) -> None:
        connection = await self._connected(address)
        if "mux" not in self._connections:
            self._connections["mux"] = await rfcomm.Client(connection).start()
        try:
            self._join(await self._connections["mux"].open_dlc(channel), end)
        except Exception:
            raise OSError(errno.ECONNREFUSED, os.strerror(errno.ECONNREFUSED)) from None

    def _accept(self, dlc: Any) -> None:
        near, far = socket.socketpair()
        self._join(dlc, far)
        self.arrived(near)

    def _join(self, dlc: Any, end: socket.socket) -> None:
        """Let bytes pass between a connection and a socket, both ways and to the end."""

        def take(data: bytes) -> None:
            with contextlib.suppress(OSError):
                end.send(data)

        dlc.on("close", lambda: end.shutdown(socket.SHUT_WR) if end.fileno() >= 0 else None)
        self._pump(end, dlc.write, dlc.disconnect)
        dlc.sink = take

    def _pump(self, end: socket.socket, write: Callable[[bytes], Any], over: Any) -> None:
        async def pump() -> None:
            try:
                while data := await self._loop.sock_recv(end, CHUNK):
                    write(data)
            except OSError:
                pass
            finally:
                end.close()
            with contextlib.suppress(Exception):  # the other side may have been faster
                await over()

        end.setblocking(False)
        task = self._loop.create_task(pump())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def _device(name: str, address: str, link: Any) -> Device:
    configuration = DeviceConfiguration()
    configuration.name, configuration.address = name, Address(address)
    configuration.classic_enabled = True
    controller = _Radio(name, link=link, public_address=address)
    return Device(config=configuration, host=Host(controller, AsyncPipeSink(controller)))


def attributes(record: str) -> list[ServiceAttribute]:
    """Return a record, as BlueZ takes it, in Bumble's words; the standard wants a handle, too."""
    return [ServiceAttribute(0x0000, DataElement.unsigned_integer_32(HANDLE))] + [
        ServiceAttribute(int(attribute.attrib["id"], 16), _element(attribute[0]))
        for attribute in ElementTree.fromstring(record)
    ]


def _element(node: ElementTree.Element) -> DataElement:
    value = node.attrib.get("value", "")
    match node.tag:
        case "sequence":
            return DataElement.sequence([_element(child) for child in node])
        case "uuid":
            short = value.startswith("0x")
            return DataElement.uuid(UUID.from_16_bits(int(value, 16)) if short else UUID(value))
        case "uint8":
            return DataElement.unsigned_integer_8(int(value, 16))
        case "uint16":
            return DataElement.unsigned_integer_16(int(value, 16))
        case "text":
            data = bytes.fromhex(value) if node.get("encoding") == "hex" else value.encode()
            return DataElement(DataElement.TEXT_STRING, data)
        case "boolean":
            return DataElement.boolean(value == "true")
    raise ValueError(f"a record has no {node.tag}")
