"""Taps: streams for other programs, one module each, found by name.

`--tap NAME` or `--tap NAME://WHERE` opens one. A tap gets what the program received, on a thread of
its own behind a bounded queue: what it cannot take in time is dropped and counted, and the program
never waits for it.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from typing import cast

from controller.console import count
from host.taps.base import Tap, TapError, TapThread, TapUnavailableError

__all__ = ["Tap", "TapError", "TapUnavailableError", "names", "open_tap", "open_taps"]


def names() -> tuple[str, ...]:
    """Return the taps there are."""
    found = (module.name for module in pkgutil.iter_modules(__path__))
    return tuple(sorted(name for name in found if name != "base"))


def open_tap(words: str) -> Tap:
    """Open a tap: `create(where)` of the module that is named before "://".

    Raises:
        TapError: There is no such module, or no such place.
        TapUnavailableError: It does not work here.
    """
    name, _, where = words.partition("://")
    if name not in names():
        raise TapError(f"there is no tap {name!r}; there are: {', '.join(names())} (docs/taps.md)")
    return cast(Tap, importlib.import_module(f"{__name__}.{name}").create(where))


def open_taps(
    wishes: Iterable[str], stack: ExitStack, warn: Callable[[str], None]
) -> list[TapThread]:
    """Open taps, each behind a thread of its own; the stack closes them.

    Args:
        wishes: As the user wrote them.
        stack: What ends them.
        warn: Takes a sentence for each that lost something.

    Raises:
        TapError: There is no such tap, or no such place.
        TapUnavailableError: One of them does not work here.
    """
    threads = []
    for words in dict.fromkeys(wishes):
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
