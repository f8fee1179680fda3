"""Link over a listening TCP port: listen://127.0.0.1:PORT.

By default only this machine can connect. Another address, such as 0.0.0.0 (all of this machine's),
requires a key.
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
from controller.shared.protocol.codec import ProtocolError
from controller.shared.protocol.messages import Welcome

SEND_BUFFER = 32 * 1024  # bytes: unread messages stay in the session, which can drop them
PEERS = 8  # connections at a time; one of them is the host, the others are refused

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: Access) -> ListenLink:
    """Listen at listen://ADDRESS:PORT; port 0 takes any free one.

    LinkError if the address is for other machines, and there is no key; or if the port is taken.
    """
    listener = _bind(url, access)
    try:
        return ListenLink(listener, welcome, access)
    except ProtocolError:
        listener.close()
        raise


class ListenLink(StreamLink):
    """Link to one TCP client at a time; `url` is its address for hosts on this machine."""

    def __init__(self, listener: socket.socket, welcome: Welcome, access: Access) -> None:
        """Take over a listening socket, and start."""
        super().__init__(welcome, access)
        host, port = listener.getsockname()[:2]
        host = _OWN.get(host, host)
        self.url = f"socket://[{host}]:{port}" if ":" in host else f"socket://{host}:{port}"
        listener.setblocking(False)
        self._listener = listener
        self._selector.register(listener, selectors.EVENT_READ, self._accept)
        self.start()

    def _accept(self, events: int) -> None:
        with contextlib.suppress(OSError):  # closed before it was accepted
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


_OWN = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # loopback address of each wildcard address


def _bind(url: str, access: Access) -> socket.socket:
    """Return a listening socket, or raise LinkError."""
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
    if not loopback and not access.key:
        raise LinkError(
            f"will not listen at {url}, where other machines could connect; add --key FILE, or "
            f"write listen://127.0.0.1:{port}"
        )
    if not loopback:
        log.warning(
            "listening at %s for hosts with the key; sensor data is not encrypted: others on this "
            "network can read it, but not change it",
            url,
        )
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=PEERS)
    except OSError as error:
        advice = {
            errno.EADDRINUSE: "another program has this port; name another one, or 0 for any",
            errno.EACCES: "ports below 1024 are the system's; name a higher one, or 0 for any",
        }.get(error.errno or 0, f"{error.strerror}; try listen://127.0.0.1:0")
        raise LinkAwayError(f"cannot listen at {url}: {advice}") from error
