"""The link hid: from its URL to a host's screen, against a bluetoothd that the tests play."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from controller.links import open_link
from controller.links.base import LinkError
from controller.links.bluetooth.hid import hosts
from controller.links.bluetooth.hid.hosts import StoredHosts
from controller.links.bluetooth.hid.reports import RELEASED, gamepad, keyboard
from controller.links.hid import HidLink
from controller.shared.errors import UserError
from controller.shared.protocol.messages import VERSION, Bye, Command, Hello, Message, State
from tests.support.fake_bluez_gatt import ADAPTER, FakeBluez, RefusedError, address, scene
from tests.support.fake_device import welcome

__all__ = ["address"]

LAPTOP, PHONE = "AA:00:00:00:00:01", "AA:00:00:00:00:02"
RELEASE = [report.data for report in RELEASED]
Scene = Callable[[HidLink, FakeBluez], Awaitable[None]]


@pytest.fixture
def play(address: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., None]:
    """Return what plays a scene: play(scene, url)."""
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address)
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path))

    def run(scene: Scene, url: str = "hid:") -> None:
        async def whole() -> None:
            bluez = await FakeBluez.start(address)
            bluez.know(LAPTOP)
            bluez.know(PHONE)
            try:
                link = await asyncio.to_thread(open_link, url, welcome())
                assert isinstance(link, HidLink)
                try:
                    await scene(link, bluez)
                finally:
                    await asyncio.to_thread(link.close)
            finally:
                await bluez.stop()

        asyncio.run(whole())

    return run


async def come(bluez: FakeBluez, link: HidLink, host: str = LAPTOP) -> None:
    """Let a host come, and the loop hear of it."""
    bluez.connect(host)
    await bluez.read(host, 0x2A4B)
    for instance in (0, 1):
        await bluez.listen(host, 0x2A4D, instance)
    assert await told(link) == [Hello(VERSION, VERSION, "", host, False)]


async def told(link: HidLink) -> list[Message]:
    """Return what the link tells the loop next."""
    await asyncio.to_thread(link.wait, 10.0)
    return link.poll()


def press(link: HidLink, name: str) -> None:
    """Make a gesture and hold it, as the loop says it."""
    link.send(Command(name, "press", 1.0, None, 1), 100)
    link.send(State((name,)), 100)


@scene()
async def test_closing_releases_everything_and_disconnects(link: HidLink, bluez: FakeBluez) -> None:
    await come(bluez, link)
    press(link, "down")
    await bluez.until(lambda: bluez.heard[-1:] == [(LAPTOP, "2a4d", gamepad({"down"}).data)])
    bluez.heard.clear()
    await asyncio.to_thread(link.close)
    assert [value for _, _, value in bluez.heard] == RELEASE
    assert bluez.disconnected == [LAPTOP]
    assert bluez.application == {}


@scene()
async def test_the_loop_is_told_who_comes_and_goes(link: HidLink, bluez: FakeBluez) -> None:
    link.send(State(()), 0)
    assert (link.connected, link.dropped) == (False, 1)
    await come(bluez, link)
    assert link.connected
    await bluez.disconnect(LAPTOP)
    heard: list[Message] = []
    while not any(isinstance(message, Bye) for message in heard):
        heard += await told(link)
    assert not link.connected


@scene("hid:?keys=keyboard")
async def test_keys_are_pressed_where_the_url_wants_them(link: HidLink, bluez: FakeBluez) -> None:
    await come(bluez, link)
    press(link, "drop")
    tap = [keyboard(("space",)).data, keyboard(()).data]
    await bluez.until(lambda: [value for _, _, value in bluez.heard[-2:]] == tap)


def test_the_last_host_of_the_orb_is_remembered(play: Callable[..., None], tmp_path: Path) -> None:
    async def scene(link: HidLink, bluez: FakeBluez) -> None:
        await come(bluez, link)

    play(scene)
    assert hosts.recall(tmp_path / "hid-hosts.json") == StoredHosts((LAPTOP,), LAPTOP)


def test_a_restarted_bluetoothd_finds_the_orb(play: Callable[..., None], address: str) -> None:
    async def scene(link: HidLink, bluez: FakeBluez) -> None:
        await come(bluez, link)
        await bluez.stop()
        heard: list[Message] = []
        while not any(isinstance(message, Bye) for message in heard):
            heard += await told(link)
        again = await FakeBluez.start(address)
        try:
            again.know(LAPTOP)
            await again.until(lambda: again.application)
            await come(again, link)
        finally:
            await asyncio.to_thread(link.close)
            await again.stop()

    play(scene)


@scene()
async def test_a_refusal_of_bluetoothd_is_one_sentence(link: HidLink, bluez: FakeBluez) -> None:
    await asyncio.to_thread(link.close)
    bluez.refuse["RegisterApplication"] = RefusedError("org.bluez.Error.AlreadyExists")
    with pytest.raises(LinkError, match=r"cannot be a Bluetooth gamepad: .*another program"):
        await asyncio.to_thread(open_link, "hid:", welcome())
    del bluez.objects[ADAPTER]
    with pytest.raises(LinkError, match="there is no Bluetooth adapter"):
        await asyncio.to_thread(open_link, "hid:", welcome())


def test_without_a_bus_the_user_is_told_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", "unix:path=/nowhere")
    with pytest.raises(LinkError, match="cannot reach unix:path=/nowhere, where BlueZ is"):
        open_link("hid:", welcome())


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("hid://x", "cannot understand hid://x; write hid: or hid:classic"),
        ("hid:?key=a.toml", "cannot understand"),
        (
            "hid:?keys=no.toml",
            "cannot read no.toml: no such file or directory (orbtouch docs hid)",
        ),
    ],
)
def test_a_mistake_in_the_url_is_told_in_one_sentence(url: str, said: str) -> None:
    with pytest.raises(UserError) as caught:
        open_link(url, welcome())
    assert said.lower() in str(caught.value).lower()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"hosts": 3, "wanted": ""}', "\udcff"])
def test_a_memory_that_is_broken_is_begun_anew(text: str, tmp_path: Path) -> None:
    file = tmp_path / "hid-hosts.json"
    file.write_text(text, errors="surrogateescape")
    assert hosts.recall(file) == StoredHosts()
    hosts.remember(file, StoredHosts((PHONE,), PHONE))
    assert hosts.recall(file) == StoredHosts((PHONE,), PHONE)
