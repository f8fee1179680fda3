"""HID over GATT against a bluetoothd that the tests play, on a bus of their own."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("dbus_fast", reason="HID over GATT needs dbus-fast: the extra [bluetooth]")
if shutil.which("dbus-daemon") is None:
    pytest.skip("a private bus needs dbus-daemon (Debian: dbus)", allow_module_level=True)

from controller.links.bluetooth.hid.gatt import GattTransport
from controller.links.bluetooth.hid.hosts import StoredHosts
from controller.links.bluetooth.hid.reports import PNP_ID, RELEASED, REPORT_MAP, gamepad, keyboard
from controller.shared.bluetooth.bluez import BluetoothError, Bus
from tests.reference import hid
from tests.support.fake_bluez_gatt import ADAPTER, FakeBluez, HidTable, RefusedError, address, scene

__all__ = ["address"]

NOBODY = StoredHosts()
LAPTOP, PHONE = "AA:00:00:00:00:01", "AA:00:00:00:00:02"
REPORT, BOOT_KEYBOARD, BATTERY, MODE = 0x2A4D, 0x2A22, 0x2A19, 0x2A4E
KEYBOARD, PAD, LIGHTS = 0, 1, 2  # instances of the characteristic Report


class Table(HidTable):
    """The orb's GATT services registered with a fake bluetoothd."""

    def __init__(self, bluez: FakeBluez, bus: Bus, known: StoredHosts, mapping: str) -> None:
        super().__init__(bluez, bus, known, mapping)
        self.part = GattTransport(self.pad, "OrbTouch")

    async def again(self) -> Bus:
        """Return a new connection to the bus, as for every round of the keeper."""
        await self.leave()
        self.bus = await Bus.connect()
        return self.bus

    async def leave(self) -> None:
        """Leave the bus."""
        self.bus.close()
        await self.bus.lost()

    async def settle(self) -> None:
        """Return when everything that is on its way has arrived."""
        for _ in range(3):
            await self.bus.running()
            await self.bluez.bus.introspect("org.freedesktop.DBus", "/org/freedesktop/DBus")

    async def play(self, address: str) -> None:
        """Let a paired host come, and do what every host does."""
        self.bluez.connect(address)
        await self.bluez.read(address, 0x2A4B)
        for instance in (KEYBOARD, PAD):
            await self.bluez.listen(address, REPORT, instance)
        await self.settle()

    def values(self, address: str) -> list[bytes]:
        """Return what a host has heard, and forget it."""
        heard = [value for who, _, value in self.bluez.heard if who == address]
        self.bluez.heard.clear()
        return heard


@asynccontextmanager
async def table(
    address: str, known: StoredHosts = NOBODY, mapping: str = "gamepad"
) -> AsyncIterator[Table]:
    """Play bluetoothd, register the part, and end both."""
    bluez = await FakeBluez.start(address)
    bus = await Bus.connect()
    for host in (LAPTOP, PHONE):
        bluez.know(host)
    it = Table(bluez, bus, known, mapping)
    try:
        await it.part.begin(bus, ADAPTER)
        await it.settle()
        yield it
    finally:
        await it.part.end()
        await it.leave()
        await bluez.stop()


