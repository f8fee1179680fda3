"""Phone or tablet as the skin of a virtual orb: one page and one WebSocket, behind a token."""

from __future__ import annotations

import errno
import socket
from contextlib import suppress
from ipaddress import ip_address
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from controller.shared.errors import UserError, how_to_install, reason

if TYPE_CHECKING:
    from qrcode.main import QRCode

    from host.phone.server import PhoneServer

PORT: Final = 4025
# The system's routes towards these name the addresses of the machine's interfaces.
_ELSEWHERE: Final = ("192.0.2.1", "10.255.255.254", "172.31.255.254", "192.168.255.254")


def open_phone(words: str) -> PhoneServer:
    """Serve the page on ADDRESS or ADDRESS:PORT (IPv6 in brackets), or raise UserError."""
    try:
        parts = urlsplit(f"//{words}")
        address, port = ip_address(parts.hostname or ""), parts.port
        odd = address.is_unspecified or address.is_multicast
        if odd or parts.netloc != words or "@" in words:
            raise ValueError
    except ValueError:
        found = f"{words} is not one ADDRESS or ADDRESS:PORT" if words else "no address was given"
        raise _elsewhere(found) from None
    try:
        import qrcode.main  # noqa: F401 - what is missing shows before anything is served

        from host.phone.server import PhoneServer
    except ModuleNotFoundError as error:
        raise UserError(f"a phone needs {error.name}; {how_to_install('phone')}") from None
    family = socket.AF_INET if address.version == 4 else socket.AF_INET6
    try:
        place = str(address), PORT if port is None else port
        return PhoneServer(socket.create_server(place, family=family))
    except OSError as error:
        if error.errno == errno.EADDRNOTAVAIL:
            raise _elsewhere(f"{address} is not an address of this machine") from None
        raise UserError(f"--phone: {reason(error)}; name another port: ADDRESS:PORT") from error


def code(text: str) -> QRCode:
    """Return the QR code of a text, with the border of four light modules that readers need."""
    from qrcode.constants import ERROR_CORRECT_M  # in here: an optional extra
    from qrcode.main import QRCode

    made = QRCode(error_correction=ERROR_CORRECT_M, border=4)
    made.add_data(text)
    return made


def own_addresses() -> list[str]:
    """Return this machine's IPv4 addresses in networks, as far as its routes name them.

    Nothing is sent: connecting a UDP socket only chooses its own address.
    """
    found: dict[str, None] = {}
    for elsewhere in _ELSEWHERE:
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((elsewhere, 9))
            found[probe.getsockname()[0]] = None
    return list(found)


def _elsewhere(problem: str) -> UserError:
    own = " or ".join(own_addresses()) or "none in a network, so connect it to the phone's first"
    return UserError(f"--phone: {problem}; expected an address of this machine: {own}")
