"""A link that waits for a host on a TCP port: listen://127.0.0.1:PORT.

Only this machine can connect, unless the user names an address such as 0.0.0.0 (all of this
machine's), and either a key, or that the link is open without one.
"""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import logging
import selectors
import socket
from urllib.parse import urlsplit

from controller.links.base import Access, LinkAwayError, LinkError
from controller.links.byte_link import StreamLink
from controller.protocol.codec import ProtocolError
from controller.protocol.messages import Welcome

SEND_BUFFER = 32 * 1024  # bytes: what a host does not read waits where it can be dropped
PEERS = 8  # connections at a time; one of them is the host, the others get a refusal

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: Access) -> ListenLink:
    """Listen at listen://ADDRESS:PORT; port 0 takes any free one.

    Raises:
        LinkError: The address is for other machines, and there is no key; or the port is taken.
        ProtocolError: The wire cannot carry this Welcome.
    """
    listener = _bind(url, access)
    try:
        return ListenLink(listener, welcome, access)
    except ProtocolError:
        listener.close()
        raise


class ListenLink(StreamLink):
    """One host at a time.

    Attributes:
        url: Where hosts of this machine connect to: socket://127.0.0.1:PORT.
    """

    def __init__(self, listener: socket.socket, welcome: Welcome, access: Access) -> None:
        """Take over a listening socket, and begin."""
        super().__init__(welcome, access)
        host, port = listener.getsockname()[:2]
        host = _OWN.get(host, host)
        self.url = f"socket://[{host}]:{port}" if ":" in host else f"socket://{host}:{port}"
        listener.setblocking(False)
        self._listener = listener
        self._selector.register(listener, selectors.EVENT_READ, self._accept)
        self.start()

    def _accept(self, events: int) -> None:
        with contextlib.suppress(OSError):  # it went away before we looked
            connection, _ = self._listener.accept()
            if len(self._peers) >= PEERS:
                connection.close()
                return
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            self._attach(connection)

    def _shut(self) -> None:
        self._selector.unregister(self._listener)
        self._listener.close()
        super()._shut()


_OWN = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # where a wildcard is reached from this machine


def _bind(url: str, access: Access) -> socket.socket:
    """Return a socket that listens; LinkError if it cannot."""
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        host, port = "", None
    if port is None:
        raise LinkError(f"cannot listen at {url}; write listen://127.0.0.1:PORT, 0 for any port")
    host = "127.0.0.1" if host == "localhost" else host
    try:
        loopback = ipaddress.ip_address(host).is_loopback
    except ValueError:
        raise LinkError(
            f"cannot listen at {url}, whose address is no number of this machine's; "
            f"write listen://127.0.0.1:{port}, or 0.0.0.0 with --key FILE"
        ) from None
    if not loopback:
        _check_exposed(url, port, access)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=PEERS)
    except OSError as error:
        what = {
            errno.EADDRINUSE: "another program has this port; name another one, or 0 for any",
            errno.EACCES: "ports below 1024 are the system's; name a higher one, or 0 for any",
        }.get(error.errno or 0, f"{error.strerror}; try listen://127.0.0.1:0")
        raise LinkAwayError(f"cannot listen at {url}: {what}") from error


def _check_exposed(url: str, port: int, access: Access) -> None:
    """Warn about listening for other machines; refuse it where the user has not agreed.

    Raises:
        LinkError: There is no key, and the link may not be open without one.
    """
    if access.key:
        log.warning(
            "listening at %s for hosts with the key; what the orb feels is not encrypted: "
            "others on this network can read it, but not change it",
            url,
        )
    elif access.exposed:
        log.warning(
            "listening at %s without a key: everybody who reaches this address sees what the "
            "orb feels, can keep your own host out and, if the orb is virtual, move it",
            url,
        )
    else:
        raise LinkError(
            f"will not listen at {url}, where strangers could connect; add --key FILE, or "
            f"--unprotected to let everybody in, or write listen://127.0.0.1:{port}"
        )
