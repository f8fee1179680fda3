"""Work with files on a thread, in order, so that the loop never waits for a disk."""

import logging
import queue
import threading
from collections.abc import Callable, Iterable
from typing import Final

from controller.shared.notices import notice
from controller.shared.protocol.messages import Message
from controller.shared.protocol.teaching import FAILED, LearnStatus

MOST: Final = 64  # works that may wait
BUSY: Final = notice("busy")

Work = Callable[[], Iterable[Message]]  # returns the messages about its outcome

_log = logging.getLogger("controller")


class Worker:
    """A thread that is started with the first work, and ends with the program."""

    def __init__(self) -> None:
        self._todo: queue.SimpleQueue[Work] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None

    def begin(self, work: Work, refusal: Message | None = None) -> list[Message]:
        """Add a work; return the refusal, or that the orb is busy, if too many wait."""
        if self._todo.qsize() >= MOST:
            return [refusal or failed(BUSY)]
        self._todo.put(work)
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="files", daemon=True)
            self._thread.start()
        return []

    def tell(self, message: Message) -> None:
        """Add a message before those that a work returns later; for works."""
        self._done.put(message)

    def poll(self) -> list[Message]:
        """Return new messages, oldest first, without waiting."""
        return [self._done.get_nowait() for _ in range(self._done.qsize())]

    def _run(self) -> None:
        while True:
            work = self._todo.get()
            try:
                for message in work():
                    self._done.put(message)
            except Exception:  # the thread goes on
                _log.exception("the orb could not do that")


def failed(why: str) -> Message:
    """Return the outcome of a request that was refused, or has failed, for a reason."""
    return LearnStatus(FAILED, 1.0, why)
