"""HID device: held keys, the active host, and the transport of reports.

All functions run on an asyncio loop and use its clock.
"""

from __future__ import annotations

import asyncio
import logging
from abc import abstractmethod
from collections.abc import Callable

from controller.links.bluetooth.hid.held_keys import HeldKeys
from controller.links.bluetooth.hid.hosts import HostSelection, StoredHosts
from controller.links.bluetooth.hid.reports import Report
from controller.links.bluetooth.registration import Registration
from controller.shared.bluetooth.bluez import DEVICE, Properties
from controller.shared.protocol.messages import Message

log = logging.getLogger(__name__)


class HidDevice:
    """Keyboard and gamepad for the active host; it begins without one."""

    def __init__(
        self,
        keys: HeldKeys,
        hosts: HostSelection,
        *,
        notify: Callable[[str], None],
        store: Callable[[StoredHosts], None],
    ) -> None:
        """Prepare the device; `hosts` has the loop's clock.

        `notify` is called with the address of a new active host, "" if there is none; `store` with
        the hosts to store for the next run.
        """
        self.keys, self.hosts = keys, hosts
        self._waiting: list[Report] = []
        self._notify = notify
        self._store = store
        self._transport: HidTransport | None = None
        self._active = ""
        self._known = hosts.known
        self._seeking: bool | None = None
        self._dropped: set[str] = set()  # being disconnected
        self._timer: asyncio.TimerHandle | None = None

    def open(self, transport: HidTransport) -> None:
        """Use a transport from now on."""
        self._transport, self._seeking = transport, None
        self._update()

    def close(self) -> None:
        """Release all keys on the active host, and stop using the transport."""
        self._release()
        self._update()
        for address in [self.hosts.active, *self.hosts.unwanted()]:
            self.hosts.leave(address, self._now_s())
        self._transport = None
        self._update()
        if self._timer is not None:
            self._timer.cancel()

    def take(self, message: Message) -> None:
        """Change keys or axes by a message, see `HeldKeys.take`."""
        self.keys.take(message, self._now_s())
        if self.keys.hosts:
            self._release()
        self._update()

    def arrive(self, address: str) -> None:
        """Handle a paired host that has connected, or subscribed to reports."""
        if address == self.hosts.active:
            self._release()
        self.hosts.arrive(address, self._now_s())
        self._update()

    def leave(self, address: str) -> None:
        """Handle a host that has disconnected."""
        self.hosts.leave(address, self._now_s())
        self._update()

    def _update(self) -> None:
        """Update keys and hosts to the present time, and send the resulting reports."""
        now_s = self._now_s()
        self.keys.tick(now_s)
        self._flush()  # to the active host, before another becomes active
        for number in self.keys.hosts:
            log.info(self.hosts.change(number, now_s))
        self.hosts.tick(now_s)
        if self.hosts.active != self._active:
            self._active = self.hosts.active
            self._release()
            self._flush()
            self._notify(self._active)
        if self._transport is not None:
            self._select(self._transport)
        for sentence in self.keys.notes:
            log.info("%s", sentence)
        self.keys.hosts, self.keys.notes = [], []
        if self.hosts.known != self._known:
            self._known = self.hosts.known
            self._store(self._known)
        self._schedule()

    def _select(self, transport: HidTransport) -> None:
        """Disconnect hosts that are not active; seek one if none is."""
        unwanted = set(self.hosts.unwanted())
        for address in unwanted - self._dropped:
            log.info("host %s is disconnected: another one is active, or selected", address)
            transport.drop(address)
        self._dropped = unwanted
        if self._seeking is not (seek := not self._active):
            self._seeking = seek
            transport.seek(seek)

    def _release(self) -> None:
        """Release all keys, and report that in any case."""
        self._waiting += self.keys.reset()

    def _flush(self) -> None:
        """Send the queued reports, if there is an active host."""
        reports, self._waiting = self._waiting + self.keys.reports(), []
        if self._transport is not None and self._active and self._active == self.hosts.active:
            for report in reports:
                self._transport.send(report)

    def _schedule(self) -> None:
        """Schedule the next update."""
        if self._timer is not None:
            self._timer.cancel()
        times = [due for due in (self.keys.due_s, self.hosts.due_s) if due is not None]
        loop = asyncio.get_running_loop()
        self._timer = loop.call_at(min(times), self._update) if times else None

    def _now_s(self) -> float:
        return asyncio.get_running_loop().time()


class HidTransport(Registration):
    """Transport of reports to hosts, over GATT or classic Bluetooth; no method blocks."""

    def __init__(self, device: HidDevice, name: str) -> None:
        """Prepare a transport for a device; hosts show its name."""
        self._hid, self._name = device, name
        self._adapter = ""
        self._devices: dict[str, Properties] = {}  # of the adapter, by BlueZ's path

    @abstractmethod
    def send(self, report: Report) -> None:
        """Send a report to the active host."""

    @abstractmethod
    def drop(self, address: str) -> None:
        """Disconnect a host."""

    def seek(self, wanted: bool) -> None:
        """Start or stop seeking paired hosts; no effect where the kernel advertises."""

    @abstractmethod
    def _changed(self, before: Properties, after: Properties) -> None:
        """Handle changed properties of a host; they are empty before it exists and afterwards."""

    def _follow(self, path: str, interface: str, changes: Properties | None) -> None:
        """Handle a change of BlueZ's objects."""
        if interface == DEVICE and path.startswith(f"{self._adapter}/"):
            before = self._devices.get(path, {})
            if changes is None:
                self._devices.pop(path, None)
            else:
                self._devices[path] = before | changes
            self._changed(before, self._devices.get(path, {}))
