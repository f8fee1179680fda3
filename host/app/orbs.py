"""Orbs that are known and found, and the change from one to another.

Scans and pairings run on threads of their own; `tick` takes their results on the window's thread.
"""

import asyncio
import queue
import threading
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Final

from controller.shared.bluetooth.bluez import BluetoothError
from controller.shared.protocol import psk
from host.connection import discovery, pairing
from host.connection.device_store import DeviceStore, KnownDevice
from host.connection.discovery import Answer, DevicePort, Port
from host.connection.pairing import Confirm, Tell
from host.connection.receiver import Receiver
from host.connection.virtual_orb import VirtualOrbProcess

OWN: Final = KnownDevice("", virtual=True, seen=discovery.NOW)  # the program's own virtual orb
CANCELLED: Final = "cancelled"
_TURN_S: Final = 0.05  # in which an answer, or the end, of a pairing is noticed

Pair = Callable[[Tell, Confirm], Awaitable[str]]


class PairingRun:
    """A pairing with a Bluetooth orb on a thread of its own, with its messages and questions.

    Attributes:
        lines: What it has said, oldest first.
        question: Name and six digits of an orb that wait for `answer`; None: no question.
        url: Of the orb, once it is paired; "" before.
        over: Whether it has ended.
    """

    def __init__(self, pair: Pair = pairing.pair) -> None:
        self.lines: list[str] = []
        self.question: tuple[str, str] | None = None
        self.url, self.over = "", False
        self._pair, self._same, self._cancelled = pair, False, False

    def start(self) -> None:
        """Begin on a thread."""
        threading.Thread(target=self.run, name="pairing", daemon=True).start()

    def run(self) -> None:
        """Pair, until it is done, fails or is cancelled."""
        if problem := pairing.lack():
            self.lines += problem.splitlines()
        else:
            try:
                self.url = asyncio.run(self._main())
            except asyncio.CancelledError:
                self.lines.append(CANCELLED)
            except (BluetoothError, OSError) as error:
                self.lines.append(str(error))
        self.over, self.question = True, None

    async def _main(self) -> str:
        task = asyncio.ensure_future(self._pair(self.lines.append, self._confirm))
        while not task.done():
            if self._cancelled:
                task.cancel()
            await asyncio.wait([task], timeout=_TURN_S)
        return task.result()

    async def _confirm(self, orb: str, digits: str) -> bool:
        self.question = orb, digits
        while self.question is not None:
            await asyncio.sleep(_TURN_S)
        return self._same

    def answer(self, same: bool) -> None:
        """Answer the question whether the digits are the same."""
        self._same, self.question = same, None

    def cancel(self) -> None:
        """End it; nothing once it is over."""
        self._cancelled = True


class Orbs:
    """The list of orbs, the present one, and what is under way: a scan, a pairing.

    Attributes:
        notice: What the last choice or scan came to, a sentence; "": nothing to say.
        scanning: Whether a scan is under way.
        pairing: The pairing under way, or the last one; None before the first.
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
        self.pairing: PairingRun | None = None
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
            ports: list[Port] = discovery.candidates(self._memory)
            discovery.ask_all([p for p in ports if p.url != taken], each=self._results.put)
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

    def pair(self) -> None:
        """Pair with a Bluetooth orb that waits for it, on a thread."""
        if self.pairing is None or self.pairing.over:
            self.pairing = PairingRun()
            self.pairing.start()

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
        """End our own virtual orb and a pairing."""
        self._end_own()
        if self.pairing is not None:
            self.pairing.cancel()

    def _end_own(self) -> None:
        """End our own virtual orb, on a thread, because that may take seconds."""
        own, self._own = self._own, None
        if own is not None:
            threading.Thread(target=own.close, name="own orb").start()
