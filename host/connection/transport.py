"""Transport of bytes to and from a port: pyserial behind four methods that suit one thread.

pyserial opens everything, but waits in its own ways: its methods block, its socket:// sleeps 0.3 s
when it is closed, leaks the socket if the peer was faster, and forgets error numbers. What is here
waits in `select` where the port has a file descriptor, and says every error in one sentence.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import select
import socket
import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol
from urllib.parse import urlsplit

import serial
from serial.urlhandler import protocol_socket

from controller.errors import TroubleError

serial.protocol_handler_packages.append("host.bluetooth")  # for rfcomm://

BAUD = 115_200  # for a real serial line; Bluetooth, USB and TCP ignore it
OPEN_S = 3.0  # until a TCP connection counts as refused
CHUNK = 16 * 1024  # bytes per read
BACKLOG = 64 * 1024  # bytes that may wait for a device; one that takes no more is gone


class LinkError(TroubleError, OSError):
    """A link cannot be opened or does not work; the message is one sentence for the user."""


class Transport(Protocol):
    """An open port. One thread reads; any may write.

    Attributes:
        name: What the user calls it.
    """

    name: str

    def read(self, timeout_s: float) -> bytes:
        """Return what has come, as soon as something has; b"" after the timeout or `wake`.

        Raises:
            OSError: The port has gone.
        """

    def write(self, data: bytes) -> None:
        """Send, without waiting; what does not fit now is sent while `read` waits.

        Raises:
            OSError: The port has gone, or takes nothing any more.
        """

    def wake(self) -> None:
        """Let a waiting `read` return."""

    def close(self) -> None:
        """Let go of the port. The reading thread calls this."""


def open_transport(url: str) -> Transport:
    """Open a port by its name (/dev/ttyACM0, COM3), or by a URL.

    URLs are rfcomm://ADDRESS and what pyserial knows, such as socket://127.0.0.1:4000.

    Raises:
        LinkError: It cannot be opened; one sentence says why.
    """
    make = SocketPort if url.startswith("socket://") else serial.serial_for_url
    try:
        port = make(url, baudrate=BAUD, timeout=0, write_timeout=0, exclusive=True)
    except LinkError:
        raise
    except Exception as error:  # pyserial lets many kinds through, termios.error among them
        raise LinkError(explain(url, error)) from error
    try:
        port.fileno()
    except io.UnsupportedOperation:
        return _Polled(port, url)
    return _Selected(port, url)


def explain(url: str, error: BaseException) -> str:
    """Return why a port cannot be opened, and what to do, in one sentence.

    Args:
        url: The port, as the user named it.
        error: What pyserial or the operating system raised.
    """
    for number in _numbers(error):
        if number in _SENTENCES:
            return _SENTENCES[number].format(url=url)
    text = str(error)
    for part, number in _WINDOWS:
        if part in text:
            return _SENTENCES[number].format(url=url)
    return f"cannot open {url}: {' '.join(text.split())}; name another port with --link"


_NONE = "there is no port {url}; plug in or pair the orb, or name another port with --link"
_BUSY = "{url} is in use by another program; close that one first"
_DENIED = (
    "no permission to open {url}; join the group that owns it (often dialout), and log in again"
)
_NO_PORT = "{url} is not a serial port; name the one that the orb is behind with --link"
_DEAD = "{url} exists, but no device is behind it; switch the orb on, or plug it in again"
_NOBODY = "nothing listens at {url}; start the orb there first: controller --link listen://..."
_FAR = "{url} does not answer; check the address, and that the orb is on"
_SENTENCES = {
    errno.ENOENT: _NONE,
    errno.EBUSY: _BUSY,
    errno.EAGAIN: _BUSY,  # the lock of exclusive=True
    errno.EACCES: _DENIED,
    errno.EPERM: _DENIED,
    errno.ENOTTY: _NO_PORT,
    errno.EINVAL: _NO_PORT,
    errno.EISDIR: _NO_PORT,
    errno.ENOTDIR: _NONE,
    errno.ENXIO: _DEAD,
    errno.ENODEV: _DEAD,
    errno.EIO: _DEAD,
    errno.ECONNREFUSED: _NOBODY,
    errno.ETIMEDOUT: _FAR,
    errno.EHOSTUNREACH: _FAR,
    errno.ENETUNREACH: _FAR,
    errno.EHOSTDOWN: _FAR,
}
# On Windows pyserial wraps the error in text, and a port in use is "access denied".
_WINDOWS = (
    ("FileNotFoundError", errno.ENOENT),
    ("PermissionError", errno.EBUSY),
    ("timed out", errno.ETIMEDOUT),
)


def _numbers(error: BaseException | None) -> list[int]:
    """Return the error numbers of an error and of what caused it, outermost first.

    pyserial often wraps an error in one without a number; termios.error is no OSError at all, its
    number is its first argument.
    """
    numbers = []
    while error is not None:
        first = getattr(error, "errno", None) or (error.args[0] if error.args else None)
        if isinstance(first, int):
            numbers.append(first)
        error = error.__cause__ or error.__context__
    return numbers


def _address(url: str) -> tuple[str, int]:
    """Return host and port of a socket's URL, or raise ValueError: pyserial only stumbles."""
    with contextlib.suppress(ValueError):
        parts = urlsplit(url)
        if parts.hostname and parts.port:
            return parts.hostname, parts.port
    raise ValueError("expected is socket://ADDRESS:PORT")


class SocketPort(protocol_socket.Serial):  # type: ignore[misc]  # pyserial is not typed
    """pyserial's socket:// without delays: no Nagle, no sleep at close, and it always closes."""

    def open(self) -> None:
        """Connect; the port never waits afterwards."""
        self.logger = None
        self._socket = self._connect()
        self._socket.setblocking(False)
        self.is_open = True

    def _connect(self) -> socket.socket:
        connection = socket.create_connection(_address(self.portstr), timeout=OPEN_S)
        if connection.getsockname() == connection.getpeername():
            # A connection to a free port of this machine can, by chance, end in itself.
            connection.close()
            raise ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused")
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return connection

    @property
    def connection(self) -> socket.socket:
        """The socket itself."""
        connection: socket.socket = self._socket
        return connection

    def close(self) -> None:
        """Close at once, also if the other end was faster."""
        if self.is_open:
            self.is_open = False
            self._socket.close()


def _direct(port: Any) -> tuple[Callable[[int], bytes], Callable[[bytes], int]]:
    """Return what reads from a port that is ready, and what writes what fits now.

    pyserial's own methods ask the system again whether it is ready, which costs more than reading;
    where they do more than that, as in spy://, they are kept.
    """
    if isinstance(port, SocketPort):
        return port.connection.recv, port.connection.send
    if os.name == "posix" and type(port) is serial.Serial:
        number: int = port.fileno()
        os.set_blocking(number, False)
        return partial(os.read, number), partial(os.write, number)

    def send(data: bytes) -> int:
        if not select.select([], [port], [], 0)[1]:  # pyserial spins when nothing fits
            raise BlockingIOError
        return int(port.write(data))

    return port.read, send


class _Selected:
    """A port that `select` can wait for: every port but those of Windows and a few URLs."""

    def __init__(self, port: Any, name: str) -> None:
        self.name = name
        self._port = port
        self._receive, self._send = _direct(port)
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
            data = self._receive(CHUNK)
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
                sent = self._send(bytes(self._backlog[:CHUNK]))
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
