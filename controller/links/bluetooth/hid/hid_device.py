"""From commands to one host: what is down, who has the orb, and the clock that moves both.

An edge: it lives on an asyncio loop, and takes its time from there. A `ReportTransport` brings
reports to hosts, over GATT or over classic Bluetooth.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Protocol

from controller.links.bluetooth.hid.held import Held
from controller.links.bluetooth.hid.host_selection import HostSelection, StoredHosts
from controller.links.bluetooth.hid.reports import Report
from controller.protocol.messages import Command, Message, State, Telemetry

log = logging.getLogger(__name__)


class ReportTransport(Protocol):
    """Brings reports to hosts. Nothing waits."""

    def send(self, report: Report) -> None:
        """Send a report to the host that has the orb."""

    def drop(self, address: str) -> None:
        """Disconnect a host."""

    def seek(self, wanted: bool) -> None:
        """Be found by paired hosts, or no longer."""


class HidDevice:
    """The orb as hosts see it. Everything is called on the loop.

    Attributes:
        held: What is down.
        hosts: Who is there.
    """

    def __init__(
        self,
        held: Held,
        hosts: HostSelection,
        *,
        tell: Callable[[str], None],
        remember: Callable[[StoredHosts], None],
    ) -> None:
        """Begin with nobody there.

        Args:
            held: By the player's mapping.
            hosts: Those that are known; its clock is the loop's.
            tell: Called with the address of the host that has the orb, "" if none has.
            remember: Called with what the next run shall know.
        """
        self.held = held
        self.hosts = hosts
        self._tell = tell
        self._remember = remember
        self._transport: ReportTransport | None = None
        self._active = ""
        self._known = hosts.known
        self._seeking: bool | None = None
        self._dropped: set[str] = set()  # sent away, and not gone yet
        self._timer: asyncio.TimerHandle | None = None

    def open(self, transport: ReportTransport) -> None:
        """Hosts can be reached from now on."""
        self._transport, self._seeking = transport, None
        self._turn()

    def close(self) -> None:
        """Hosts can be reached no longer; the one that had the orb is told that nothing is down."""
        self.held.release()
        self._turn()
        for address in [self.hosts.active, *self.hosts.unwanted()]:
            self.hosts.leave(address, self._now_s())
        self._transport = None
        self._turn()
        if self._timer is not None:
            self._timer.cancel()

    def take(self, message: Message) -> None:
        """Take what the orb says: Command, State and Telemetry mean something here."""
        now_s = self._now_s()
        match message:
            case Command(name=name):
                self.held.command(name, now_s)
            case State(pressed=pressed):
                self.held.state(pressed, now_s)
            case Telemetry(gesture=""):
                self.held.state((), now_s)
            case Telemetry():
                self.held.word(now_s)
        self._turn()

    def arrive(self, address: str) -> None:
        """A paired host has connected, or begun to listen: to it nothing is down."""
        if address == self.hosts.active:
            self.held.release()
        self.hosts.arrive(address, self._now_s())
        self._turn()

    def leave(self, address: str) -> None:
        """A host has gone."""
        self.hosts.leave(address, self._now_s())
        self._turn()

    def _turn(self) -> None:
        """Let time pass, and do what follows."""
        now_s = self._now_s()
        self.held.tick(now_s)
        self._flush()  # to the host that has the orb, before another gets it
        for wish in self.held.wishes:
            log.info(self.hosts.change(wish.number, now_s))
        self.hosts.tick(now_s)
        if self.hosts.active != self._active:
            self._active = self.hosts.active
            self.held.release()
            self._flush()
            self._tell(self._active)
        if self._transport is not None:
            unwanted = set(self.hosts.unwanted())
            for address in unwanted - self._dropped:
                log.info("host %s is sent away: another has the orb, or shall have it", address)
                self._transport.drop(address)
            self._dropped = unwanted
            if self._seeking is not (seek := not self._active):
                self._seeking = seek
                self._transport.seek(seek)
        for sentence in self.held.told:
            log.info("%s", sentence)
        self.held.wishes, self.held.told = [], []
        if self.hosts.known != self._known:
            self._known = self.hosts.known
            self._remember(self._known)
        self._plan()

    def _flush(self) -> None:
        """Send what has gathered, if there is somebody to hear it."""
        reports, self.held.output = self.held.output, []
        if self._transport is not None and self._active and self._active == self.hosts.active:
            for report in reports:
                self._transport.send(report)

    def _plan(self) -> None:
        """Come back when time has something to do."""
        if self._timer is not None:
            self._timer.cancel()
        times = [due for due in (self.held.due_s, self.hosts.due_s) if due is not None]
        loop = asyncio.get_running_loop()
        self._timer = loop.call_at(min(times), self._turn) if times else None

    def _now_s(self) -> float:
        return asyncio.get_running_loop().time()
