"""Two Bluetooth devices without a kernel: the orb's HID code, and a host that is all Bumble's.

Bumble (https://google.github.io/bumble) is a Bluetooth stack and a virtual controller in Python.
Here it carries what our services and channels say; the host's side knows nothing of ours.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from bumble import core, gatt, hci, l2cap
from bumble.controller import Controller
from bumble.device import Connection, Device, DeviceConfiguration
from bumble.hid import Host as HidHost
from bumble.host import Host
from bumble.link import LocalLink
from bumble.pairing import PairingConfig, PairingDelegate
from bumble.transport.common import AsyncPipeSink

from controller.keymap.keymap_file import load
from controller.links.bluetooth.bluez import Bus, Properties
from controller.links.bluetooth.hid.gatt_services import APPEARANCE, HID, SERVICES, ServiceValues
from controller.links.bluetooth.hid.hid_device import HidDevice, HidTransport
from controller.links.bluetooth.hid.host_selection import HostSelection, StoredHosts
from controller.links.bluetooth.hid.l2cap import CONTROL, INTERRUPT, HidChannels, record
from controller.links.bluetooth.hid.reports import OUTPUTS, Report
from tests.support.bumble_radio import attributes

ORB, HOST = "F1:F1:F1:F1:F1:F1", "F0:F0:F0:F0:F0:F0"
_PROPERTIES = {
    "encrypt-read": gatt.Characteristic.Properties.READ,
    "encrypt-write": gatt.Characteristic.Properties.WRITE,
    "write-without-response": gatt.Characteristic.Properties.WRITE_WITHOUT_RESPONSE,
    "notify": gatt.Characteristic.Properties.NOTIFY,
}
_MAY = gatt.Characteristic.Permissions
_PERMISSIONS = {
    "encrypt-read": _MAY.READABLE | _MAY.READ_REQUIRES_ENCRYPTION,
    "encrypt-write": _MAY.WRITEABLE | _MAY.WRITE_REQUIRES_ENCRYPTION,
    "write-without-response": _MAY.WRITEABLE,
}


def devices() -> tuple[Device, Device]:
    """Return the host and the orb, linked, both switched off."""
    link, found = LocalLink(), []  # type: ignore[no-untyped-call]
    for name, address in (("host", HOST), ("orb", ORB)):
        controller = Controller(name, link=link, public_address=address)
        config = DeviceConfiguration(name=name, address=hci.Address(address), classic_enabled=True)
        device = Device(config=config, host=Host(controller, AsyncPipeSink(controller)))
        device.pairing_config_factory = lambda connection: PairingConfig(
            sc=True,
            mitm=False,
            bonding=True,
            delegate=PairingDelegate(PairingDelegate.IoCapability.NO_OUTPUT_NO_INPUT),
        )
        found.append(device)
    return found[0], found[1]


class Orb(HidTransport):
    """What both kinds of orbs share.

    Attributes:
        pad: The HID device.
        told: Addresses of active hosts, one after the other.
    """

    def __init__(self, device: Device, mapping: str) -> None:
        self.device = device
        self.told: list[str] = []
        hosts = HostSelection(StoredHosts(), now_s=asyncio.get_running_loop().time())
        self.pad = HidDevice(
            load(Path(mapping), OUTPUTS), hosts, notify=self.told.append, store=lambda known: None
        )
        super().__init__(self.pad, "OrbTouch")
        self.pad.open(self)
        self._tasks: set[asyncio.Task[Any]] = set()

    async def begin(self, bus: Bus, adapter: str) -> None:
        """There is no BlueZ."""

    async def end(self) -> None:
        """There is no BlueZ."""

    def drop(self, address: str) -> None:
        """No host is disconnected here."""

    def _changed(self, before: Properties, after: Properties) -> None:
        """There is no BlueZ."""

    def _do(self, task: Coroutine[Any, Any, Any]) -> None:
        running = asyncio.get_running_loop().create_task(task)
        self._tasks.add(running)
        running.add_done_callback(self._tasks.discard)


class GattOrb(Orb):
    """The orb over GATT: `SERVICES` and `ServiceValues`, carried by Bumble's GATT server."""

    def __init__(self, device: Device, mapping: str = "gamepad") -> None:
        super().__init__(device, mapping)
        self.offer = ServiceValues("OrbTouch", 87)
        self._carried: dict[str, gatt.Characteristic[Any]] = {}
        for uuid, characteristics in SERVICES.items():
            carried = [self._carry(one.name, one.uuid, one.flags, one.descriptors)
                       for one in characteristics]  # fmt: skip
            device.add_service(gatt.Service(core.UUID.from_16_bits(uuid), carried))
        device.advertising_data = bytes(
            core.AdvertisingData(
                [
                    (core.AdvertisingData.COMPLETE_LOCAL_NAME, b"OrbTouch"),
                    (core.AdvertisingData.APPEARANCE, APPEARANCE.to_bytes(2, "little")),
                    (
                        core.AdvertisingData.INCOMPLETE_LIST_OF_16_BIT_SERVICE_CLASS_UUIDS,
                        HID.to_bytes(2, "little"),
                    ),
                ]
            )
        )
        device.on("connection", self._connected)

    def send(self, report: Report) -> None:
        """Notify whoever listens."""
        for name, value in self.offer.report(report):
            self._do(self.device.notify_subscribers(self._carried[name], value))

    def _carry(
        self,
        name: str,
        uuid: int,
        flags: tuple[str, ...],
        descriptors: tuple[tuple[int, bytes], ...],
    ) -> gatt.Characteristic[Any]:
        properties = gatt.Characteristic.Properties(0)
        permissions = _MAY(0)
        for flag in flags:
            properties |= _PROPERTIES.get(flag, gatt.Characteristic.Properties(0))
            permissions |= _PERMISSIONS.get(flag, _MAY(0))
        secret = _PERMISSIONS["encrypt-read"]
        one = gatt.Characteristic(
            core.UUID.from_16_bits(uuid),
            properties,
            permissions,
            gatt.CharacteristicValue(
                read=lambda connection: self._read(name, connection),
                write=lambda connection, value: self.offer.write(name, value),
            ),
            [gatt.Descriptor(core.UUID.from_16_bits(kind), secret, value)
             for kind, value in descriptors],
        )  # fmt: skip
        self._carried[name] = one
        return one

    def _read(self, name: str, connection: Connection) -> bytes:
        if name == "report_map":
            self.pad.arrive(connection.peer_address.to_string(False))
        return self.offer.read(name)

    def _connected(self, connection: Connection) -> None:
        address = connection.peer_address.to_string(False)
        connection.on("disconnection", lambda reason: self.pad.leave(address))


