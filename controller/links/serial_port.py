"""Link over a serial port: its name, a pty, or a pyserial URL whose port `select` supports."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import socket
from typing import Any
from urllib.parse import urlsplit

import serial

from controller.links.base import Access, LinkAwayError, LinkError
from controller.links.byte_link import StreamLink
from controller.protocol.messages import Welcome

BAUD = 115_200  # for a real serial line; Bluetooth, USB and pty ports ignore it
RETRY_MS = 500  # between two attempts to open a lost port

log = logging.getLogger(__name__)


def create(url: str, welcome: Welcome, access: Access) -> PortLink:
    """Open a port.

    Raises:
        LinkError: It does not exist, is taken, is not allowed, or is no port.
    """
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
            self._attach(_PortStream(url))
        except Exception as error:  # pyserial raises many kinds, such as termios.error
            self._shut()
            # pyserial raises ValueError for a malformed URL
            kind = LinkError if isinstance(error, ValueError) else LinkAwayError
            raise kind(f"cannot open {url}: {_why(error)}; name another with --link") from error
        self.start()

    def _tick(self, now_ms: int) -> None:
        super()._tick(now_ms)
        if not self._peers and now_ms >= self._retry_ms:
            self._retry_ms = now_ms + RETRY_MS
            with contextlib.suppress(Exception):  # still missing
                self._attach(_PortStream(self._url))
                log.info("port %s is back", self._url)


def _why(error: BaseException) -> str:
    """Return the system's reason for an error that pyserial wraps, sometimes twice."""
    inner: BaseException | None = error
    while inner is not None:
        number = getattr(inner, "errno", None) or (inner.args[0] if inner.args else None)
        if isinstance(number, int):
            return _WORDS.get(number) or os.strerror(number).lower()
        inner = inner.__cause__ or inner.__context__
    return " ".join(str(error).split())


_WORDS = {
    errno.ENOENT: "there is no such port",
    errno.EAGAIN: "another program uses it",  # the lock of exclusive=True
    errno.EBUSY: "another program uses it",
    errno.EACCES: "you may not; join the group that owns it (often dialout)",
    errno.ENOTTY: "it is not a serial port",
    errno.EISDIR: "it is not a serial port",
}


def _check_address(url: str) -> None:
    """Raise ValueError unless a socket's URL has an address and a port."""
    with contextlib.suppress(ValueError):
        parts = urlsplit(url)
        if parts.hostname and parts.port:
            return
    raise ValueError("expected is socket://ADDRESS:PORT")


class _PortStream:
    """A pyserial port, read and written directly: pyserial's own methods may block."""

    def __init__(self, url: str) -> None:
        if url.startswith("socket:"):
            _check_address(url)
        self._port: Any = serial.serial_for_url(
            url, baudrate=BAUD, timeout=0, write_timeout=0, exclusive=True
        )
        try:
            self._fd: int = self._port.fileno()
        except OSError as error:
            self._port.close()
            raise OSError("select cannot wait for such a port here") from error
        os.set_blocking(self._fd, False)
        if url.startswith("socket:"):
            with socket.socket(fileno=os.dup(self._fd)) as connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def fileno(self) -> int:
        return self._fd

    def recv(self, size: int, /) -> bytes:
        return os.read(self._fd, size)

    def send(self, data: bytes, /) -> int:
        return os.write(self._fd, data)

    def close(self) -> None:
        self._port.close()
