"""The pairing agent: confirms or refuses pairings and connections for BlueZ.

Outside the pairing window no host can pair. Inside it a host can; where there is a screen, only
after the user has compared six digits. Services are for bonded hosts only.
"""

import contextlib
import logging
import time
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Final

from dbus_fast import DBusError
from dbus_fast.annotations import DBusObjectPath, DBusStr, DBusUInt16, DBusUInt32
from dbus_fast.service import ServiceInterface, dbus_method

from controller.links.bluetooth.bluez import ADAPTER, ROOT, BluetoothError, bonded, named
from controller.links.bluetooth.identifiers import AGENT_PATH

if TYPE_CHECKING:
    from controller.links.bluetooth.bluez import Bus

MANAGER: Final = "org.bluez.AgentManager1"
NO_SCREEN: Final = "NoInputNoOutput"  # "just works"; the pairing window is the confirmation
SCREEN: Final = "DisplayYesNo"  # both sides show six digits, for the user to compare
WINDOW_S: Final = 120  # how long the window stays open

# Takes the name and address of a host, and the six digits, "" if there are none.
Confirm = Callable[[str, str], Awaitable[bool]]

log = logging.getLogger(__name__)


async def accept_all(host: str, digits: str) -> bool:
    """Confirm every pairing: the window was opened at the device."""
    return True


class PairingAgent(ServiceInterface):
    """The agent that BlueZ calls.

    Attributes:
        paired: Names and addresses of the hosts that were paired, in order.
    """

    def __init__(self, bus: "Bus", confirm: Confirm = accept_all) -> None:
        """Begin with the window closed.

        Args:
            bus: Where BlueZ is.
            confirm: Called before a host is paired.
        """
        super().__init__("org.bluez.Agent1")
        self.paired: list[str] = []
        self._bus = bus
        self._confirm = confirm
        self._closes_s = 0.0

    async def register(self, capability: str, *, default: bool = True) -> None:
        """Become an agent of BlueZ's.

        Args:
            capability: "NoInputNoOutput" or "DisplayYesNo".
            default: Serve pairings of every origin, not only those that this program begins.

        Raises:
            BluetoothError: BlueZ refuses it.
        """
        self._bus.export(AGENT_PATH, self)
        await self._bus.call(ROOT, MANAGER, "RegisterAgent", "os", AGENT_PATH, capability)
        if default:
            await self._bus.call(ROOT, MANAGER, "RequestDefaultAgent", "o", AGENT_PATH)

    async def unregister(self) -> None:
        """Unregister; nothing happens if BlueZ has gone."""
        with contextlib.suppress(BluetoothError):
            await self._bus.call(ROOT, MANAGER, "UnregisterAgent", "o", AGENT_PATH)

    @property
    def open(self) -> bool:
        """Whether new hosts can pair now."""
        return time.monotonic() < self._closes_s

    def allow(self, seconds: float) -> None:
        """Confirm pairings for so long, without being discoverable."""
        self._closes_s = time.monotonic() + seconds

    async def open_window(self, adapter: str, seconds: int = WINDOW_S) -> None:
        """Be discoverable and pairable for so long; BlueZ ends it by itself, too."""
        self.allow(seconds)
        for name, signature, value in (
            ("DiscoverableTimeout", "u", seconds),
            ("PairableTimeout", "u", seconds),
            ("Pairable", "b", True),
            ("Discoverable", "b", True),
        ):
            await self._bus.set(adapter, ADAPTER, name, signature, value)
        log.info("hosts can find and pair with this orb for %d s", seconds)

    async def close_window(self, adapter: str) -> None:
        """Let no new host pair; bonded hosts still connect."""
        self._closes_s = 0.0
        for name in ("Discoverable", "Pairable"):
            await self._bus.set(adapter, ADAPTER, name, "b", False)

    async def _let_in(self, path: str, digits: str) -> None:
        """Return if this host may pair, or raise the error by which BlueZ refuses it."""
        host = await self._named(path)
        if not self.open:
            log.warning("%s wanted to pair; the pairing window is closed: controller pair", host)
            raise _no("the pairing window is closed")
        if not await self._confirm(host, digits):
            log.warning("%s was not let in", host)
            raise _no("not confirmed")
        log.info("%s may pair", host)
        self.paired.append(host)

    async def _named(self, path: str) -> str:
        try:
            return named(await self._bus.device(path))
        except BluetoothError:
            return path.rpartition("/")[2]

    @dbus_method()
    def Release(self) -> None:  # noqa: N802
        """BlueZ needs us no longer."""

    @dbus_method()
    def Cancel(self) -> None:  # noqa: N802
        """The pairing was cancelled."""
        log.info("the pairing was cancelled")

    @dbus_method()
    async def RequestConfirmation(  # noqa: N802
        self, device: DBusObjectPath, passkey: DBusUInt32
    ) -> None:
        """A host wants to pair, and shows these six digits."""
        await self._let_in(device, f"{passkey:06d}")

    @dbus_method()
    async def RequestAuthorization(self, device: DBusObjectPath) -> None:  # noqa: N802
        """A host wants to pair, and has no screen."""
        await self._let_in(device, "")

    @dbus_method()
    async def DisplayPasskey(  # noqa: N802
        self, device: DBusObjectPath, passkey: DBusUInt32, entered: DBusUInt16
    ) -> None:
        """A host with a keyboard types what we show."""
        log.info("type %06d on the host", passkey)

    @dbus_method()
    async def AuthorizeService(  # noqa: N802
        self, device: DBusObjectPath, uuid: DBusStr
    ) -> None:
        """A host that is not marked as trusted wants to use a service."""
        if not bonded(await self._bus.device(device)):
            log.warning("%s is not paired, and was refused %s", await self._named(device), uuid)
            raise _no("pair first")


def _no(why: str) -> DBusError:
    return DBusError("org.bluez.Error.Rejected", why)
