"""The thread of one tap: news in from the program without waiting, out as fast as the tap can."""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Iterable
from typing import Final

from controller.protocol.messages import Command, Telemetry
from host.connection.receiver import Connected, Delivered, Lost, Missed, Received, Stale
from host.taps import Tap

WAITING: Final = 256  # news that may wait for a tap, two seconds at 100 Hz
END_S: Final = 1.0  # for what waits when the program ends

log = logging.getLogger(__name__)


class Worker:
    """Feeds one tap.

    Attributes:
        name: What the user called it.
        dropped: News that the tap did not get, because it was too slow.
        failure: Why it stopped, "" while it works.
    """

    def __init__(self, name: str, tap: Tap, waiting: int = WAITING) -> None:
        """Begin to feed a tap; it belongs to the worker from now on."""
        self.name = name
        self.dropped = 0
        self.failure = ""
        self._tap = tap
        self._queue: queue.Queue[Received | None] = queue.Queue(waiting)
        self._closing = threading.Event()
        self._gesture = ""
        self._live = ""
        self._thread = threading.Thread(target=self._run, name=f"tap {name}", daemon=True)
        self._thread.start()

    def hear(self, received: Iterable[Received]) -> None:
        """Take what the program received; what finds no room is dropped and counted."""
        for news in received:
            try:
                self._queue.put_nowait(news)
            except queue.Full:
                self.dropped += 1

    def close(self) -> None:
        """Let the tap have what still waits, for a second, and end."""
        try:
            self._queue.put(None, timeout=END_S)
        except queue.Full:
            self._closing.set()
        self._thread.join(END_S)

    def _run(self) -> None:
        try:
            while not self._closing.is_set() and (news := self._queue.get()) is not None:
                self._take(news)
        except Exception as error:  # of a library that we do not know; the game goes on
            self.failure = " ".join(str(error).split()) or type(error).__name__
            # The traceback is for the library's maintainers, or for us.
            log.exception("tap %s has stopped", self.name)
            self._swallow()
        finally:
            self._tap.close()

    def _swallow(self) -> None:
        """Count what comes for a tap that has failed."""
        while self._queue.get() is not None:
            self.dropped += 1

    def _take(self, news: Received) -> None:
        match news:
            case Connected(welcome=welcome):
                self._gesture = ""
                self._tap.connected(welcome)
                self._link("live")
            case Stale():
                self._link("stale")
            case Lost():
                self._link("lost")
            case Missed(count=count):
                self._tap.missed(count)
            case Delivered(message=message, t_ms=t_ms):
                self._link("live")
                if isinstance(message, Telemetry):
                    self._tap.telemetry(message, t_ms)
                    self._hold(message.gesture, t_ms)
                elif isinstance(message, Command):
                    self._tap.command(message, t_ms)

    def _hold(self, label: str, t_ms: int) -> None:
        if label != self._gesture:
            self._gesture = label
            self._tap.gesture(label, t_ms)

    def _link(self, state: str) -> None:
        if state != self._live:
            self._live = state
            self._tap.link(state)