class ClassicOrb(Orb):
    """The orb over classic Bluetooth: `HidChannels` and `record`, carried by Bumble's L2CAP."""

    def __init__(self, device: Device, mapping: str = "gamepad") -> None:
        super().__init__(device, mapping)
        self.talk = HidChannels()
        self._channels: dict[int, l2cap.ClassicChannel] = {}
        device.sdp_service_records = {1: attributes(record("OrbTouch"))}
        for port in (CONTROL, INTERRUPT):
            device.create_l2cap_server(l2cap.ClassicChannelSpec(psm=port), handler=self._opened)

    def send(self, report: Report) -> None:
        """Send a report over the interrupt channel."""
        message = self.talk.report(report)
        if message is not None and INTERRUPT in self._channels:
            self._channels[INTERRUPT].write(message)

    async def call(self, address: str) -> None:
        """Come back to a host by ourselves."""
        connection = await self.device.connect(
            hci.Address(address, hci.Address.PUBLIC_DEVICE_ADDRESS),
            transport=core.PhysicalTransport.BR_EDR,
        )
        for port in (CONTROL, INTERRUPT):
            spec = l2cap.ClassicChannelSpec(psm=port)
            self._opened(await connection.create_l2cap_channel(spec))

    def opened(self) -> None:
        """Both channels are open at both ends: Bumble's host loses what comes before."""
        self.pad.arrive(self._channels[INTERRUPT].connection.peer_address.to_string(False))

    async def closed(self) -> None:
        """Return when no channel is open at this end."""
        await _until(lambda: not self._channels)

    def _opened(self, channel: l2cap.ClassicChannel) -> None:
        if channel.psm == CONTROL:
            self.talk = HidChannels()
            channel.sink = self._control
        self._channels[channel.psm] = channel
        channel.on("close", lambda: self._closed(channel))

    def _closed(self, channel: l2cap.ClassicChannel) -> None:
        if self._channels.pop(channel.psm, None) is not None:
            self.pad.leave(channel.connection.peer_address.to_string(False))

    def _control(self, message: bytes) -> None:
        answer = self.talk.control(message)
        if answer is not None:
            self._channels[CONTROL].write(answer)


class ClassicHost(HidHost):
    """Bumble's own HID host, with everything that it hears.

    Attributes:
        reports: What came over the interrupt channel, its first byte (DATA, input) taken off.
        answers: What came over the control channel.
    """

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self.reports: asyncio.Queue[bytes] = asyncio.Queue()
        self.answers: asyncio.Queue[Any] = asyncio.Queue()
        self.on("interrupt_data", self._hear)
        self.on("handshake", self.answers.put_nowait)
        self.on("control_data", self.answers.put_nowait)

    def _hear(self, message: bytes) -> None:
        assert message[0] == 0xA1  # DATA, input
        self.reports.put_nowait(message[1:])

    async def opened(self) -> None:
        """Return when both channels are open at this end."""
        await _until(lambda: bool(self.l2cap_ctrl_channel and self.l2cap_intr_channel))

    def forget(self) -> None:
        """The connection has gone; Bumble's host keeps the channels that it opened itself."""
        self.l2cap_ctrl_channel = self.l2cap_intr_channel = None

    async def ask(self, question: Callable[[], None]) -> Any:
        """Return the answer to something that is asked over the control channel."""
        question()
        return await asyncio.wait_for(self.answers.get(), 10.0)


async def _until(condition: Callable[[], bool]) -> None:
    async def wait() -> None:
        while not condition():
            await asyncio.sleep(0)

    await asyncio.wait_for(wait(), 10.0)
