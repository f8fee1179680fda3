"""Taps: streams for other programs, one module each, found by name.

`--tap NAME` or `--tap NAME://ADDRESS` opens one. A tap gets the received events on its own thread
behind a bounded queue: events beyond the queue are dropped and counted, and the program never
waits for it.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from typing import cast

from controller.errors import count
from host.taps.base import Tap, TapError, TapThread, TapUnavailableError

__all__ = ["Tap", "TapError", "TapUnavailableError", "names", "open_tap", "open_taps"]


def names() -> tuple[str, ...]:
    """Return the taps there are."""
    found = (module.name for module in pkgutil.iter_modules(__path__))
    return tuple(sorted(name for name in found if name != "base"))


def open_tap(words: str) -> Tap:
    """Open a tap: `create(address)` of the module that is named before "://".

    Raises:
        TapError: The module or the address is unknown.
        TapUnavailableError: It does not work on this machine.
    """
    name, _, address = words.partition("://")
    if name not in names():
        raise TapError(f"there is no tap {name!r}; there are: {', '.join(names())} (docs/taps.md)")
    return cast(Tap, importlib.import_module(f"{__name__}.{name}").create(address))


def open_taps(
    values: Iterable[str], stack: ExitStack, warn: Callable[[str], None]
) -> list[TapThread]:
    """Open taps, each on its own thread; the stack closes them.

    Args:
        values: Values of `--tap`.
        stack: Closes the taps.
        warn: Called with a sentence for each tap that failed or dropped events.

    Raises:
        TapError: A tap or its address is unknown.
        TapUnavailableError: A tap does not work on this machine.
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
