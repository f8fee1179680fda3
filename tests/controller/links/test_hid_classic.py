"""Classic HID against a bluetoothd that the tests play; packets go over local sockets."""

from __future__ import annotations

import asyncio
import errno
import shutil
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

pytest.importorskip("dbus_fast", reason="classic HID needs dbus-fast: the extra [bluetooth]")
if shutil.which("dbus-daemon") is None:
    pytest.skip("a private bus needs dbus-daemon (Debian: dbus)", allow_module_level=True)

if not hasattr(socket, "AF_UNIX") or not hasattr(socket, "SOCK_SEQPACKET"):
    pytest.skip("the played radio needs local packet sockets", allow_module_level=True)

from controller.links.bluetooth.hid import classic
from controller.links.bluetooth.hid.classic import ClassicTransport, L2capSockets
from controller.links.bluetooth.hid.hosts import StoredHosts
from controller.links.bluetooth.hid.l2cap import CONTROL, INTERRUPT, UUID
from controller.links.bluetooth.hid.reports import RELEASED, gamepad
from controller.shared.bluetooth.bluez import BluetoothError, Bus
from controller.shared.protocol.messages import State
from tests.support.fake_bluez_gatt import ADAPTER, FakeBluez, HidTable, RefusedError, address, scene

__all__ = ["address"]

LAPTOP, PHONE, STRANGER = (f"AA:00:00:00:00:0{n}" for n in (1, 2, 9))
RELEASE = [bytes([0xA1, report.id]) + report.data for report in RELEASED]
NOBODY = StoredHosts()


class PlayedRadio(L2capSockets):
    """Local sockets in place of the kernel's: a folder is the air, a file a port."""

    def __init__(self, air: Path) -> None:
        self.air = air
        self.refuse: dict[int, int] = {}  # port → error number

    def listen(self, address: str, port: int) -> socket.socket:
        if port in self.refuse:
            raise OSError(self.refuse[port], "no")
        return self.wait_at(f"orb-{port}")

    async def connect(self, local: str, address: str, port: int) -> socket.socket:
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        connection.setblocking(False)
        try:
            connection.connect(str(self.air / f"{address}-{port}"))
        except OSError:
            connection.close()
            raise
        return connection

    def accept(self, listener: socket.socket) -> tuple[socket.socket, str]:
        connection, path = listener.accept()
        return connection, Path(path).name.partition("-")[0]

    def wait_at(self, name: str) -> socket.socket:
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        listener.setblocking(False)
        (self.air / name).unlink(missing_ok=True)
        listener.bind(str(self.air / name))
        listener.listen(2)
        return listener


class Table(HidTable):
    """The orb's channels registered with a fake bluetoothd, on a played radio."""

    def __init__(self, bluez: FakeBluez, bus: Bus, air: Path, known: StoredHosts) -> None:
        super().__init__(bluez, bus, known, "gamepad")
        self.radio = PlayedRadio(air)
        self.part = ClassicTransport(self.pad, "OrbTouch", self.radio)
        self.open: list[socket.socket] = []

    async def connect(self, address: str) -> tuple[socket.socket, socket.socket]:
        """Let a host open both channels; return its ends."""
        ends = []
        for port in (CONTROL, INTERRUPT):
            end = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            end.setblocking(False)
            (self.radio.air / f"{address}-from-{port}").unlink(missing_ok=True)
            end.bind(str(self.radio.air / f"{address}-from-{port}"))
            end.connect(str(self.radio.air / f"orb-{port}"))
            ends.append(end)
        self.open += ends
        return ends[0], ends[1]


async def heard(end: socket.socket, count: int = 1) -> list[bytes]:
    """Return the next packets that arrive at a host's end."""
    loop = asyncio.get_running_loop()
    return [await asyncio.wait_for(loop.sock_recv(end, 100), 10.0) for _ in range(count)]


@asynccontextmanager
async def table(address: str, air: Path, known: StoredHosts) -> AsyncIterator[Table]:
    """Play bluetoothd, register the part, and end both."""
    bluez = await FakeBluez.start(address)
    bluez.know(LAPTOP)
    bluez.know(PHONE)
    bluez.know(STRANGER, paired=False)
    bus = await Bus.connect()
    it = Table(bluez, bus, air, known)
    try:
        await it.part.begin(bus, ADAPTER)
        yield it
    finally:
        await it.part.end()
        for end in it.open:
            end.close()
        bus.close()
        await bus.lost()
        await bluez.stop()


Play = Callable[..., None]


@pytest.fixture
def play(address: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Play:
    """Return what plays a scene: play(scene, known=...)."""
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address)
    monkeypatch.setattr(classic, "PAUSES_S", (0.0,))

    def run(scene: Callable[[Table], Awaitable[None]], known: StoredHosts = NOBODY) -> None:
        async def whole() -> None:
            async with table(address, tmp_path, known) as it:
                await scene(it)

        asyncio.run(whole())

    return run


@scene()
async def test_bluez_gets_a_record_that_demands_pairing(it: Table) -> None:
    options = it.bluez.profiles[UUID]
    assert options["RequireAuthentication"] is True
    assert 'uuid value="0x1124"' in options["ServiceRecord"]


@scene()
async def test_a_host_that_opens_both_channels_hears_that_nothing_is_down(it: Table) -> None:
    _, interrupt = await it.connect(LAPTOP)
    assert await it.who() == LAPTOP
    assert await heard(interrupt, 2) == RELEASE
    it.press("rotate_cw")
    assert await heard(interrupt, 2) == [b"\xa1\x02" + gamepad(names).data for names in ({"a"}, ())]


