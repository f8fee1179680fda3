"""Orbs that are known and found, and the change from one to another.

A scan runs on a thread of its own; `tick` takes its results on the window's thread.
"""

import queue
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from controller.shared.protocol import psk
from host.connection import discovery
from host.connection.device_store import DeviceStore, KnownDevice
from host.connection.discovery import Answer, DevicePort
from host.connection.receiver import Receiver
from host.connection.virtual_orb import VirtualOrbProcess

OWN: Final = KnownDevice("", virtual=True, seen=discovery.NOW)  # the program's own virtual orb


class Orbs:
    """The list of orbs, the present one, and a scan under way.

    Attributes:
        notice: What the last choice or scan came to, a sentence; "": nothing to say.
        scanning: Whether a scan is under way.
    """

    def __init__(
        self,
        link: Receiver,
        memory: DeviceStore,
        make_own: Callable[[], VirtualOrbProcess],
        *,
        own: VirtualOrbProcess | None = None,
        where: Callable[[], str] = lambda: "",
        moved: Callable[[DevicePort | None, str], object] = lambda port, key: None,
    ) -> None:
        """Begin with what the program was started with.

        Args:
            link: Connects to the chosen orb.
            memory: The known devices.
            make_own: Prepares a virtual orb of our own.
            own: The one that was prepared at the start, if any.
            where: Port of the orb that was named at the start; "": our own.
            moved: Called with the port and the key's path of a chosen orb; None: our own.
        """
        self.notice, self.scanning = "", False
        self._link, self._memory, self._make_own = link, memory, make_own
        self._own, self._where, self._moved = own, where, moved
        self._answers: list[Answer] = []
        self._results: queue.SimpleQueue[Answer | None] = queue.SimpleQueue()

    # -- the list --------------------------------------------------------------------------

    def entries(self) -> list[KnownDevice]:
        """Return our own orb, the found ones and then the remembered ones, latest first."""
        listed = discovery.listing(self._answers, self._memory.devices)
        return [OWN, *(device for device in listed if device.port)]

    def present(self, entry: KnownDevice, connected: str) -> bool:
        """Return whether an orb of the list is the chosen one; `connected` is the identity there.

        It is "" while there is no connection.
        """
        port = self._where()
        if not (port and entry.device_id):
            return not port and not entry.device_id
        return entry.device_id == connected if connected else entry.port == port

    def scan(self) -> None:
        """Look for orbs, on a thread; `entries` has each as soon as it has answered."""
        if not self.scanning:
            self.scanning, self._answers, self.notice = True, [], ""
            threading.Thread(target=self._scan, args=(self._where(),), daemon=True).start()

    def _scan(self, taken: str) -> None:
        """Ask all ports but the one that is open; opening it twice would disturb it."""
        try:
            ports = discovery.candidates(self._memory)
            ports.pop(taken, None)
            discovery.ask_all(ports, each=self._results.put)
        finally:
            self._results.put(None)

    # -- choosing --------------------------------------------------------------------------

    def choose(self, entry: KnownDevice) -> None:
        """Connect to an orb of the list, or say in `notice` why that cannot be."""
        try:
            key = psk.read(Path(entry.key)) if entry.key else b""
        except psk.KeyFileError as error:
            self.notice = str(error)
            return
        self.notice = ""
        self._end_own()
        if not entry.device_id:
            own = self._own = self._make_own()
            self._link.reopen(own.open, token=own.token)
            self._where = str
            self._moved(None, "")
            return
        port = DevicePort(entry.device_id, self._memory, entry.key, at=entry.port)
        self._where = partial(getattr, port, "url")
        self._moved(port, entry.key)
        self._link.reopen(port.open, key=key)

    # -- what is under way -----------------------------------------------------------------

    def tick(self) -> None:
        """Take the results of the threads."""
        while not self._results.empty():
            answer = self._results.get()
            if answer is None:
                self._scanned()
            else:
                self._answers.append(answer)

    def _scanned(self) -> None:
        self.scanning = False
        discovery.note(self._memory, self._answers)
        self.notice = next(iter(discovery.remarks(self._answers)), "")

    def close(self) -> None:
        """End our own virtual orb."""
        self._end_own()

    def _end_own(self) -> None:
        """End our own virtual orb, on a thread, because that may take seconds."""
        own, self._own = self._own, None
        if own is not None:
            threading.Thread(target=own.close, name="own orb").start()
