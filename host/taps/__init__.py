"""Taps: streams for other programs, one module each, found by name.

`--tap NAME` or `--tap NAME://WHERE` opens one. A tap hears what the program hears, on a thread of
its own behind a bounded queue: what it cannot take in time is dropped and counted, and nothing
ever waits for it.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Protocol, cast

from controller.console import count
from controller.errors import TroubleError, UserError
from controller.protocol.messages import Command, Telemetry, Welcome

if TYPE_CHECKING:
    from host.taps._worker import Worker


class TapError(UserError, ValueError):
    """There is no such tap, or no such place for it."""


class TapUnavailableError(TroubleError, OSError):
    """A tap cannot be opened here; the message is one sentence with what to do."""


class Tap(Protocol):
    """Where frames, probabilities, gestures and commands are also told.

    All calls come from one thread. `connected` is always the first, and comes again with every
    session; times are the device's, milliseconds since that session's Welcome.
    """

    def connected(self, welcome: Welcome) -> None:
        """A device has come, or has come back."""

    def telemetry(self, message: Telemetry, t_ms: int) -> None:
        """A frame: its image, and what the device believes."""

    def gesture(self, label: str, t_ms: int) -> None:
        """The gesture that is held has changed; "" when there is none."""

    def command(self, message: Command, t_ms: int) -> None:
        """The player has asked for something."""

    def missed(self, count: int) -> None:
        """So many commands of the player never reached us in time."""

    def link(self, state: str) -> None:
        """The link has become "live", "stale" or "lost"."""

    def close(self) -> None:
        """Let go of everything."""


def names() -> tuple[str, ...]:
    """Return the taps there are."""
    found = (module.name for module in pkgutil.iter_modules(__path__))
    return tuple(sorted(name for name in found if not name.startswith("_")))


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


def open_taps(wishes: Iterable[str], stack: ExitStack, warn: Callable[[str], None]) -> list[Worker]:
    """Open taps, each behind a thread of its own; the stack closes them.

    Args:
        wishes: As the user wrote them.
        stack: What ends them.
        warn: Takes a sentence for each that lost something.

    Raises:
        TapError: There is no such tap, or no such place.
        TapUnavailableError: One of them does not work here.
    """
    from host.taps._worker import Worker  # which needs this module

    workers = []
    for words in dict.fromkeys(wishes):
        worker = Worker(words, open_tap(words))
        stack.callback(_end, worker, warn)
        workers.append(worker)
    return workers


def _end(worker: Worker, warn: Callable[[str], None]) -> None:
    worker.close()
    if worker.failure:
        warn(f"tap {worker.name} stopped: {worker.failure}")
    if worker.dropped:
        lost = count(worker.dropped, "message")
        warn(f"tap {worker.name} was too slow, and did not get {lost}")
