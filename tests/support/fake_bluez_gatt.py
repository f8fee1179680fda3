"""A small bluetoothd on a private bus: one adapter, and hosts that a test plays.

It does what the real one does with a GATT application, an advertisement and a profile: asks the
application for its objects, reads, writes, starts notifying, obeys the flags, and forgets whoever
leaves the bus. What it knows of D-Bus it has from BlueZ's own interface descriptions
(doc/org.bluez.*.rst); the real bluetoothd has its turn in tests/system.
"""

from __future__ import annotations

import asyncio
import contextlib
import shutil
import subprocess
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("dbus_fast", reason="HID needs dbus-fast: the extra [bluetooth]")
if shutil.which("dbus-daemon") is None:
    pytest.skip("a private bus needs dbus-daemon (Debian: dbus)", allow_module_level=True)

from dbus_fast import BusType, Message, MessageType, RequestNameReply, Variant
from dbus_fast.aio import MessageBus
from dbus_fast.unpack import unpack_variants

from controller.links.bluetooth.hid.held_keys import HeldKeys
from controller.links.bluetooth.hid.hid_device import HidDevice
from controller.links.bluetooth.hid.hosts import HostSelection, StoredHosts
from controller.links.bluetooth.hid.reports import OUTPUTS
from controller.shared.bluetooth.bluez import Bus
from controller.shared.keymap.keymap import load
from controller.shared.protocol.messages import Command, State

ADAPTER = "/org/bluez/hci0"
_PROPERTIES = "org.freedesktop.DBus.Properties"
_OBJECTS = "org.freedesktop.DBus.ObjectManager"
_CONFIG = """<!DOCTYPE busconfig PUBLIC "-//freedesktop//DTD D-Bus Bus Configuration 1.0//EN"
 "http://www.freedesktop.org/standards/dbus/1.0/busconfig.dtd">
<busconfig><type>system</type><listen>unix:path={path}</listen><auth>EXTERNAL</auth>
<policy context="default"><allow send_destination="*" eavesdrop="true"/><allow eavesdrop="true"/>
<allow own="*"/></policy></busconfig>"""
_SIGNATURES = {
    "Address": "s", "Name": "s", "Alias": "s", "Powered": "b", "Discoverable": "b", "Pairable": "b",
    "DiscoverableTimeout": "u", "PairableTimeout": "u", "Paired": "b", "Bonded": "b",
    "Connected": "b", "Trusted": "b", "Adapter": "o", "SupportedInstances": "y", "Class": "u",
}  # fmt: skip

Properties = dict[str, Any]


