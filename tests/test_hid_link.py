"""The link hid: from its URL to a host's screen, against a bluetoothd that the tests play."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest
from fake_device import welcome

pytest.importorskip("dbus_fast", reason="the link hid: needs dbus-fast: the extra [bluetooth]")
if shutil.which("dbus-daemon") is None:
    pytest.skip("a private bus needs dbus-daemon (Debian: dbus)", allow_module_level=True)

from fake_bluez import FakeBluez, private_bus

from controller.bluetooth.hid.reports import RELEASED, gamepad
from controller.links import open_link
from controller.links.hid import HidLink
from controller.protocol import Command, Hello, Message, State

LAPTOP, PHONE = "AA:00:00:00:00:01", "AA:00:00:00:00:02"
RELEASE = [report.data for report in RELEASED]
Scene = Callable[[HidLink, FakeBluez], Awaitable[None]]


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with private_bus(tmp_path_factory.mktemp("bus")) as found:
        yield found


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
    assert await told(link) == [Hello(1, 1, "", host, False)]


async def told(link: HidLink) -> list[Message]:
    """Return what the link tells the loop next."""
    await asyncio.to_thread(link.wait, 10.0)
    return link.poll()


def press(link: HidLink, name: str) -> None:
    """Make a gesture and hold it, as the loop says it."""
    link.send(Command(name, "press", 1.0, None, 1), 100)
    link.send(State((name,)), 100)


def test_a_gesture_reaches_a_host(play: Callable[..., None]) -> None:
    async def scene(link: HidLink, bluez: FakeBluez) -> None:
        await come(bluez, link)
        await bluez.until(lambda: len(bluez.heard) >= 3)
        bluez.heard.clear()
        press(link, "rotate_cw")
        await bluez.until(lambda: len(bluez.heard) == 2)
        assert [value for _, _, value in bluez.heard] == [
            gamepad({"a"}).data, gamepad(()).data,
        ]  # fmt: skip

    play(scene)
