"""Base class of links, their errors, and the queue between a link's thread and the loop."""

from __future__ import annotations

import contextlib
import queue
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from controller.errors import TroubleError, UserError
from controller.protocol.messages import Message, Welcome

Item = TypeVar("Item")


class LinkError(UserError, OSError):
    """A link cannot be opened; the message is one sentence with what to do."""


class LinkAwayError(LinkError, TroubleError):
    """What a link needs is not there now: a port, a library, an adapter, a free address."""


@dataclass(frozen=True, slots=True)
class Access:
    """Which hosts are let in; a link passes it on to its sessions.

    Attributes:
        token: What a host has to know; "" lets every host in.
        key: What every frame is sealed with; b"": frames are not sealed.
        exposed: The user allows a link without a key to be open to other machines.
    """

    token: str = field(default="", repr=False)
    key: bytes = field(default=b"", repr=False)
    exposed: bool = False


class Link(ABC):
    """The device's end of a link. None of its methods waits, `wait` apart.

    Attributes:
        url: Where hosts connect to; "" if no host connects to a place.
        touchable: Whether hosts send requests, such as touches of a virtual orb.
        authenticated: Whether only hosts with a key, a token or a bond are served.
        problem: Why the link has ended by itself, in one sentence; "" while it has not.
    """

    url: str = ""
    touchable: bool = True
    authenticated: bool = False
    problem: str = ""

    @property
    @abstractmethod
    def dropped(self) -> int:
        """Messages that never left: there was no host, or it reads too slowly."""

    @property
    @abstractmethod
    def connected(self) -> bool:
        """Whether the host of the latest Hello that `poll` returned is still there."""

    @property
    def state(self) -> str:
        """Whether the link is "ready", or in a sentence what is missing."""
        return "ready"

    @abstractmethod
    def send(self, message: Message, t_ms: int) -> None:
        """Send a message, at once or never.

        Args:
            message: The message.
            t_ms: The device's time that it belongs to.
        """

    def poll(self) -> list[Message]:
        """Return the host's new requests, oldest first.

        Hello begins a session (the old one, if any, is over); then come Contacts, Perform and
        Grant; Bye ends it, also when the host vanished without one.
        """
        return []

    @abstractmethod
    def wait(self, timeout_s: float) -> None:
        """Return when `poll` has requests, or after the timeout."""

    def pair(self, seconds: int) -> None:  # noqa: B027
        """Let new hosts pair for a while; nothing happens on a link without pairing."""

    def renew(self, welcome: Welcome, reason: str) -> None:  # noqa: B027
        """Replace the description of the device; the host gets the reason, and reconnects.

        Nothing happens on a link that describes no device.

        Raises:
            ProtocolError: The wire cannot carry this Welcome.
        """

    def print_record(self, record: Mapping[str, object]) -> None:  # noqa: B027
        """Print plain data that is no message, such as a cue; only the link that prints does."""

    @abstractmethod
    def close(self) -> None:
        """Send Bye, and end the thread. Nothing may be called afterwards but close."""


class RequestQueue(Generic[Item]):
    """Requests on their way from a link's thread to the loop."""

    def __init__(self) -> None:
        """Begin empty."""
        self._queue: queue.SimpleQueue[Item] = queue.SimpleQueue()
        self._ready: deque[Item] = deque()  # taken from the queue by `wait`

    def __len__(self) -> int:
        return self._queue.qsize() + len(self._ready)

    def put(self, item: Item) -> None:
        """Add a request, on any thread."""
        self._queue.put(item)

    def take(self) -> list[Item]:
        """Return all requests, oldest first, without waiting."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._ready.append(self._queue.get_nowait())
        items = list(self._ready)
        self._ready.clear()
        return items

    def wait(self, timeout_s: float) -> None:
        """Return when there is a request, or after the timeout."""
        if not self._ready:
            with contextlib.suppress(queue.Empty):
                self._ready.append(self._queue.get(timeout=max(timeout_s, 0.0)))