@pytest.fixture
def play(address: str, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return what plays a scene: play(scene, **options of `table`)."""
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address)

    def run(scene: Callable[[Table], Awaitable[None]], **options: Any) -> None:
        async def whole() -> None:
            async with table(address, **options) as it:
                await scene(it)

        asyncio.run(whole())

    return run


Play = Callable[..., None]


@scene()
async def test_bluez_is_offered_hid_battery_and_device_information(it: Table) -> None:
    services = [
        properties["org.bluez.GattService1"]["UUID"]
        for properties in it.bluez.application.values()
        if "org.bluez.GattService1" in properties
    ]
    assert sorted(services) == ["180a", "180f", "1812"]
    assert len(it.bluez.find(REPORT)) == 3


@scene()
async def test_a_paired_host_reads_what_it_needs_to_know(it: Table) -> None:
    it.bluez.connect(LAPTOP)
    report_map = await it.bluez.read(LAPTOP, 0x2A4B)
    assert report_map == REPORT_MAP
    assert hid.parse(report_map).ids(hid.INPUT) == {1, 2}
    assert await it.bluez.read(LAPTOP, 0x2A50) == PNP_ID
    assert await it.bluez.read(LAPTOP, BATTERY) == bytes([100])
    assert await it.bluez.read(LAPTOP, MODE) == b"\1"
    for instance, reference in enumerate((b"\1\1", b"\2\1", b"\1\2")):
        path = it.bluez.reference(it.bluez.find(REPORT)[instance])[0]
        assert bytes(await it.bluez._call(path, "ReadValue", "a{sv}", {})) == reference


@scene()
async def test_a_host_that_is_not_paired_learns_nothing(it: Table) -> None:
    stranger = "AA:00:00:00:00:09"
    it.bluez.know(stranger, paired=False)
    it.bluez.connect(stranger)
    for uuid in (0x2A4B, REPORT, BATTERY, 0x2A50, 0x2A29, 0x2A4A, MODE):
        with pytest.raises(RefusedError, match="insufficient encryption"):
            await it.bluez.read(stranger, uuid)
    for uuid in (REPORT, BOOT_KEYBOARD, BATTERY):
        with pytest.raises(RefusedError, match="insufficient encryption"):
            await it.bluez.listen(stranger, uuid)
    await it.settle()
    assert it.told == []


@scene()
async def test_the_first_thing_a_host_hears_is_that_nothing_is_down(it: Table) -> None:
    await it.play(LAPTOP)
    assert it.told == [LAPTOP]
    heard = it.values(LAPTOP)
    assert heard
    assert set(heard) == {report.data for report in RELEASED}


@scene()
async def test_commands_become_reports(it: Table) -> None:
    await it.play(LAPTOP)
    it.values(LAPTOP)
    it.press("down")
    it.press("rotate_cw")
    await it.settle()
    assert it.values(LAPTOP)[:2] == [gamepad({"down"}).data, gamepad({"down", "a"}).data]
    await it.bluez.until(lambda: len(it.bluez.heard) == 1)  # the tap ends by itself
    assert it.values(LAPTOP) == [gamepad(()).data]
    assert await it.bluez.read(LAPTOP, REPORT, PAD) == gamepad(()).data


@scene(mapping="keyboard")
async def test_a_host_that_wants_the_boot_protocol_gets_keys_by_it(it: Table) -> None:
    await it.play(LAPTOP)
    await it.bluez.listen(LAPTOP, BOOT_KEYBOARD)
    await it.bluez.write(LAPTOP, MODE, b"\0")
    await it.settle()
    it.bluez.heard.clear()
    it.press("down")
    await it.settle()
    assert it.bluez.heard == [(LAPTOP, "2a22", keyboard(("down",)).data)]


@scene()
async def test_what_a_host_may_not_write_is_refused(it: Table) -> None:
    it.bluez.connect(LAPTOP)
    with pytest.raises(RefusedError, match=r"org\.bluez\.Error\.Failed"):
        await it.bluez.write(LAPTOP, MODE, b"\7")
    with pytest.raises(RefusedError, match=r"org\.bluez\.Error\.InvalidValueLength"):
        await it.bluez.write(LAPTOP, 0x2A4C, b"\0\0")
    await it.bluez.write(LAPTOP, 0x2A4C, b"\0")  # suspend


@scene()
async def test_a_host_that_comes_back_hears_that_nothing_is_down(it: Table) -> None:
    await it.play(LAPTOP)
    for _ in range(5):
        it.press("down")
        await it.settle()
        await it.bluez.disconnect(LAPTOP)
        await it.settle()
        it.bluez.heard.clear()
        it.bluez.connect(LAPTOP)
        for instance in (KEYBOARD, PAD):
            await it.bluez.listen(LAPTOP, REPORT, instance)
        await it.settle()
        assert set(it.values(LAPTOP)) == {report.data for report in RELEASED}
    assert it.told == [LAPTOP, *["", LAPTOP] * 5]


@scene(known=StoredHosts((LAPTOP, PHONE), LAPTOP))
async def test_a_second_host_is_sent_away_and_hears_nothing(it: Table) -> None:
    await it.play(LAPTOP)
    it.bluez.connect(PHONE)
    await it.bluez.until(lambda: it.bluez.disconnected == [PHONE])
    it.press("left")
    await it.settle()
    assert it.values(PHONE) == []


def test_the_player_gives_the_orb_to_another_host(play: Play, tmp_path: Path) -> None:
    mapping = tmp_path / "mine.toml"
    mapping.write_text(
        "[everywhere]\npause = { host = 'next' }\n"
        "[profile.game]\ndown = { pad = 'down', mode = 'hold' }"
    )

    async def scene(it: Table) -> None:
        await it.play(LAPTOP)
        it.press("down")
        await it.settle()
        it.press("pause")
        await it.bluez.until(lambda: it.bluez.disconnected == [LAPTOP])
        assert it.values(LAPTOP)[-2:] == [report.data for report in RELEASED]
        await it.play(PHONE)
        assert it.told == [LAPTOP, "", PHONE]
        assert it.remembered[-1] == StoredHosts((LAPTOP, PHONE), PHONE)

    play(scene, known=StoredHosts((LAPTOP, PHONE), LAPTOP), mapping=str(mapping))


@scene()
async def test_the_orb_says_that_it_is_a_gamepad(it: Table) -> None:
    assert it.bluez.advertisement["ServiceUUIDs"] == ["1812"]
    assert it.bluez.advertisement["Appearance"] == 0x03C4
    assert it.bluez.advertisement["LocalName"] == "OrbTouch"


@scene()
async def test_strangers_are_told_to_look_only_while_pairing_is_asked_for(it: Table) -> None:
    assert it.bluez.advertisement["Discoverable"] is False
    it.bluez._change(ADAPTER, "org.bluez.Adapter1", {"Discoverable": True})
    await it.bluez.until(lambda: it.bluez.advertisement.get("Discoverable"))
    it.bluez._change(ADAPTER, "org.bluez.Adapter1", {"Discoverable": False})
    await it.bluez.until(lambda: it.bluez.advertisement.get("Discoverable") is False)


def test_an_adapter_without_low_energy_is_told_in_one_sentence(address: str, play: Play) -> None:
    async def scene(it: Table) -> None:
        await it.part.end()
        del it.bluez.objects[ADAPTER]["org.bluez.GattManager1"]
        with pytest.raises(BluetoothError, match="use --link hid:classic, or another adapter"):
            await it.part.begin(await it.again(), ADAPTER)

    play(scene)


@scene(known=StoredHosts((LAPTOP, PHONE), LAPTOP))
async def test_hosts_of_another_adapter_are_none_of_ours(it: Table) -> None:
    path = it.bluez.know(PHONE, adapter="/org/bluez/hci1")
    await it.play(LAPTOP)
    it.bluez._change(path, "org.bluez.Device1", {"Connected": True})
    await it.settle()
    assert it.told == [LAPTOP]
    assert it.bluez.disconnected == []
