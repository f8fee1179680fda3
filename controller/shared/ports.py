"""Ports of both ends of a link: opened by name or URL, never blocking, with errors in words."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import socket
import tomllib
from functools import partial
from importlib.resources import files
from typing import Any, Final
from urllib.parse import urlsplit

import serial

BAUD: Final = 115_200  # for a real serial line; Bluetooth, USB, ptys and TCP ignore it
OPEN_S: Final = 3.0  # until a TCP connection counts as refused


class SerialStream:
    """A pyserial port, read and written directly: pyserial's own methods may block."""

    def __init__(self, port: Any) -> None:
        """Take over an open port; io.UnsupportedOperation if it has no file descriptor."""
        number: int = port.fileno()
        os.set_blocking(number, False)
        self.fileno, self.close = port.fileno, port.close
        self.recv, self.send = partial(os.read, number), partial(os.write, number)


Stream = socket.socket | SerialStream
"""A byte stream that raises BlockingIOError in place of waiting, and OSError when it is lost."""


def open_port(url: str, baud: int = BAUD) -> Any:
    """Return a socket for socket://ADDRESS:PORT, else pyserial's port of a name or URL.

    It raises errors of many kinds, such as termios.error; `why` has words for all of them.
    """
    if url.startswith("socket:"):
        return _connect(url)
    return serial.serial_for_url(url, baudrate=baud, timeout=0, write_timeout=0, exclusive=True)


def _connect(url: str) -> socket.socket:
    address = None
    with contextlib.suppress(ValueError):
        parts = urlsplit(url)
        if parts.hostname and parts.port:
            address = parts.hostname, parts.port
    if address is None:
        raise ValueError("expected is socket://ADDRESS:PORT")
    connection = socket.create_connection(address, timeout=OPEN_S)
    if connection.getsockname() == connection.getpeername():
        # A connection to a free port of this machine can, by chance, end in itself.
        connection.close()
        raise ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused")
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setblocking(False)
    return connection


def why(error: BaseException, name: str = "") -> str:
    """Return why a port cannot be opened, from the first known number of an error or its causes.

    The name of the port is looked at only for an address that lacks its scheme.

    pyserial wraps errors, sometimes twice; the number of termios.error is its first argument.
    """
    if re.fullmatch(r"[\w.-]+:\d{1,5}|\[[0-9a-fA-F:.]+\]:\d{1,5}", name):
        return f"an address in a network is written socket://{name}"
    inner: BaseException | None = error
    while inner is not None:
        number = getattr(inner, "errno", None) or (inner.args[0] if inner.args else None)
        if isinstance(number, int) and number > 0:  # those of unknown names are negative
            return _WORDS.get(number) or os.strerror(number).lower()
        inner = inner.__cause__ or inner.__context__
    text = " ".join(str(error).split())
    return next((words for part, words in _SENTENCES["texts"].items() if part in text), text)


_SENTENCES: Final = tomllib.loads((files(__package__) / "ports.toml").read_text("utf-8"))
_WORDS: Final = {
    getattr(errno, name): words for words, names in _SENTENCES["errors"].items() for name in names
}
