"""Link as a Bluetooth gamepad and keyboard, for hosts without the `host` program.

hid:                        over GATT (Bluetooth low energy), on the first adapter
hid:hci1                    on another adapter
hid:classic                 over classic Bluetooth; on another adapter: hid:classic,hci1
hid:?keys=keyboard          keys in place of the pad; or the path of a mapping: docs/hid.md
"""

from __future__ import annotations

import logging
import threading
import time
from functools import partial

from controller.links.base import KeyLink, LinkAwayError
from controller.links.bluetooth.hid import held_keys, hosts
from controller.links.bluetooth.hid.held_keys import HeldKeys
from controller.links.bluetooth.hid.hid_device import HidDevice, HidTransport
from controller.links.bluetooth.hid.hosts import HostSelection
from controller.links.bluetooth.registration import BluetoothLink, RegistrationThread
from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.bluez import BluetoothError
from controller.shared.errors import how_to_install
from controller.shared.protocol.messages import Message, Welcome

CLASSIC = "classic"

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: object) -> HidLink:
    """Register the HID device; LinkError or KeyMapError if that is not possible."""
    form = "hid: or hid:classic, then an adapter as in hid:classic,hci1"
    device, keys = held_keys.parse(url, form, welcome)
    first, _, second = device.partition(",")
    classic = first == CLASSIC
    if not bluez.available():
        raise LinkAwayError(f"hid: needs dbus-fast; {how_to_install('bluetooth')}")
    return HidLink(keys, welcome.name, second if classic else device, classic=classic)


class HidLink(KeyLink, BluetoothLink):
    """Link to one bonded host at a time, over an encrypted connection."""

    def __init__(self, keys: HeldKeys, name: str, adapter: str, *, classic: bool = False) -> None:
        """Register the name with BlueZ, on an adapter ("": the first); LinkError if it refuses."""
        super().__init__()
        self._closed = threading.Event()
        place = hosts.place()
        self._device = HidDevice(
            keys,
            HostSelection(hosts.recall(place), time.monotonic()),
            notify=self._report_host,
            store=partial(hosts.remember, place),
        )
        self._registration = RegistrationThread(
            _transport(self._device, name, classic=classic), adapter
        )
        try:
            self._registration.start()
        except BluetoothError as error:
            self._closed.set()
            raise LinkAwayError(f"cannot be a Bluetooth gamepad: {error}") from None

    def send(self, message: Message, t_ms: int) -> None:
        """Press the keys of a command while States report it as held; move the axes by contacts."""
        if not self.connected:
            self.dropped += 1
        taken = isinstance(message, held_keys.Taken)
        if taken and not self._closed.is_set():
            self._registration.submit(self._take(message))

    def close(self) -> None:
        """Release all keys on the host, disconnect it, and unregister from BlueZ."""
        self._closed.set()
        self._registration.close()

    async def _take(self, message: Message) -> None:
        self._device.take(message)

    def _report_host(self, address: str) -> None:
        """Queue a change of the active host; called on the registration's thread."""
        log.info("%s is active", f"host {address}" if address else "no host")
        self._change_host(address)


def _transport(device: HidDevice, name: str, *, classic: bool) -> HidTransport:
    """Return the transport of reports to hosts."""
    if classic:
        from controller.links.bluetooth.hid.classic import ClassicTransport

        return ClassicTransport(device, name)
    from controller.links.bluetooth.hid.gatt import GattTransport

    return GattTransport(device, name)
