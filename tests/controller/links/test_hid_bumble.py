"""The orb as a gamepad, over the air of a virtual controller, for a host that is all Bumble's.

Bumble (https://google.github.io/bumble) is a Bluetooth stack and a virtual controller in Python.
Here it carries what our services and channels say; the host's side knows nothing of ours.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

pytest.importorskip("bumble", reason="the virtual controllers are Bumble's: pip install bumble")

from pathlib import Path
from typing import Any

from bumble import core, hci, l2cap, sdp
from bumble.controller import Controller
from bumble.device import Device, DeviceConfiguration
from bumble.hid import Host as HidHost
from bumble.host import Host
from bumble.link import LocalLink
from bumble.pairing import PairingConfig, PairingDelegate
from bumble.transport.common import AsyncPipeSink

from controller.links.bluetooth.hid.held_keys import HeldKeys
from controller.links.bluetooth.hid.hid_device import HidDevice, HidTransport
from controller.links.bluetooth.hid.hosts import HostSelection, StoredHosts
from controller.links.bluetooth.hid.l2cap import CONTROL, INTERRUPT, REPORTS, HidChannels, record
from controller.links.bluetooth.hid.reports import (
    GAMEPAD,
    KEYBOARD,
    OUTPUTS,
    RELEASED,
    Report,
    gamepad,
)
from controller.shared.bluetooth.bluez import Bus, Properties
from controller.shared.keymap.keymap import load
from controller.shared.protocol.messages import Command, State
from tests.reference import hid
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
            HeldKeys(load(Path("gamepad"), OUTPUTS)),
            hosts,
            notify=self.told.append,
            store=lambda known: None,
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


BR_EDR = core.PhysicalTransport.BR_EDR


def press(orb: ClassicOrb, name: str) -> None:
    """Let the player make a gesture, and hold the orb."""
    orb.pad.take(Command(name, "press", 1.0, None, 1))
    orb.pad.take(State((name,)))


def over_classic(scene: Callable[[ClassicHost, ClassicOrb], Awaitable[None]]) -> Callable[[], None]:
    """Make a test of a scene: both are switched on, and the host connects."""

    async def whole() -> None:
        device, other = devices()
        orb = ClassicOrb(other)
        host = ClassicHost(device)
        for each in (device, other):
            await each.power_on()
            await each.set_connectable(True)
        connection = await device.connect(
            hci.Address(ORB, hci.Address.PUBLIC_DEVICE_ADDRESS), transport=BR_EDR
        )
        host.on_device_connection(connection)
        await scene(host, orb)
        for each in (device, other):
            await each.power_off()

    return lambda: asyncio.run(whole())


async def open_channels(host: ClassicHost, orb: ClassicOrb) -> None:
    """Do what a host does after pairing."""
    await host.connect_control_channel()
    await host.connect_interrupt_channel()
    orb.opened()


async def come(host: ClassicHost, count: int) -> list[Report]:
    """Return the next reports of the interrupt channel."""
    return [
        Report(data[0], data[1:])
        for data in [await asyncio.wait_for(host.reports.get(), 10.0) for _ in range(count)]
    ]


@over_classic
async def test_the_report_map_is_in_the_service_record(host: ClassicHost, orb: ClassicOrb) -> None:
    assert host.connection is not None
    client = sdp.Client(host.connection)
    await client.connect()
    records = await client.search_attributes(
        [core.BT_HUMAN_INTERFACE_DEVICE_SERVICE], [(0, 0xFFFF)]
    )
    await client.disconnect()
    (found,) = records
    values = {attribute.id: attribute.value for attribute in found}
    descriptor = values[0x0206].value[0].value[1].value
    assert hid.parse(descriptor).ids(hid.INPUT) == {KEYBOARD, GAMEPAD}
    control = values[0x0004].value[0].value[1].value
    interrupt = values[0x000D].value[0].value[0].value[1].value
    assert (control, interrupt) == (0x11, 0x13)


@over_classic
async def test_gestures_arrive_over_the_interrupt_pipe(host: ClassicHost, orb: ClassicOrb) -> None:
    await open_channels(host, orb)
    assert await come(host, 2) == list(RELEASED)
    press(orb, "rotate_cw")
    assert await come(host, 2) == [gamepad({"a"}), gamepad({})]


@over_classic
async def test_the_control_channel_follows_the_profile(host: ClassicHost, orb: ClassicOrb) -> None:
    await open_channels(host, orb)
    press(orb, "down")
    asked = await host.ask(lambda: host.get_report(1, GAMEPAD, 0))
    assert bytes(asked) == bytes([0xA1, GAMEPAD]) + gamepad({"down"}).data
    assert await host.ask(lambda: host.get_report(1, 9, 0)) == 2  # no such report
    assert await host.ask(lambda: host.set_report(2, b"\x01\x02")) == 0  # Caps Lock
    assert bytes(await host.ask(host.get_protocol)) == bytes([0xA0, REPORTS])
    assert await host.ask(lambda: host.set_protocol(0)) == 0
    assert bytes(await host.ask(host.get_protocol)) == bytes([0xA0, 0])
    host.suspend()
    host.virtual_cable_unplug()
    await host.ask(host.get_protocol)
    assert orb.talk.unplugged


@over_classic
async def test_the_orb_reconnects_with_nothing_down(host: ClassicHost, orb: ClassicOrb) -> None:
    await open_channels(host, orb)
    press(orb, "down")
    await come(host, 3)
    for _ in range(5):
        assert host.connection is not None
        await host.connection.disconnect()
        await orb.closed()
        host.forget()
        while not host.reports.empty():
            host.reports.get_nowait()
        await orb.call(HOST)
        await host.opened()
        orb.opened()
        assert await come(host, 2) == list(RELEASED)
    assert orb.told == [HOST, *["", HOST] * 5]
