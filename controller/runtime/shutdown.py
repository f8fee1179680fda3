"""Shutdown: signals become reasons, so that a recording is sealed and the host told."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class ShutdownSignals(list[str]):
    """Reasons to end, in their order.

    Attributes:
        renew: Whether to read the settings again, and go on.
        at_once: Whether a signal ends the process itself, since there is nothing to close yet.
    """

    renew = False
    at_once = False


@contextmanager
def signals() -> Iterator[ShutdownSignals]:
    """Turn signals to end into reasons to end, in order, for as long as the context lasts.

    SIGHUP ends a program whose terminal was closed; without a terminal it means that
    the settings have changed.
    """
    reasons = ShutdownSignals()
    # Asked now: a terminal that has been closed is none any more.
    terminal = any(stream.isatty() for stream in (sys.stdin, sys.stdout, sys.stderr) if stream)
    numbers = [signal.SIGINT, signal.SIGTERM]
    hangup = getattr(signal, "SIGHUP", None)  # the terminal was closed; Windows has none
    if hangup is not None and signal.getsignal(hangup) is not signal.SIG_IGN:  # by nohup
        numbers.append(hangup)

    def handle(number: int, frame: FrameType | None) -> None:
        if number == hangup and not terminal:
            reasons.renew = True
            return
        if reasons.at_once:
            os._exit(128 + number)  # as shells report a process that a signal ended
        reasons.append(signal.Signals(number).name)

    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield reasons
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
