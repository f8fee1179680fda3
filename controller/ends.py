"""How a program ends: signals become reasons, so that a recording is sealed and the host told."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def signals() -> Iterator[list[str]]:
    """Turn signals to end into reasons to end, in order, for as long as the context lasts."""
    reasons: list[str] = []
    numbers = [signal.SIGINT, signal.SIGTERM]
    hangup = getattr(signal, "SIGHUP", None)  # the terminal was closed; Windows has none
    if hangup is not None and signal.getsignal(hangup) is not signal.SIG_IGN:  # by nohup
        numbers.append(hangup)

    def handle(number: int, frame: FrameType | None) -> None:
        reasons.append(signal.Signals(number).name)

    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield reasons
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def complain(problem: Exception | str, status: int) -> int:
    """Say in one sentence what is wrong, and return the exit status."""
    print(f"controller: {problem}", file=sys.stderr)
    return status
