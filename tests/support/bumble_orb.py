"""Two Bluetooth devices without a kernel: the orb's HID code, and a host that is all Bumble's.

Bumble (https://google.github.io/bumble) is a Bluetooth stack and a virtual controller in Python.
Here it carries what our services and channels say; the host's side knows nothing of ours.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bumble import core, hci, l2cap
from bumble.controller import Controller
from bumble.device import Device, DeviceConfiguration
from bumble.hid import Host as HidHost
from bumble.host import Host
from bumble.link import LocalLink
from bumble.pairing import PairingConfig, PairingDelegate
from bumble.transport.common import AsyncPipeSink

from controller.links.bluetooth.hid.hid_device import HidDevice, HidTransport
from controller.links.bluetooth.hid.hosts import HostSelection, StoredHosts
from controller.links.bluetooth.hid.l2cap import CONTROL, INTERRUPT, HidChannels, record
from controller.links.bluetooth.hid.reports import OUTPUTS, Report
from controller.shared.bluetooth.bluez import Bus, Properties
from controller.shared.keymap.keymap import load
from tests.support.bumble_radio import attributes

ORB, HOST = "F1:F1:F1:F1:F1:F1", "F0:F0:F0:F0:F0:F0"


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


class ClassicOrb(HidTransport):
    """The orb over classic Bluetooth: `HidChannels` and `record`, carried by Bumble's L2CAP."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.told: list[str] = []  # addresses of active hosts, one after the other
        hosts = HostSelection(StoredHosts(), now_s=asyncio.get_running_loop().time())
        self.pad = HidDevice(
            load(Path("gamepad"), OUTPUTS), hosts, notify=self.told.append, store=lambda known: None
        )
        super().__init__(self.pad, "OrbTouch")
        self.pad.open(self)
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

    async def begin(self, bus: Bus, adapter: str) -> None:
        """There is no BlueZ."""

    async def end(self) -> None:
        """There is no BlueZ."""

    def drop(self, address: str) -> None:
        """No host is disconnected here."""

    def _changed(self, before: Properties, after: Properties) -> None:
        """There is no BlueZ."""

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
    """Bumble's own HID host, with everything that it hears."""

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self.reports: asyncio.Queue[bytes] = asyncio.Queue()  # without the first byte: DATA, input
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
