"""Links: one module for each URL scheme, found by name. For `runtime` and `diagnostics`."""

from __future__ import annotations

import importlib
import importlib.util
import re
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from controller.errors import TroubleError, UserError
from controller.protocol.codec import ProtocolError
from controller.protocol.messages import Message, Welcome

_JOINT = re.compile(r"\+(?=[a-z]+:)")  # a plus elsewhere belongs to its URL


PRINT: Final = "-"  # the link that prints commands


class LinkError(UserError, OSError):
    """A link cannot be opened; the message says why and what to do, in one sentence."""


class LinkAwayError(LinkError, TroubleError):
    """What a link needs is not there now: a port, a library, an adapter, a free address."""


@dataclass(frozen=True, slots=True)
class Access:
    """Who is let in; a link passes it on to its sessions.

    Attributes:
        token: What a host has to know; "" lets everyone in.
        key: What every frame is sealed with; b"": frames are not sealed.
        exposed: The user has said that a link without a key may be open to other machines.
    """

    token: str = field(default="", repr=False)
    key: bytes = field(default=b"", repr=False)
    exposed: bool = False


class Link(Protocol):
    """The device's end of a link. None of its methods waits, `wait` apart.

    Attributes:
        dropped: Messages that never left: nobody was there, or reads too slowly.
    """

    dropped: int

    @property
    def connected(self) -> bool:
        """Whether the host that `poll` last told of is still there."""

    def send(self, message: Message, t_ms: int) -> None:
        """Say something, at once or never.

        Args:
            message: What to say.
            t_ms: The device's time that it belongs to.
        """

    def poll(self) -> list[Message]:
        """Return the host's new requests, oldest first.

        Hello begins a session (the old one, if any, is over); then come Contacts, Perform and
        Grant; Bye ends it, also when the host vanished without a word.
        """

    def wait(self, timeout_s: float) -> None:
        """Return when `poll` has something to tell, or after the timeout."""

    def close(self) -> None:
        """Say Bye, and end the thread. Nothing may be called afterwards but close."""


def open_link(
    url: str, welcome: Welcome, *, token: str = "", key: bytes = b"", exposed: bool = False
) -> Link:
    """Open a link.

    Args:
        url: "-" prints commands; "listen://127.0.0.1:PORT" waits for a host (0: any free port, see
            its `url`); anything else is the name of a port, or a URL that pyserial knows;
            "rfcomm:+hid:" opens both.
        welcome: What the device says of itself.
        token: What a host has to know; "" lets everyone in.
        key: What every frame is sealed with, on both ends; b"": frames are not sealed.
        exposed: Let other machines in, although there is no key.

    Raises:
        LinkError: It cannot be opened.
    """
    if not url:
        raise LinkError("--link names no port; leave it out to have commands printed")
    try:
        access = Access(token, key, exposed)
        link: Link = module_of(url).create(url, welcome, access)
    except ProtocolError as error:  # this Welcome, before anybody has asked for it
        raise LinkError(f"{error}; use fewer or shorter labels and commands") from None
    return link


def module_of(url: str) -> Any:
    """Return the module that opens a URL: the one that has its scheme's name, or `port`."""
    if len(split(url)) > 1:
        return importlib.import_module("controller.links.multi")
    scheme = "stdout" if url == "-" else url.partition(":")[0] if ":" in url else "port"
    if scheme.isidentifier() and importlib.util.find_spec(f"controller.links.{scheme}"):
        return importlib.import_module(f"controller.links.{scheme}")
    return importlib.import_module("controller.links.serial_port")


def split(url: str) -> list[str]:
    """Return the links that a URL names: one, or several with a plus in between."""
    return _JOINT.split(url)
