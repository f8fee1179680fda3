"""The orb as a gamepad, over the air of a virtual controller, for a host that is all Bumble's."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

pytest.importorskip("bumble", reason="the virtual controllers are Bumble's: pip install bumble")

from bumble import core, hci, sdp
from bumble.att import ATT_Error
from bumble.device import Connection, Device, Peer
from bumble.gatt_client import CharacteristicProxy

from controller.links.bluetooth.hid.l2cap import REPORTS
from controller.links.bluetooth.hid.report_map import GAMEPAD, KEYBOARD, PNP_ID, REPORT_MAP
from controller.links.bluetooth.hid.reports import RELEASED, Report, gamepad
from controller.protocol.messages import Command, State
from tests.reference import hid
from tests.support.bumble_orb import HOST, ORB, ClassicHost, ClassicOrb, GattOrb, devices

REPORT_MAP_UUID, REPORT, BATTERY, PNP = 0x2A4B, 0x2A4D, 0x2A19, 0x2A50
BR_EDR = core.PhysicalTransport.BR_EDR


def press(orb: GattOrb | ClassicOrb, name: str) -> None:
    """Let the player make a gesture, and hold the orb."""
    orb.pad.take(Command(name, "press", 1.0, None, 1))
    orb.pad.take(State((name,)))


async def heard(reports: asyncio.Queue[Report], count: int) -> list[Report]:
    """Return the next reports that a host gets."""
    return [await asyncio.wait_for(reports.get(), 10.0) for _ in range(count)]


# --- over GATT ------------------------------------------------------------------------------------


class Reader:
    """A host's side of HID over GATT: it finds, pairs, reads and listens."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.reports: asyncio.Queue[Report] = asyncio.Queue()
        self.connection: Connection
        self.peer: Peer

    async def find(self) -> None:
        """Connect to whoever advertises a gamepad."""
        found: asyncio.Future[hci.Address] = asyncio.get_running_loop().create_future()

        def see(advertisement: object) -> None:
            data = advertisement.data  # type: ignore[attr-defined]
            if data.get(core.AdvertisingData.APPEARANCE) and not found.done():
                found.set_result(advertisement.address)  # type: ignore[attr-defined]

        self.device.on("advertisement", see)
        await self.device.start_scanning()
        address = await asyncio.wait_for(found, 10.0)
        await self.device.stop_scanning()
        self.connection = await self.device.connect(address)
        self.peer = Peer(self.connection)
        await self.peer.request_mtu(185)
        await self.peer.discover_services()
        await self.peer.discover_characteristics()

    def all(self, uuid: int) -> list[CharacteristicProxy[bytes]]:
        """Return the characteristics with a UUID."""
        return self.peer.get_characteristics_by_uuid(core.UUID.from_16_bits(uuid))

    async def read(self, uuid: int) -> bytes:
        """Return a value."""
        return bytes(await self.peer.read_value(self.all(uuid)[0]))

    async def listen(self) -> None:
        """Subscribe to every input report, by the id that its descriptor tells."""
        for one in self.all(REPORT):
            await self.peer.discover_descriptors(one)
            descriptor = one.get_descriptor(core.UUID.from_16_bits(0x2908))
            assert descriptor is not None
            number, kind = await self.peer.read_value(descriptor)
            if kind == 1:

                def take(value: bytes, number: int = number) -> None:
                    self.reports.put_nowait(Report(number, bytes(value)))

                await self.peer.subscribe(one, take)


def over_gatt(scene: Callable[[Reader, GattOrb], Awaitable[None]]) -> Callable[[], None]:
    """Make a test of a scene: both are switched on, and the host finds the orb."""

    async def whole() -> None:
        host, device = devices()
        orb = GattOrb(device)
        for each in (host, device):
            await each.power_on()
        await device.start_advertising(
            auto_restart=True, advertising_interval_min=20.0, advertising_interval_max=20.0
        )
        reader = Reader(host)
        await reader.find()
        await scene(reader, orb)
        for each in (host, device):
            await each.power_off()

    return lambda: asyncio.run(whole())


@over_gatt
async def test_before_pairing_a_host_reads_nothing_over_gatt(host: Reader, orb: GattOrb) -> None:
    for uuid in (REPORT_MAP_UUID, REPORT, BATTERY, PNP):
        with pytest.raises(ATT_Error, match="INSUFFICIENT_ENCRYPTION"):
            await host.read(uuid)
    assert orb.told == []


@over_gatt
async def test_a_paired_host_reads_every_value(host: Reader, orb: GattOrb) -> None:
    await host.connection.pair()
    report_map = await host.read(REPORT_MAP_UUID)
    assert report_map == REPORT_MAP  # longer than a packet: read in parts
    assert hid.parse(report_map).ids(hid.INPUT) == {KEYBOARD, GAMEPAD}
    assert await host.read(BATTERY) == bytes([87])
    assert await host.read(PNP) == PNP_ID
    assert orb.told == [HOST]


@over_gatt
async def test_a_gesture_arrives_as_a_report_of_the_map(host: Reader, orb: GattOrb) -> None:
    await host.connection.pair()
    descriptor = hid.parse(await host.read(REPORT_MAP_UUID))
    await host.listen()
    press(orb, "down")
    press(orb, "rotate_cw")
    # The orb holds one gesture at a time; the tap of rotate_cw ends by itself.
    told = await heard(host.reports, 4)
    assert told == [gamepad(names) for names in ({"down"}, {"down", "a"}, {"a"}, ())]
    both = told[1]
    values = descriptor.decode(hid.INPUT, both.id, both.data)
    assert values[0x09 << 16 | 1] == 1  # button 1
    assert values[0x01 << 16 | 0x39] == 4  # hat, 180 degrees


# --- over classic Bluetooth -----------------------------------------------------------------------


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
async def test_gestures_arrive_over_the_interrupt_channel(
    host: ClassicHost, orb: ClassicOrb
) -> None:
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
