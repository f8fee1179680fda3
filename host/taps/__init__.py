"""Taps: streams for other programs, one module each, found by name.

`--tap NAME` or `--tap NAME://ADDRESS` opens one. A tap gets the received events on its own thread
behind a bounded queue: events beyond the queue are dropped and counted, and the program never
waits for it.
"""

from __future__ import annotations

import importlib
import logging
import pkgutil
import queue
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import replace
from typing import Final, cast

from controller.shared import plugins
from controller.shared.errors import TroubleError, UserError, count
from controller.shared.protocol.messages import Command, ContactState, Telemetry, Welcome
from controller.shared.protocol.teaching import Vocabulary
from host.connection.receiver import Connected, Delivered, Lost, Missed, Received, Stale

WAITING: Final = 256  # limit of queued events, two seconds at 100 Hz
END_S: Final = 1.0  # for queued events when the program ends
CONTACT: Final = {  # fields of a contact in the order in which taps send them, and their units
    **dict.fromkeys(("x", "y", "place_sigma"), "grid"),
    **dict.fromkeys(("depth_mm", "depth_sigma"), "mm"),
    "fingers": "count",
    "fingers_sure": "probability",
    **dict.fromkeys(("angle_deg", "angle_sigma"), "degrees"),
    **dict.fromkeys(("rise_mm", "rise_sigma"), "mm"),
}

log = logging.getLogger(__name__)


class TapError(UserError, ValueError):
    """The tap or its address is unknown."""


class TapUnavailableError(TroubleError, OSError):
    """A tap cannot be opened here; the message is one sentence with what to do."""


class Tap(ABC):
    """A stream of frames, probabilities, gestures and commands for other programs.

    All calls come from one thread. `connected` is always the first, and comes again with every
    session and when the gestures change; times are the device's, milliseconds since that session's
    Welcome.
    """

    @abstractmethod
    def connected(self, welcome: Welcome) -> None:
        """Handle a device that has connected or reconnected."""

    @abstractmethod
    def telemetry(self, message: Telemetry, t_ms: int) -> None:
        """Handle a frame: its image, and the probabilities."""

    @abstractmethod
    def gesture(self, label: str, t_ms: int) -> None:
        """Handle a change of the held gesture; "" is none."""

    @abstractmethod
    def command(self, message: Command, t_ms: int) -> None:
        """Handle a command."""

    def contact(self, message: ContactState, t_ms: int) -> None:  # noqa: B027
        """Handle what touches in a frame; `fingers` is 0 once when that has ended."""

    def missed(self, count: int) -> None:  # noqa: B027
        """Handle a number of commands that did not arrive in time."""

    def link(self, state: str) -> None:  # noqa: B027
        """Handle a change of the link to "live", "stale" or "lost"."""

    @abstractmethod
    def close(self) -> None:
        """Close the stream."""


class TapThread:
    """The thread of one tap, behind a queue of bounded size.

    Attributes:
        name: Value of `--tap`.
        dropped: Number of events dropped because the tap was too slow.
        failure: Reason that it stopped, "" while it works.
    """

    def __init__(self, name: str, tap: Tap, waiting: int = WAITING) -> None:
        """Start the thread, which closes the tap at its end."""
        self.name = name
        self.dropped = 0
        self.failure = ""
        self._tap = tap
        self._queue: queue.Queue[Received | None] = queue.Queue(waiting)
        self._closing = threading.Event()
        self._gesture = ""
        self._touch: tuple[int, int] | None = None  # frame and time of the contact
        self._welcome: Welcome | None = None
        self._state = ""
        self._thread = threading.Thread(target=self._run, name=f"tap {name}", daemon=True)
        self._thread.start()

    def hear(self, received: Iterable[Received]) -> None:
        """Queue received events; those beyond the queue's size are dropped and counted."""
        for event in received:
            try:
                self._queue.put_nowait(event)
            except queue.Full:
                self.dropped += 1

    def close(self) -> None:
        """Process the queued events for at most a second, and end."""
        try:
            self._queue.put(None, timeout=END_S)
        except queue.Full:
            self._closing.set()
        self._thread.join(END_S)

    def _run(self) -> None:
        try:
            while not self._closing.is_set() and (event := self._queue.get()) is not None:
                self._feed(event)
        except Exception as error:  # of any library; the program continues
            self.failure = " ".join(str(error).split()) or type(error).__name__
            log.exception("tap %s has stopped", self.name)
            while self._queue.get() is not None:
                self.dropped += 1
        finally:
            self._tap.close()

    def _feed(self, event: Received) -> None:
        match event:
            case Connected(welcome=welcome):
                self._lift()
                self._gesture, self._welcome = "", welcome
                self._tap.connected(welcome)
                self._link("live")
            case Delivered(message=Vocabulary(labels=labels, commands=commands)):
                if self._welcome is not None and labels != self._welcome.labels:
                    self._welcome = replace(self._welcome, labels=labels, commands=commands)
                    self._tap.connected(self._welcome)
            case Stale():
                self._link("stale")
            case Lost():
                self._link("lost")
            case Missed():
                self._tap.missed(event.count)
            case Delivered(message=Telemetry() as message, t_ms=t_ms):
                self._link("live")
                self._tap.telemetry(message, t_ms)
                if message.gesture != self._gesture:
                    self._gesture = message.gesture
                    self._tap.gesture(message.gesture, t_ms)
            case Delivered(message=Command() as message, t_ms=t_ms):
                self._link("live")
                self._tap.command(message, t_ms)
            case Delivered(message=ContactState() as message, t_ms=t_ms):
                self._link("live")
                self._touch = (message.frame, t_ms) if message.fingers else None
                self._tap.contact(message, t_ms)
            case Delivered():
                self._link("live")

    def _lift(self) -> None:
        """End the contact, if there is one: the link has been silent or lost."""
        if self._touch is not None:
            self._tap.contact(ContactState(self._touch[0]), self._touch[1])
            self._touch = None

    def _link(self, state: str) -> None:
        if state != "live":
            self._lift()
        if state != self._state:
            self._state = state
            self._tap.link(state)


def names() -> tuple[str, ...]:
    """Return the taps there are."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules(__path__)))


def open_tap(words: str) -> Tap:
    """Open a tap: `create(address)` of the module that is named before "://".

    TapError if one of them is unknown, TapUnavailableError if it does not work on this machine.
    """
    name, _, address = words.partition("://")
    if name not in names():
        if (found := plugins.find("taps", name)) is not None:
            return cast(Tap, found.create(address))
        known = ", ".join((*names(), *plugins.names("taps")))
        raise TapError(f"there is no tap {name!r}; there are: {known} (orbtouch docs taps)")
    return cast(Tap, importlib.import_module(f"{__name__}.{name}").create(address))


def open_taps(
    values: Iterable[str], stack: ExitStack, warn: Callable[[str], None]
) -> list[TapThread]:
    """Open the taps of `--tap`, each on its own thread; the stack closes them.

    `warn` is called with a sentence for each tap that failed or dropped events. Errors are those of
    `open_tap`.
    """
    threads = []
    for words in dict.fromkeys(values):
        threads.append(TapThread(words, open_tap(words)))
        stack.callback(_end, threads[-1], warn)
    return threads


def _end(thread: TapThread, warn: Callable[[str], None]) -> None:
    thread.close()
    if thread.failure:
        warn(f"tap {thread.name} stopped: {thread.failure}")
    if thread.dropped:
        lost = count(thread.dropped, "message")
        warn(f"tap {thread.name} was too slow, and did not get {lost}")
