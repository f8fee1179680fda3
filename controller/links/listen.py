"""A link that waits for a host on a TCP port of this machine: listen://127.0.0.1:PORT."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import selectors
import socket
from urllib.parse import urlsplit

from controller.links import LinkError
from controller.links.stream import StreamLink
from controller.protocol import ProtocolError, Welcome

SEND_BUFFER = 32 * 1024  # bytes: what a host does not read shall wait where it can be dropped
PEERS = 8  # connections at a time; one of them is the host, the others are told so


def create(url: str, welcome: Welcome, token: str) -> ListenLink:
    """Listen at listen://127.0.0.1:PORT; port 0 takes any free one.

    Raises:
        LinkError: The address is not of this machine's own, or the port is taken.
        ProtocolError: The wire cannot carry this Welcome.
    """
    listener = _bind(url)
    try:
        return ListenLink(listener, welcome, token)
    except ProtocolError:
        listener.close()
        raise


class ListenLink(StreamLink):
    """One host at a time, from this machine only.

    Attributes:
        url: Where hosts connect to: socket://127.0.0.1:PORT.
    """

    def __init__(self, listener: socket.socket, welcome: Welcome, token: str) -> None:
        """Take over a listening socket, and begin."""
        super().__init__(welcome, token)
        host, port = listener.getsockname()[:2]
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


def _bind(url: str) -> socket.socket:
    """Return a socket that listens, or say in one sentence why not."""
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        host, port = "", None
    if port is None:
        raise LinkError(f"cannot listen at {url}; write listen://127.0.0.1:PORT, 0 for any port")
    host = "127.0.0.1" if host == "localhost" else host
    if not _is_loopback(host):
        raise LinkError(
            f"will not listen at {url}, where strangers could connect; only addresses of this "
            f"machine's own are allowed: listen://127.0.0.1:{port}"
        )
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=PEERS)
    except OSError as error:
        what = {
            errno.EADDRINUSE: "another program has this port; name another one, or 0 for any",
            errno.EACCES: "ports below 1024 are the system's; name a higher one, or 0 for any",
        }.get(error.errno or 0, f"{error.strerror}; try listen://127.0.0.1:0")
        raise LinkError(f"cannot listen at {url}: {what}") from error


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
