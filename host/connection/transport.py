"""Transport of bytes to and from a port: four methods that suit one thread.

A port with a file descriptor is waited for in `select`; any other, as on Windows, is polled. Every
error is one sentence.
"""

from __future__ import annotations

import contextlib
import errno
import io
import select
import socket
import threading
from typing import Any

from controller.shared import ports
from host.connection import rfcomm
from host.connection.rfcomm import LinkError as LinkError

CHUNK = 16 * 1024  # bytes per read
BACKLOG = 64 * 1024  # bytes that may wait for a device; one that takes no more is gone


def open_transport(url: str) -> Transport:
    """Open a port by its name (/dev/ttyACM0, COM3), or by a URL; LinkError says why not.

    URLs are rfcomm://ADDRESS, socket://ADDRESS:PORT, and others that pyserial knows.
    """
    try:
        port = rfcomm.connect(url) if url.startswith("rfcomm:") else ports.open_port(url)
    except LinkError:
        raise
    except Exception as error:  # pyserial lets many kinds through, termios.error among them
        why = ports.why(error, url)
        raise LinkError(f"cannot open {url}: {why}; name another with --link") from error
    if isinstance(port, socket.socket):
        return _Selected(port, url)
    try:
        return _Selected(ports.SerialStream(port), url)
    except io.UnsupportedOperation:
        return _Polled(port, url)


class _Selected:
    """A port that `select` can wait for: every port but those of Windows and a few URLs."""

    def __init__(self, port: ports.Stream, name: str) -> None:
        self.name = name
        self._port = port
        self._lock = threading.Lock()  # guards the backlog, and with it the order of bytes
        self._backlog = bytearray()
        self._bell, self._button = socket.socketpair()
        self._bell.setblocking(False)
        self._button.setblocking(False)

    def read(self, timeout_s: float) -> bytes:
        """Return what has come; b"" after the timeout or `wake`."""
        writers = [self._port] if self._backlog else []
        readable, writable, _ = select.select(
            [self._port, self._bell], writers, [], max(timeout_s, 0.0)
        )
        if writable:
            with self._lock:
                self._flush()
        if self._bell in readable:
            self._bell.recv(CHUNK)
        if self._port not in readable:
            return b""
        try:
            data = self._port.recv(CHUNK)
        except BlockingIOError:  # another reader was faster
            return b""
        if not data:
            raise ConnectionResetError(errno.ECONNRESET, "the other end closed it")
        return data

    def write(self, data: bytes) -> None:
        """Send what fits now, keep the rest for `read` to send."""
        with self._lock:
            self._backlog += data
            self._flush()
            waiting = len(self._backlog)
        if waiting > BACKLOG:
            raise LinkError(f"{self.name} takes no more bytes")
        if waiting:
            self.wake()

    def _flush(self) -> None:
        while self._backlog:
            try:
                sent = self._port.send(bytes(self._backlog[:CHUNK]))
            except BlockingIOError:
                return
            del self._backlog[:sent]

    def wake(self) -> None:
        """Let a waiting `read` return."""
        with contextlib.suppress(OSError):  # full, it rings already; or just closed
            self._button.send(b"!")

    def close(self) -> None:
        """Let go of the port."""
        with self._lock:
            self._port.close()
            self._bell.close()
            self._button.close()


class _Polled:
    """A port that has no file descriptor: it is read with short blocking reads."""

    _READ_S = 0.02  # how long `wake` may go unnoticed

    def __init__(self, port: Any, name: str) -> None:
        self.name = name
        self._port = port
        port.timeout, port.write_timeout = self._READ_S, 0.5

    def read(self, timeout_s: float) -> bytes:
        """Return what has come within one short read, or `timeout_s` if that is nothing."""
        if timeout_s <= 0.0 and not self._port.in_waiting:
            return b""
        first = bytes(self._port.read(1))
        waiting = self._port.in_waiting if first else 0
        return first + bytes(self._port.read(waiting)) if waiting else first

    def write(self, data: bytes) -> None:
        """Send; half a second is the longest that this can take."""
        self._port.write(data)

    def wake(self) -> None:
        """`read` returns soon enough."""

    def close(self) -> None:
        """Let go of the port."""
        self._port.close()


Transport = _Selected | _Polled
"""An open port, by the name that the user calls it. OSError: it has gone. One thread reads."""