@scene()
async def test_the_control_channel_answers(it: Table) -> None:
    control, _ = await it.connect(LAPTOP)
    await it.who()
    it.press("down")
    for question, answer in (
        (b"\x41\x02", b"\xa1\x02" + gamepad({"down"}).data),  # GET_REPORT, input, pad
        (b"\x49\x02\x02\x00", b"\xa1\x02\x00"),  # the same, with room for two bytes
        (b"\x41\x07", b"\x02"),  # no such report
        (b"\x41", b"\x02"),
        (b"\x43\x01", b"\x03"),  # no feature reports
        (b"\x52\x01\x1f", b"\x00"),  # SET_REPORT, the keyboard's lights
        (b"\x52\x02\x00", b"\x02"),
        (b"\x52\x01", b"\x04"),
        (b"\x60", b"\xa0\x01"),  # GET_PROTOCOL
        (b"\x71", b"\x00"),  # SET_PROTOCOL
        (b"\x75", b"\x04"),
        (b"\x90", b"\x03"),  # GET_IDLE is no longer part of the profile
    ):
        await asyncio.get_running_loop().sock_sendall(control, question)
        assert await heard(control) == [answer], question.hex()


@scene()
async def test_a_host_that_is_not_paired_is_refused(it: Table) -> None:
    control, interrupt = await it.connect(STRANGER)
    assert await heard(control) == await heard(interrupt) == [b""]  # closed
    assert it.told == []


@scene()
async def test_a_host_may_come_as_soon_as_it_is_paired(it: Table) -> None:
    it.bluez.pair(STRANGER)
    await it.bus.objects()  # behind the signal
    _, interrupt = await it.connect(STRANGER)
    assert await it.who() == STRANGER
    assert await heard(interrupt, 2) == RELEASE


@scene()
async def test_a_host_that_closes_a_channel_has_gone(it: Table) -> None:
    control, interrupt = await it.connect(LAPTOP)
    await it.who()
    await heard(interrupt, 2)
    control.close()
    assert await it.who() == ""
    assert await heard(interrupt) == [b""]


@scene()
async def test_a_host_that_unplugs_is_let_go(it: Table) -> None:
    control, _ = await it.connect(LAPTOP)
    await it.who()
    await asyncio.get_running_loop().sock_sendall(control, b"\x15")
    assert await it.who() == ""


@scene(known=StoredHosts((LAPTOP,), LAPTOP))
async def test_the_orb_calls_the_last_host_five_times_of_five(it: Table) -> None:
    loop = asyncio.get_running_loop()
    listeners = [it.radio.wait_at(f"{LAPTOP}-{port}") for port in (CONTROL, INTERRUPT)]
    it.open += listeners
    for _ in range(5):
        ends = [
            (await asyncio.wait_for(loop.sock_accept(listener), 10.0))[0] for listener in listeners
        ]
        assert await it.who() == LAPTOP
        assert await heard(ends[1], 2) == RELEASE
        it.press("down")
        assert await heard(ends[1]) == [b"\xa1\x02" + gamepad({"down"}).data]
        for end in ends:
            end.close()
        assert await it.who() == ""


@scene()
async def test_a_second_host_is_sent_away(it: Table) -> None:
    await it.connect(LAPTOP)
    await it.who()
    control, interrupt = await it.connect(PHONE)
    assert await heard(control) == await heard(interrupt) == [b""]


@scene()
async def test_before_the_orb_goes_it_says_that_nothing_is_down(it: Table) -> None:
    _, interrupt = await it.connect(LAPTOP)
    await it.who()
    await heard(interrupt, 2)
    it.press("down")
    await heard(interrupt)
    await it.part.end()
    assert await heard(interrupt, 3) == [*RELEASE, b""]


@scene()
async def test_a_host_that_takes_no_reports_is_let_go(it: Table) -> None:
    await it.connect(LAPTOP)
    await it.who()
    while len(it.told) == 1:
        it.press("down")
        it.pad.take(State(()))
    assert await it.who() == ""


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.EADDRINUSE, "start bluetoothd with --noplugin=input"),
        (errno.EACCES, "CAP_NET_BIND_SERVICE"),
        (errno.ENODEV, "cannot wait on the HID channels"),
    ],
)
def test_channels_that_fail_are_told_in_one_sentence(number: int, said: str, play: Play) -> None:
    async def scene(it: Table) -> None:
        await it.part.end()
        it.radio.refuse = {CONTROL: number}
        with pytest.raises(BluetoothError) as caught:
            await it.part.begin(it.bus, ADAPTER)
        assert said in str(caught.value)
        assert "\n" not in str(caught.value)

    play(scene)


@scene()
async def test_a_record_that_another_program_has_is_told_in_one_sentence(it: Table) -> None:
    await it.part.end()
    it.bus.unexport(classic.PROFILE)
    it.bluez.refuse["RegisterProfile"] = RefusedError(
        "org.bluez.Error.NotPermitted", "UUID already registered"
    )
    with pytest.raises(BluetoothError, match="another program may have it"):
        await it.part.begin(it.bus, ADAPTER)


def test_python_without_bluetooth_gets_advice(play: Play, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(socket, "AF_BLUETOOTH", raising=False)

    async def scene(it: Table) -> None:
        part = ClassicTransport(it.pad, "OrbTouch")
        with pytest.raises(BluetoothError, match=r"use the system's python3, or --link hid:"):
            await part.begin(it.bus, ADAPTER)
        await part.end()

    play(scene)
