"""Pairing agent for BlueZ: confirms or refuses pairings and connections.

New hosts can pair only within the pairing window; on a device with a screen, only after the user
has compared six digits. Services are for bonded hosts only.
"""

import asyncio
import contextlib
import logging
import sys
import threading
import time
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Final

from dbus_fast import DBusError
from dbus_fast.annotations import DBusObjectPath, DBusStr, DBusUInt16, DBusUInt32
from dbus_fast.service import ServiceInterface, dbus_method

from controller.shared.bluetooth.bluez import (
    ADAPTER,
    AGENT_PATH,
    PAIRING_S,
    ROOT,
    BluetoothError,
    bonded,
    named,
)

if TYPE_CHECKING:
    from controller.shared.bluetooth.bluez import Bus

MANAGER: Final = "org.bluez.AgentManager1"
NO_SCREEN: Final = "NoInputNoOutput"  # "just works"; the pairing window is the confirmation
SCREEN: Final = "DisplayYesNo"  # both sides show six digits, for the user to compare

# Called with the name and address of a host, and the six digits, "" if there are none.
Confirm = Callable[[str, str], Awaitable[bool]]

log = logging.getLogger(__name__)


async def accept_all(host: str, digits: str) -> bool:
    """Confirm every pairing: the window was opened at the device."""
    return True


class PairingAgent(ServiceInterface):
    """D-Bus object of the agent; its pairing window begins closed."""

    def __init__(self, bus: "Bus", confirm: Confirm = accept_all) -> None:
        super().__init__("org.bluez.Agent1")
        self._bus = bus
        self._confirm = confirm
        self._closes_s = 0.0

    async def register(self, capability: str, *, default: bool = True) -> None:
        """Register with BlueZ, with the capability `NO_SCREEN` or `SCREEN`.

        The default agent serves all pairings, not only those that this program starts.
        """
        self._bus.export(AGENT_PATH, self)
        await self._bus.call(ROOT, MANAGER, "RegisterAgent", "os", AGENT_PATH, capability)
        if default:
            await self._bus.call(ROOT, MANAGER, "RequestDefaultAgent", "o", AGENT_PATH)

    async def unregister(self) -> None:
        """Unregister, if BlueZ is running."""
        with contextlib.suppress(BluetoothError):
            await self._bus.call(ROOT, MANAGER, "UnregisterAgent", "o", AGENT_PATH)

    @property
    def open(self) -> bool:
        """Whether the pairing window is open."""
        return time.monotonic() < self._closes_s

    async def open_window(self, adapter: str, seconds: int = PAIRING_S) -> None:
        """Open the pairing window, discoverable and pairable; BlueZ has the same timeout."""
        self._closes_s = time.monotonic() + seconds
        for name, signature, value in (
            ("DiscoverableTimeout", "u", seconds),
            ("PairableTimeout", "u", seconds),
            ("Pairable", "b", True),
            ("Discoverable", "b", True),
        ):
            await self._bus.set(adapter, ADAPTER, name, signature, value)
        log.info("hosts can find and pair with this orb for %d s", seconds)

    async def close_window(self, adapter: str) -> None:
        """Close the pairing window; bonded hosts still connect."""
        self._closes_s = 0.0
        for name in ("Discoverable", "Pairable"):
            await self._bus.set(adapter, ADAPTER, name, "b", False)

    async def _authorize(self, path: str, digits: str) -> None:
        """Return if a host may pair, or raise the error that refuses it."""
        host = await self._host_name(path)
        if not self.open:
            log.warning("%s wanted to pair; the pairing window is closed: controller pair", host)
            raise _rejected("the pairing window is closed")
        if not await self._confirm(host, digits):
            log.warning("%s was not confirmed", host)
            raise _rejected("not confirmed")
        log.info("%s may pair", host)

    async def _host_name(self, path: str) -> str:
        try:
            return named(await self._bus.device(path))
        except BluetoothError:
            return path.rpartition("/")[2]

    @dbus_method()
    def Release(self) -> None:  # noqa: N802
        """Handle the end of the registration."""

    @dbus_method()
    def Cancel(self) -> None:  # noqa: N802
        """Handle a cancelled pairing."""
        log.info("the pairing was cancelled")

    @dbus_method()
    async def RequestConfirmation(  # noqa: N802
        self, device: DBusObjectPath, passkey: DBusUInt32
    ) -> None:
        """Handle the pairing of a host that shows six digits."""
        await self._authorize(device, f"{passkey:06d}")

    @dbus_method()
    async def RequestAuthorization(self, device: DBusObjectPath) -> None:  # noqa: N802
        """Handle the pairing of a host without a screen."""
        await self._authorize(device, "")

    @dbus_method()
    async def DisplayPasskey(  # noqa: N802
        self, device: DBusObjectPath, passkey: DBusUInt32, entered: DBusUInt16
    ) -> None:
        """Show the digits to type on a host with a keyboard."""
        log.info("type %06d on the host", passkey)

    @dbus_method()
    async def AuthorizeService(  # noqa: N802
        self, device: DBusObjectPath, uuid: DBusStr
    ) -> None:
        """Refuse a service to a host that is not bonded."""
        if not bonded(await self._bus.device(device)):
            host = await self._host_name(device)
            log.warning("%s is not paired, and was refused %s", host, uuid)
            raise _rejected("pair first")


def _rejected(reason: str) -> DBusError:
    return DBusError("org.bluez.Error.Rejected", reason)


class Prompt:
    """Yes-no prompt at the terminal; a daemon thread reads the standard input."""

    def __init__(self) -> None:
        self._lines: asyncio.Queue[str] = asyncio.Queue()  # "" is the end of the input
        self._loop = asyncio.get_running_loop()
        threading.Thread(target=self._read, name="console", daemon=True).start()

    def _read(self) -> None:
        line = "-"
        while line:
            try:
                line = sys.stdin.readline() if sys.stdin else ""
            except (OSError, ValueError):  # it was closed
                line = ""
            with contextlib.suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(self._lines.put_nowait, line)

    async def confirm(self, host: str, digits: str) -> bool:
        """Return whether the user confirms a pairing; False at the end of the input."""
        while not self._lines.empty():  # lines typed before the prompt
            if not self._lines.get_nowait():
                return False
        question = f"{host} shows {digits}; is it the same there?" if digits else f"let {host} in?"
        print(f"{question} [y/n] ", end="", flush=True)
        answer = await self._lines.get()
        print(flush=True)
        return answer.strip().lower() in ("y", "yes")
