"""A link to hosts that know nothing of us: the orb as a Bluetooth gamepad and keyboard.

hid:                        over GATT (Bluetooth low energy), on the first adapter
hid:hci1                    on another adapter
hid:classic                 over classic Bluetooth
hid:?keys=keyboard          keys in place of the pad; or the path of a mapping: docs/hid.md
hid:?host=AA:BB:CC:DD:EE:FF for one host only
"""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
import time
from collections import deque
from functools import partial
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl

from controller.errors import how_to_install
from controller.links import LinkAwayError, LinkError
from controller.links.bluetooth import bluez
from controller.links.bluetooth.bluez import BluetoothError
from controller.links.bluetooth.hid import host_store
from controller.links.bluetooth.hid.held import Held
from controller.links.bluetooth.hid.hid_device import HidDevice
from controller.links.bluetooth.hid.host_selection import HostSelection
from controller.links.bluetooth.hid.mapping import HidMap, read
from controller.protocol.messages import (
    VERSION,
    Bye,
    Command,
    Hello,
    Message,
    State,
    Telemetry,
    Welcome,
)

if TYPE_CHECKING:
    from controller.links.bluetooth.registration import Registration

CLASSIC = "classic"

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: object) -> HidLink:
    """Offer the orb to paired hosts; who is let in is for the pairing to say.

    Raises:
        LinkError: There is no Bluetooth, it is another program's, or the URL has a mistake.
        HidMapError: The mapping has one.
    """
    head, _, query = url.partition(":")[2].partition("?")
    words = [word for word in head.split(",") if word]
    classic = CLASSIC in words
    adapters = [word for word in words if word != CLASSIC]
    options = dict(parse_qsl(query, keep_blank_values=True))
    if head.startswith("//") or len(adapters) > 1 or set(options) - {"keys", "host"}:
        raise LinkError(
            f"cannot understand {url}; write hid: or hid:classic, then an adapter as in "
            "hid:classic,hci1, then ?keys=FILE or ?host=ADDRESS (docs/hid.md)"
        )
    host = options.get("host", "").upper()
    if host and not host_store.is_address(host):
        raise LinkError(f"{options['host']} is no Bluetooth address, such as AA:BB:CC:DD:EE:FF")
    keys = read(options.get("keys", "gamepad"))
    if not bluez.available():
        raise LinkAwayError(f"hid: needs dbus-fast; {how_to_install('bluetooth')}")
    return HidLink(keys, welcome.name, adapters[0] if adapters else "", classic=classic, only=host)


class HidLink:
    """One host at a time, bonded and encrypted; it hears what is pressed, and nothing else.

    Attributes:
        dropped: Messages that found no host.
        connected: Whether a host has the orb; changes only in `poll`, with Hello and Bye.
        touched: No host can touch a virtual orb through this link.
    """

    touched = False

    def __init__(
        self, keys: HidMap, name: str, adapter: str, *, classic: bool = False, only: str = ""
    ) -> None:
        """Register with BlueZ, and begin.

        Args:
            keys: What commands press.
            name: Under which hosts find the orb.
            adapter: Its name or address; "": the first.
            classic: Over classic Bluetooth instead of GATT.
            only: The address of the one host that may have the orb; "": any that is paired.

        Raises:
            LinkError: BlueZ does not want us.
        """
        from controller.links.bluetooth.registration import RegistrationThread

        self.dropped = 0
        self.connected = False
        self._news: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._ready: deque[Message] = deque()  # taken from the queue by `wait`
        self._closed = threading.Event()
        place = host_store.place()
        self._pad = HidDevice(
            Held(keys),
            HostSelection(host_store.recall(place), only, time.monotonic()),
            tell=self._tell,
            remember=partial(host_store.remember, place),
        )
        self._keeper = RegistrationThread([_part(self._pad, name, classic=classic)], adapter)
        try:
            self._keeper.start()
        except BluetoothError as error:
            self._closed.set()
            raise LinkAwayError(f"cannot be a Bluetooth gamepad: {error}") from None

    @property
    def state(self) -> str:
        """Whether Bluetooth is "ready", or what is missing."""
        return self._keeper.state

    def pair(self, seconds: int) -> None:
        """Let new hosts find and pair with us for a while, without waiting."""
        self._keeper.pair(seconds)

    def send(self, message: Message, t_ms: int) -> None:
        """Press what a command asks for, as long as the orb says that it is held."""
        if not self.connected:
            self.dropped += 1
        if isinstance(message, Command | State | Telemetry) and not self._closed.is_set():
            self._keeper.submit(self._take(message))

    def poll(self) -> list[Message]:
        """Return Hello for every host that has got the orb, and Bye when none has it."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._ready.append(self._news.get_nowait())
        messages = list(self._ready)
        self._ready.clear()
        if messages:
            self.connected = isinstance(messages[-1], Hello)
        return messages

    def wait(self, timeout_s: float) -> None:
        """Return when `poll` has something to tell, or after the timeout."""
        if not self._ready:
            with contextlib.suppress(queue.Empty):
                self._ready.append(self._news.get(timeout=max(timeout_s, 0.0)))

    def close(self) -> None:
        """Tell the host that nothing is down, let it go, and let BlueZ forget us."""
        self._closed.set()
        self._keeper.close()

    async def _take(self, message: Message) -> None:
        self._pad.take(message)

    def _tell(self, address: str) -> None:
        """Take note of who has the orb; called on the keeper's thread."""
        if address:
            log.info("host %s has the orb", address)
            self._news.put(Hello(VERSION, VERSION, "", address, False))
        else:
            log.info("no host has the orb")
            self._news.put(Bye("the host has gone"))


def _part(pad: HidDevice, name: str, *, classic: bool) -> Registration:
    """Return what brings reports to hosts."""
    if classic:
        from controller.links.bluetooth.hid.classic import ClassicPart

        return ClassicPart(pad, name)
    from controller.links.bluetooth.hid.gatt import GattPart

    return GattPart(pad, name, host_store.charge)