@contextlib.contextmanager
def private_bus(folder: Path) -> Iterator[str]:
    """Run a D-Bus daemon of our own; yield its address."""
    config = folder / "bus.conf"
    config.write_text(_CONFIG.format(path=folder / "bus"))
    command = ["dbus-daemon", f"--config-file={config}", "--print-address", "--nofork"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as daemon:
        try:
            assert daemon.stdout is not None
            yield daemon.stdout.readline().strip()
        finally:
            daemon.terminate()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a private bus."""
    with private_bus(tmp_path_factory.mktemp("bus")) as found:
        yield found


def scene(*given: Any, **options: Any) -> Callable[[Callable[..., Any]], Callable[..., None]]:
    """Return what makes a test of a coroutine: the fixture `play` plays it, with these options."""

    def made(run: Callable[..., Any]) -> Callable[..., None]:
        def test(play: Callable[..., None]) -> None:
            play(run, *given, **options)

        return test

    return made


class HidTable:
    """A fake bluetoothd, and the orb's HID device."""

    def __init__(self, bluez: FakeBluez, bus: Bus, known: StoredHosts, mapping: str) -> None:
        self.bluez, self.bus = bluez, bus
        self.told: list[str] = []  # who has the orb, from its first change on
        self.remembered: list[StoredHosts] = []
        hosts = HostSelection(known, now_s=asyncio.get_running_loop().time())
        self.pad = HidDevice(
            HeldKeys(load(Path(mapping), OUTPUTS)),
            hosts,
            notify=self._tell,
            store=self.remembered.append,
        )
        self._changed = asyncio.Event()
        self._seen = 0

    def _tell(self, address: str) -> None:
        self.told.append(address)
        self._changed.set()

    async def who(self) -> str:
        """Return who has the orb, as soon as that changes."""
        while len(self.told) == self._seen:
            self._changed.clear()
            await asyncio.wait_for(self._changed.wait(), 10.0)
        self._seen += 1
        return self.told[self._seen - 1]

    def press(self, name: str) -> None:
        """Let the player make a gesture, and go on holding the orb."""
        self.pad.take(Command(name, "press", 1.0, None, 1))
        self.pad.take(State((name,)))


class RefusedError(Exception):
    """What a host or a program is told instead of an answer."""

    def __init__(self, name: str, text: str = "") -> None:
        super().__init__(name)
        self.name, self.text = name, text


class FakeBluez:
    """Plays bluetoothd, and the hosts behind it."""

    def __init__(self, bus: MessageBus) -> None:
        self.bus = bus
        adapter = {
            "Address": "00:AA:01:00:00:00", "Name": "pi", "Alias": "pi", "Powered": True,
            "Discoverable": False, "Pairable": False, "DiscoverableTimeout": 180,
            "PairableTimeout": 0, "Class": 0,
        }  # fmt: skip
        self.objects: dict[str, dict[str, Properties]] = {
            "/org/bluez": {},
            ADAPTER: {
                "org.bluez.Adapter1": adapter,
                "org.bluez.GattManager1": {},
                "org.bluez.LEAdvertisingManager1": {"SupportedInstances": 5},
            },
        }
        self.application: dict[str, dict[str, Properties]] = {}  # what is registered, by path
        self.advertisement: Properties = {}
        self.profiles: dict[str, Properties] = {}  # options by UUID
        self.heard: list[tuple[str, str, bytes]] = []  # notifications: host, UUID, value
        self.disconnected: list[str] = []
        self.refuse: dict[str, RefusedError] = {}  # what methods answer, by name
        self._owner = ""  # of the application
        self._listening: dict[str, set[str]] = {}  # characteristic: hosts' addresses
        self._tasks: set[asyncio.Task[None]] = set()
        self._news = asyncio.Condition()

    @classmethod
    async def start(cls, address: str) -> FakeBluez:
        """Take the name org.bluez on a bus."""
        bus = await MessageBus(bus_type=BusType.SYSTEM, bus_address=address).connect()
        fake = cls(bus)
        bus.add_message_handler(fake._take)
        assert await bus.request_name("org.bluez") is RequestNameReply.PRIMARY_OWNER
        return fake

    async def stop(self) -> None:
        """Leave the bus, as a bluetoothd that is restarted."""
        self.bus.disconnect()
        with contextlib.suppress(OSError, EOFError):
            await self.bus.wait_for_disconnect()  # type: ignore[no-untyped-call]

    async def until(self, condition: Callable[[], Any]) -> None:
        """Wait until something is so; at most 10 s."""
        async with self._news:
            await asyncio.wait_for(self._news.wait_for(condition), 10.0)

    # --- what a host does ---

    def know(self, address: str, *, paired: bool = True, adapter: str = ADAPTER) -> str:
        """Return the path of a host's object, which is there from now on."""
        path = f"{adapter}/dev_{address.replace(':', '_')}"
        device = {
            "Address": address, "Alias": "a host", "Name": "a host", "Adapter": adapter,
            "Paired": paired, "Bonded": paired, "Connected": False, "Trusted": False,
        }  # fmt: skip
        self.objects[path] = {"org.bluez.Device1": device}
        added = {"org.bluez.Device1": _wrapped(device)}
        self._signal("/", _OBJECTS, "InterfacesAdded", "oa{sa{sv}}", [path, added])
        return path

    def pair(self, address: str) -> None:
        self._change(self._path(address), "org.bluez.Device1", {"Paired": True, "Bonded": True})

    def connect(self, address: str) -> None:
        self._change(self._path(address), "org.bluez.Device1", {"Connected": True})

    async def disconnect(self, address: str) -> None:
        """Let a host go; it listens to nothing any longer."""
        for path, hosts in self._listening.items():
            if address in hosts:
                hosts.discard(address)
                if not hosts:
                    await self._call(path, "StopNotify")
        self._change(self._path(address), "org.bluez.Device1", {"Connected": False})

    async def read(self, address: str, uuid: int, instance: int = 0) -> bytes:
        """Read a characteristic, as far as its flags allow."""
        path = self.find(uuid)[instance]
        self._allow(path, address, "read", "encrypt-read")
        options = {
            "device": Variant("o", self._path(address)),
            "link": Variant("s", "LE"),
            "mtu": Variant("q", 517),
        }
        return bytes(await self._call(path, "ReadValue", "a{sv}", options))

    async def write(self, address: str, uuid: int, value: bytes) -> None:
        path = self.find(uuid)[0]
        self._allow(path, address, "write-without-response", "encrypt-write")
        options = {"device": Variant("o", self._path(address)), "type": Variant("s", "command")}
        await self._call(path, "WriteValue", "aya{sv}", value, options)

    async def listen(self, address: str, uuid: int, instance: int = 0) -> None:
        """Subscribe to a characteristic."""
        path = self.find(uuid)[instance]
        self._allow(path, address, "notify", "encrypt-notify")
        hosts = self._listening.setdefault(path, set())
        hosts.add(address)
        if len(hosts) == 1:
            await self._call(path, "StartNotify")

    def find(self, uuid: int) -> list[str]:
        """Return the paths of the characteristics with a UUID, in order."""
        return [
            path
            for path in sorted(self.application)
            for properties in self.application[path].values()
            if properties["UUID"] == f"{uuid:04x}"
        ]

    def reference(self, path: str) -> list[str]:
        """Return the paths of a characteristic's descriptors."""
        return [other for other in sorted(self.application) if other.startswith(f"{path}/desc")]

    def _allow(self, path: str, address: str, plain: str, encrypted: str) -> None:
        flags = self.application[path]["org.bluez.GattCharacteristic1"]["Flags"]
        paired = self.objects[self._path(address)]["org.bluez.Device1"]["Paired"]
        if encrypted in flags and not paired:
            raise RefusedError("insufficient encryption")
        if encrypted not in flags and plain not in flags:
            raise RefusedError("not permitted")

    def _path(self, address: str) -> str:
        return f"{ADAPTER}/dev_{address.replace(':', '_')}"

    # --- what a program asks ---

    def _take(self, message: Message) -> Message | bool | None:
        if message.message_type is MessageType.SIGNAL:
            return self._notified(message)
        if message.message_type is not MessageType.METHOD_CALL:
            return None
        answer = getattr(self, f"_on_{message.member}", None)
        if answer is None:
            return None
        task = asyncio.get_running_loop().create_task(self._answer(message, answer))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return True

    async def _answer(
        self, message: Message, answer: Callable[[Message], Awaitable[tuple[str, list[Any]] | None]]
    ) -> None:
        try:
            if refused := self.refuse.get(message.member or ""):
                raise refused
            signature, body = await answer(message) or ("", [])
        except RefusedError as error:
            reply = Message.new_error(message, error.name, error.text)
        else:
            reply = Message.new_method_return(message, signature, body)
        self.bus.send(reply)
        async with self._news:
            self._news.notify_all()

    def _notified(self, message: Message) -> bool | None:
        if message.member == "NameOwnerChanged":
            if message.body[0] == self._owner and not message.body[2]:
                self.application, self.advertisement, self._listening = {}, {}, {}
            return None
        if message.sender != self._owner or message.member != "PropertiesChanged":
            return None
        assert message.path is not None
        uuid = self.application[message.path]["org.bluez.GattCharacteristic1"]["UUID"]
        for address in sorted(self._listening.get(message.path, ())):
            self.heard.append((address, uuid, bytes(message.body[1]["Value"].value)))

        async def tell() -> None:
            async with self._news:
                self._news.notify_all()

        task = asyncio.get_running_loop().create_task(tell())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return True

    async def _on_GetManagedObjects(self, message: Message) -> tuple[str, list[Any]]:  # noqa: N802
        wrapped = {
            path: {name: _wrapped(values) for name, values in interfaces.items()}
            for path, interfaces in self.objects.items()
        }
        return "a{oa{sa{sv}}}", [wrapped]

    async def _on_Get(self, message: Message) -> tuple[str, list[Any]]:  # noqa: N802
        interface, name = message.body
        value = self.objects[message.path or ""][interface][name]
        return "v", [Variant(_SIGNATURES[name], value)]

    async def _on_GetAll(self, message: Message) -> tuple[str, list[Any]]:  # noqa: N802
        return "a{sv}", [_wrapped(self.objects[message.path or ""][message.body[0]])]

    async def _on_Set(self, message: Message) -> None:  # noqa: N802
        interface, name, value = message.body
        self._change(message.path or "", interface, {name: value.value})

    async def _on_RegisterAgent(self, message: Message) -> None:  # noqa: N802
        return

    async def _on_RequestDefaultAgent(self, message: Message) -> None:  # noqa: N802
        return

    async def _on_RegisterApplication(self, message: Message) -> None:  # noqa: N802
        self._owner = message.sender or ""
        objects = await self._invoke(message.body[0], _OBJECTS, "GetManagedObjects")
        self.application = unpack_variants(objects)
        if not self.application:
            raise RefusedError("org.bluez.Error.InvalidArguments", "No object received")

    async def _on_UnregisterApplication(self, message: Message) -> None:  # noqa: N802
        self.application, self._listening = {}, {}

    async def _on_RegisterAdvertisement(self, message: Message) -> None:  # noqa: N802
        if self.advertisement:
            raise RefusedError("org.bluez.Error.AlreadyExists")
        self._owner = message.sender or ""
        interface = "org.bluez.LEAdvertisement1"
        found = await self._invoke(message.body[0], _PROPERTIES, "GetAll", "s", interface)
        self.advertisement = unpack_variants(found)

    async def _on_UnregisterAdvertisement(self, message: Message) -> None:  # noqa: N802
        if not self.advertisement:
            raise RefusedError("org.bluez.Error.DoesNotExist")
        self.advertisement = {}

    async def _on_RegisterProfile(self, message: Message) -> None:  # noqa: N802
        if message.body[1] in self.profiles:
            raise RefusedError("org.bluez.Error.NotPermitted", "UUID already registered")
        self.profiles[message.body[1]] = unpack_variants(message.body[2])

    async def _on_UnregisterProfile(self, message: Message) -> None:  # noqa: N802
        self.profiles.clear()

    async def _on_Disconnect(self, message: Message) -> None:  # noqa: N802
        device = self.objects[message.path or ""]["org.bluez.Device1"]
        self.disconnected.append(device["Address"])
        await self.disconnect(device["Address"])

    # --- helpers ---

    async def _call(self, path: str, member: str, signature: str = "", *body: Any) -> Any:
        kind = "GattDescriptor1" if "/desc" in path else "GattCharacteristic1"
        return await self._invoke(path, f"org.bluez.{kind}", member, signature, *body)

    async def _invoke(
        self, path: str, interface: str, member: str, signature: str = "", *body: Any
    ) -> Any:
        """Call the program that has registered itself."""
        reply = await self.bus.call(
            Message(destination=self._owner, path=path, interface=interface, member=member,
                    signature=signature, body=list(body))
        )  # fmt: skip
        assert reply is not None
        if reply.message_type is MessageType.ERROR:
            raise RefusedError(str(reply.error_name), str(reply.body[0]) if reply.body else "")
        return reply.body[0] if reply.body else None

    def _change(self, path: str, interface: str, changes: Properties) -> None:
        self.objects[path][interface].update(changes)
        body = [interface, _wrapped(changes), []]
        self._signal(path, _PROPERTIES, "PropertiesChanged", "sa{sv}as", body)

    def _signal(
        self, path: str, interface: str, member: str, signature: str, body: list[Any]
    ) -> None:
        self.bus.send(Message.new_signal(path, interface, member, signature, body))


def _wrapped(values: Properties) -> dict[str, Variant]:
    return {name: Variant(_SIGNATURES[name], value) for name, value in values.items()}
