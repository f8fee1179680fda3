"""Phone or tablet as the skin of a virtual orb: one page and one WebSocket, behind a token."""

from __future__ import annotations

import errno
import os
import socket
from contextlib import suppress
from ipaddress import ip_address
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from controller.errors import TroubleError, UserError, how_to_install

if TYPE_CHECKING:
    from host.phone.server import PhoneServer

PORT: Final = 4025
# Routes towards these are looked up in the system's table, which names the interfaces' addresses.
_ELSEWHERE: Final = ("192.0.2.1", "10.255.255.254", "172.31.255.254", "192.168.255.254")


class PhoneAddressError(UserError, ValueError):
    """The address for the phone's page cannot be used; one sentence with what to do."""


class PhoneUnavailableError(TroubleError, OSError):
    """A phone cannot be served here; one sentence with what to do."""


def open_phone(words: str) -> PhoneServer:
    """Serve the page on ADDRESS or ADDRESS:PORT; PhoneAddressError or PhoneUnavailableError."""
    address, port = address_of(words)
    try:
        from host.phone import qr  # noqa: F401 - a missing library shows before anything is served
        from host.phone.server import PhoneServer
    except ModuleNotFoundError as error:
        raise PhoneUnavailableError(
            f"a phone needs {error.name}; {how_to_install('phone')}"
        ) from None
    return PhoneServer(listener(address, port))


def address_of(words: str) -> tuple[str, int]:
    """Return address and port of ADDRESS or ADDRESS:PORT, an IPv6 one in brackets before a port."""
    try:
        parts = urlsplit(f"//{words}")
        address, port = ip_address(parts.hostname or ""), parts.port
    except ValueError:
        raise PhoneAddressError(_which(f"--phone {words}".strip() + " names no address")) from None
    if address.is_unspecified or parts.path or parts.query or parts.username is not None:
        raise PhoneAddressError(_which(f"--phone {words} is not the address of one network"))
    return str(address), PORT if port is None else port


def listener(address: str, port: int) -> socket.socket:
    """Return a socket that listens there.

    Raises:
        PhoneAddressError: The address is none of this machine's.
        PhoneUnavailableError: The port is taken, or not for this user.
    """
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        return socket.create_server((address, port), family=family)
    except OSError as error:
        if error.errno == errno.EADDRNOTAVAIL:
            problem = _which(f"{address} is not an address of this machine")
            raise PhoneAddressError(problem) from None
        raise PhoneUnavailableError(
            f"port {port} of {address} cannot be used ({os.strerror(error.errno or 0).lower()}); "
            f"name another one: ADDRESS:{PORT + 1}"
        ) from error


def own_addresses() -> list[str]:
    """Return this machine's IPv4 addresses in networks, as far as routes lead there.

    Nothing is sent: connecting a UDP socket only chooses its own address.
    """
    found: list[str] = []
    for elsewhere in _ELSEWHERE:
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((elsewhere, 9))
            found.append(probe.getsockname()[0])
    return list(dict.fromkeys(found))


def _which(problem: str) -> str:
    own = own_addresses()
    there = " or ".join(own) if own else "none in a network: connect it to the phone's Wi-Fi first"
    return f"{problem}; expected an address of this machine: {there}"
