"""Base class of links, their errors, and the limit of log lines."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from controller.shared.errors import TroubleError, UserError
from controller.shared.protocol.messages import VERSION, Bye, Hello, Message, Welcome
from controller.shared.request_queue import RequestQueue

HUSH_S: Final = 10.0  # in which `LogLimit` lets each line pass once


class LinkError(UserError, OSError):
    """A link cannot be opened; the message is one sentence with what to do."""


class LinkAwayError(LinkError, TroubleError):
    """A resource of the link is missing: a port, a library, an adapter, a free address."""


@dataclass(frozen=True, slots=True)
class Access:
    """Access control of a link."""

    token: str = field(default="", repr=False)  # shared secret of the hosts; "" accepts every host
    key: bytes = field(default=b"", repr=False)  # authenticates every frame; b"": none does


class Link(ABC):
    """The device's end of a link. No method but `wait` blocks.

    Attributes:
        url: The address to which hosts connect; "" if there is none.
        touchable: Whether hosts send requests, such as touches of a virtual orb.
        authenticated: Whether only hosts with a key, a token or a bond are served.
        problem: Reason that the link has ended by itself, one sentence; "" while it works.
    """

    url: str = ""
    touchable: bool = True
    authenticated: bool = False
    problem: str = ""

    @property
    @abstractmethod
    def dropped(self) -> int:
        """Number of messages not sent: there was no host, or it reads too slowly."""

    @property
    @abstractmethod
    def connected(self) -> bool:
        """Whether the host of the latest Hello that `poll` returned is still connected."""

    @property
    def state(self) -> str:
        """Return "ready", or a sentence about what is missing."""
        return "ready"

    @abstractmethod
    def send(self, message: Message, t_ms: int) -> None:
        """Send a message of the device's time `t_ms`, or drop it."""

    def poll(self) -> list[Message]:
        """Return the host's new requests, oldest first: Hello, Contacts, Perform and Grant, Bye.

        Hello ends an earlier session; Bye also follows a lost connection.
        """
        return []

    @abstractmethod
    def wait(self, timeout_s: float) -> None:
        """Return when `poll` has requests, or after the timeout."""

    def pair(self, seconds: int) -> None:  # noqa: B027
        """Allow new hosts to pair for a while; no effect on a link without pairing."""

    def renew(self, welcome: Welcome, reason: str) -> None:  # noqa: B027
        """Replace the description of the device; the host gets the reason, and reconnects.

        With the reason "" the session goes on, and the next one has the new description.
        """

    @abstractmethod
    def close(self) -> None:
        """Send Bye, and end the thread; a second call has no effect."""


class KeyLink(Link):
    """Link to one host at a time, without packets: it sends key presses only.

    Attributes:
        connected: Whether a host takes key presses; changes only in `poll`, with Hello and Bye.
    """

    touchable = False
    dropped = 0
    connected = False

    def __init__(self) -> None:
        self._requests: RequestQueue[Message] = RequestQueue()

    def poll(self) -> list[Message]:
        """Return Hello for every host that has come, and Bye when there is none."""
        messages = self._requests.take()
        if messages:
            self.connected = isinstance(messages[-1], Hello)
        return messages

    def wait(self, timeout_s: float) -> None:
        """Return when `poll` has requests, or after the timeout."""
        self._requests.wait(timeout_s)

    def _change_host(self, name: str) -> None:
        """Queue a change of the host, "" for none; callable from any thread."""
        hello = Hello(VERSION, VERSION, "", name, False)
        self._requests.put(hello if name else Bye("the host has gone"))


class LogLimit:
    """Rate limit of log lines that a peer can cause, so that none can fill the disk with them."""

    def __init__(self, lines: int = 20, clock: Callable[[], float] = time.monotonic) -> None:
        """Allow each line once within `HUSH_S`, and `lines` in all; `clock` returns seconds."""
        self._clock = clock
        self._logged: deque[tuple[float, str]] = deque(maxlen=lines)

    def lets(self, line: str) -> bool:
        """Return whether to log a line now."""
        now_s = self._clock()
        while self._logged and now_s - self._logged[0][0] >= HUSH_S:
            self._logged.popleft()
        if len(self._logged) == self._logged.maxlen or any(line == old for _, old in self._logged):
            return False
        self._logged.append((now_s, line))
        return True
