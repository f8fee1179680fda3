"""Signals that end a program: a flag for its loop, and a hard end for a step that hangs."""

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator
from types import FrameType
from typing import Final

GRACE_S: Final = 1.2  # from a signal to the hard end if no loop asks; all takes at most 2 s
ENDING_S: Final = 5.0  # from a signal to the hard end of a program that has begun to end
CLOSE_S: Final = 0.6  # for what is closed before the hard end
SEAL_S: Final = 15.0  # from a signal to the hard end of a program that writes its last file


class Shutdown(list[str]):
    """Reasons to end, in their order.

    Attributes:
        renew: Whether to read the settings again, and go on.
        at_once: Whether a signal ends the process itself, since there is nothing to close yet.
        noticed: Whether a loop has asked for reasons since there is one, and so begun to end.
        sealing: Whether a file is written at the end, which takes its time.
        close: Releases what outlasts the process, such as keys; called by another thread before
            the hard end.
        status: Exit status of a program that ended by a signal; 0 without one.
    """

    renew = False
    at_once = False
    noticed = False
    sealing = False
    close: Callable[[], None] = staticmethod(lambda: None)
    status = 0

    def __bool__(self) -> bool:
        """Whether to end; a loop that asks and hears so has noticed."""
        self.noticed = self.noticed or len(self) > 0
        return self.noticed


@contextlib.contextmanager
def signals(*, renews: bool = False) -> Iterator[Shutdown]:
    """Turn signals to end into reasons to end, in order, for as long as the context lasts.

    If no loop asks for the first one within GRACE_S, a step hangs, and the process ends. Signals
    that are ignored stay so. If the program `renews`, SIGHUP without a terminal asks for that.
    """
    shutdown = Shutdown()
    # Windows has no SIGHUP. One is ignored by nohup, and SIGINT in a shell's background.
    known = [getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP")]
    numbers = [n for n in known if n is not None and signal.getsignal(n) is not signal.SIG_IGN]
    # Asked now: a terminal that has been closed is none any more.
    terminal = any(stream.isatty() for stream in (sys.stdin, sys.stdout, sys.stderr) if stream)
    renewing = known[2] if renews and not terminal else None

    def handle(number: int, frame: FrameType | None) -> None:
        if number == renewing:
            shutdown.renew = True
            return
        if shutdown.at_once:
            os._exit(128 + number)  # as shells report a process that a signal ended
        shutdown.status = shutdown.status or 128 + number
        shutdown.append(signal.Signals(number).name)

    # The system writes a signal's number there at once, also while the main thread hangs.
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    ends = {number for number in numbers if number != renewing}
    threading.Thread(target=_guard, args=(reader, ends, shutdown), name="end", daemon=True).start()
    woken = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield shutdown
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(woken)
        writer.close()


def _guard(reader: socket.socket, ends: Collection[int], shutdown: Shutdown) -> None:
    """End the process some time after a signal, unless the other end of `reader` is closed."""
    with reader:
        number = None
        while number is None:
            if not (data := reader.recv(64)):
                return
            number = next((byte for byte in data if byte in ends), None)
        began_s = time.monotonic()
        if _closed(reader, began_s + GRACE_S):
            return
        if shutdown.noticed:
            limit_s = SEAL_S if shutdown.sealing else ENDING_S
            if _closed(reader, began_s + limit_s):
                return
    last = threading.Thread(target=shutdown.close, name="last", daemon=True)
    last.start()
    last.join(CLOSE_S)
    os._exit(128 + number)


def _closed(reader: socket.socket, until_s: float) -> bool:
    """Return whether the other end is closed by a time of the monotonic clock."""
    while (left_s := until_s - time.monotonic()) > 0.0:
        reader.settimeout(left_s)
        try:
            if not reader.recv(64):
                return True
        except TimeoutError:
            break
    return False
