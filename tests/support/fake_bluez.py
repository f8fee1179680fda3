"""A BlueZ that tests play with, on a bus of its own: python-dbusmock's, or nothing at all.

It needs dbus-fast, a dbus-daemon and python-dbusmock, in this environment or in the system's
Python (Debian: dbus, python3-dbusmock); `missing` says in a word what there is not.
"""

from __future__ import annotations

import asyncio
import importlib.util
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Coroutine, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest

from controller.links.bluetooth import registration
from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.bluez import BluetoothError, Bus
from tests.support import waiting

MOCK = "org.bluez.Mock"
RECORDER = "org.freedesktop.DBus.Mock"
PHONE = 0x5A020C  # a class of device
HOST = "11:22:33:44:55:66"


@cache
def python() -> str:
    """Return the Python that has dbusmock, or ""."""
    if importlib.util.find_spec("dbusmock") and importlib.util.find_spec("dbus"):
        return sys.executable
    system = "/usr/bin/python3"
    if Path(system).exists():
        done = subprocess.run([system, "-c", "import dbusmock"], capture_output=True, check=False)
        return "" if done.returncode else system
    return ""


def missing() -> str:
    """Return what these tests lack here, or ""."""
    if not bluez.available():
        return "dbus-fast (the extra [bluetooth])"
    if not shutil.which("dbus-daemon"):
        return "Debian's dbus"
    return "" if python() else "Debian's python3-dbusmock"


class FakeBluez:
    """A bus, and a bluetoothd that comes and goes; every adapter is `hci0`."""

    def __init__(self) -> None:
        command = ["dbus-daemon", "--session", "--nofork", "--print-address"]
        self._daemon = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self._daemon.stdout is not None
        self.address = self._daemon.stdout.readline().strip()
        self._mock: subprocess.Popen[bytes] | None = None

    def fresh(self) -> None:
        """Begin anew: a bluetoothd that has just started, with an adapter and a bonded host."""
        if self._mock is None:
            self.start()
        else:
            self.call("/", RECORDER, "Reset", "")
            self.call("/org/bluez", RECORDER, "ClearCalls", "")
            self.populate()

    def start(self, *, adapter: bool = True) -> None:
        """Start bluetoothd, with an adapter and a bonded host, or with neither."""
        environment = {**os.environ, "DBUS_SYSTEM_BUS_ADDRESS": self.address}
        self._mock = subprocess.Popen(
            [python(), "-m", "dbusmock", "--system", "--template", "bluez5"],
            env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        until(lambda: self.ask(lambda bus: bus.running()))
        if adapter:
            self.populate()

    def populate(self) -> None:
        """Plug the adapter in, and let it know a host."""
        self.plug()
        self.call("/", MOCK, "AddDevice", "sss", "hci0", HOST, "laptop")
        self.pair(HOST)

    def pair(self, address: str) -> None:
        try:
            self.call("/", MOCK, "PairDevice", "ss", "hci0", address)
        except BluetoothError as error:  # older ones want to know what kind of device it is
            if "Invalid arguments" not in str(error):
                raise
            self.call("/", MOCK, "PairDevice", "ssi", "hci0", address, PHONE)

    def stop(self) -> None:
        if self._mock is not None:
            self._mock.kill()
            self._mock.wait()
            self._mock = None

    def plug(self) -> None:
        self.call("/", MOCK, "AddAdapter", "ss", "hci0", "raspberrypi")

    def unplug(self) -> None:
        self.call("/", MOCK, "RemoveAdapterWithDevices", "s", "hci0")

    def refuse(self, interface: str, method: str, signature: str, error: str) -> None:
        """Let a method of /org/bluez fail from now on."""
        code = f"raise dbus.exceptions.DBusException('as told', name='{error}')"
        arguments = (interface, method, signature, "", code)
        self.call("/org/bluez", RECORDER, "AddMethod", "sssss", *arguments)

    def calls(self, method: str) -> list[list[Any]]:
        """Return the arguments of every call of a method of /org/bluez."""
        made = self.call("/org/bluez", RECORDER, "GetMethodCalls", "s", method)
        return [arguments for _, arguments in made]

    def get(self, path: str, interface: str, name: str) -> Any:
        return self.ask(lambda bus: bus.get(path, interface, name))

    def call(self, path: str, interface: str, member: str, signature: str, *body: Any) -> Any:
        return self.ask(lambda bus: bus.call(path, interface, member, signature, *body))

    def hand_over(self, to: str, path: str, device: str, end: socket.socket) -> str:
        """Call a profile's NewConnection as BlueZ does; return the error's name, or ""."""

        async def deliver(bus: Bus) -> str:
            from dbus_fast import Message

            reply = await bus.raw.call(
                Message(destination=to, path=path, interface="org.bluez.Profile1",
                        member="NewConnection", signature="oha{sv}", body=[device, 0, {}],
                        unix_fds=[end.fileno()])
            )  # fmt: skip
            return str(reply.error_name or "")

        return str(self.ask(deliver))

    def ask(self, question: Callable[[Bus], Coroutine[Any, Any, Any]]) -> Any:
        """Do something on a connection of its own."""

        async def once() -> Any:
            bus = await Bus.connect()
            try:
                return await question(bus)
            finally:
                bus.close()

        before = os.environ.get("DBUS_SYSTEM_BUS_ADDRESS")
        os.environ["DBUS_SYSTEM_BUS_ADDRESS"] = self.address
        try:
            return asyncio.run(once())
        finally:
            if before is None:
                del os.environ["DBUS_SYSTEM_BUS_ADDRESS"]
            else:
                os.environ["DBUS_SYSTEM_BUS_ADDRESS"] = before

    def close(self) -> None:
        self.stop()
        self._daemon.kill()
        self._daemon.wait()
        assert self._daemon.stdout is not None
        self._daemon.stdout.close()


until = partial(waiting.until, passing=(BluetoothError,))


@pytest.fixture(scope="module")
def bus() -> Iterator[FakeBluez]:
    """A bus of a module's tests."""
    fake = FakeBluez()
    yield fake
    fake.close()


@pytest.fixture
def fake(bus: FakeBluez, monkeypatch: pytest.MonkeyPatch) -> FakeBluez:
    """A bluetoothd that has just started, as the system's."""
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bus.address)
    monkeypatch.setattr(registration, "RETRY_S", 0.02)
    bus.fresh()
    return bus
