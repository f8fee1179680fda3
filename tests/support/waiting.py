"""Waiting for something that another thread or process does."""

import os
import signal
import time
from collections.abc import Callable
from typing import Any

PATIENCE_S = 30.0  # an upper bound; what is waited for takes milliseconds


def until(condition: Callable[[], Any], *, passing: tuple[type[Exception], ...] = ()) -> Any:
    """Return the first true value of a condition; fail after `PATIENCE_S`."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        try:
            if value := condition():
                return value
        except passing:
            pass
        time.sleep(0.001)
    raise AssertionError("it did not come true")


def stop_child(pid: int) -> None:
    """Stop a child process; return once each of its threads has stopped."""
    os.kill(pid, signal.SIGSTOP)
    os.waitpid(pid, os.WUNTRACED)
