"""The orb as a gamepad, over the air of a virtual controller, for a host that is all Bumble's."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

pytest.importorskip("bumble", reason="the virtual controllers are Bumble's: pip install bumble")

from bumble import core, hci, sdp

from controller.links.bluetooth.hid.l2cap import REPORTS
from controller.links.bluetooth.hid.reports import GAMEPAD, KEYBOARD, RELEASED, Report, gamepad
from controller.shared.protocol.messages import Command, State
from tests.reference import hid
from tests.support.bumble_orb import HOST, ORB, ClassicHost, ClassicOrb, devices

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
