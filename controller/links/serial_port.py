"""Link over a serial port: its name, a pty, or a pyserial URL whose port `select` supports."""

from __future__ import annotations

import contextlib
import io
import logging
import socket

from controller.links.base import Access, LinkAwayError, LinkError
from controller.links.byte_link import StreamLink
from controller.shared import ports
from controller.shared.protocol.messages import Welcome

RETRY_MS = 500  # between two attempts to open a lost port

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: Access) -> PortLink:
    """Open a port; LinkError if it does not exist, is taken, is not allowed, or is no port."""
    return PortLink(url, welcome, access)


class PortLink(StreamLink):
    """Link to the peer at the other end of a serial line; a lost port is opened again."""

    patient = True  # the port is open before a host begins a session

    def __init__(self, url: str, welcome: Welcome, access: Access) -> None:
        """Open the port, and start."""
        super().__init__(welcome, access)
        self._url = url
        self._retry_ms = 0
        try:
            self._attach(_open(url))
        except Exception as error:  # pyserial raises many kinds, such as termios.error
            self._shut()
            # pyserial raises ValueError for a malformed URL
            kind = LinkError if isinstance(error, ValueError) else LinkAwayError
            why = ports.why(error, url)
            raise kind(f"cannot open {url}: {why}; name another with --link") from error
        self.start()

    def _tick(self, now_ms: int) -> None:
        super()._tick(now_ms)
        if not self._peers and now_ms >= self._retry_ms:
            self._retry_ms = now_ms + RETRY_MS
            with contextlib.suppress(Exception):  # still missing
                self._attach(_open(self._url))
                log.info("port %s is back", self._url)


def _open(url: str) -> ports.Stream:
    port = ports.open_port(url)
    if isinstance(port, socket.socket):
        return port
    try:
        return ports.SerialStream(port)
    except io.UnsupportedOperation as error:
        port.close()
        raise OSError("select cannot wait for such a port here") from error
