"""Connections to rfcomm://ADDRESS on Linux, also on a Python that was built without Bluetooth.

An orb's service always has the channel `CHANNEL`. With ?local=ADDRESS the connection uses that
adapter.

Such Pythons (uv's, conda's, pyenv's without the right headers) still make the socket; only the
address is beyond them. So Linux's kernel is asked to connect by way of the C library.
"""

from __future__ import annotations

import ctypes
import errno
import os
import re
import select
import socket
import struct
import sys
import tomllib
from importlib.resources import files
from typing import Final

from controller.shared.bluetooth.bluez import CHANNEL
from controller.shared.errors import TroubleError

CONNECT_S: Final = 10.0  # a device that is off is given up after 5 s by most adapters
AF_BLUETOOTH: Final = 31  # Linux, include/linux/socket.h; the next from include/net/bluetooth
RFCOMM: Final = 3
SOL_BLUETOOTH: Final = 274
BT_SECURITY: Final = 4
MEDIUM: Final = 2  # encrypted, with a key from pairing
ADDRESS: Final = re.compile(r"[0-9A-F]{2}(:[0-9A-F]{2}){5}", re.IGNORECASE)
_URL: Final = re.compile(
    rf"rfcomm://(?P<address>{ADDRESS.pattern})/?(\?local=(?P<local>{ADDRESS.pattern}))?",
    re.IGNORECASE,
)


class LinkError(TroubleError, OSError):
    """A link cannot be opened or does not work; the message is one sentence for the user."""


def connect(url: str) -> socket.socket:
    """Return an encrypted connection to a paired orb; LinkError if there is none."""
    address, local = parse(url)
    try:
        return open_channel(address, local)
    except OSError as error:
        raise LinkError(explain(url, address, error)) from error


def parse(url: str) -> tuple[str, str]:
    """Return the addresses of device and adapter ("": any); LinkError if the URL is malformed."""
    match = _URL.fullmatch(url)
    if match is None:
        raise LinkError(
            f"{url} is no Bluetooth address; write rfcomm://00:11:22:33:44:55, as host find lists "
            "it; ?local=00:11:22:33:44:55 (the adapter to use) may follow"
        )
    return match["address"].upper(), match["local"] or ""


def open_channel(address: str, local: str = "") -> socket.socket:
    """Return an encrypted connection to the orb service of a device; OSError if there is none.

    `local` is the address of the adapter to use; "": whichever the system chooses.
    """
    if sys.platform != "linux":  # pairing makes a serial port there
        raise OSError(errno.EAFNOSUPPORT, os.strerror(errno.EAFNOSUPPORT))
    connection = socket.socket(AF_BLUETOOTH, socket.SOCK_STREAM, RFCOMM)
    connection.setsockopt(SOL_BLUETOOTH, BT_SECURITY, bytes([MEDIUM, 0]))
    own = packed(local, 0) if local else b""
    return connected(connection, packed(address, CHANNEL), own)


def packed(address: str, channel: int) -> bytes:
    """Return struct sockaddr_rc: family, address backwards, channel, and a byte to align it."""
    backwards = bytes.fromhex(address.replace(":", ""))[::-1]
    return struct.pack("=H6sBx", AF_BLUETOOTH, backwards, channel)


def connected(connection: socket.socket, address: bytes, own: bytes = b"") -> socket.socket:
    """Return a socket when it has connected to a packed address; close it if it cannot."""
    connection.setblocking(False)
    library = ctypes.CDLL(None, use_errno=True)
    try:
        file, number = connection.fileno(), 0
        bound = not own or library.bind(file, own, len(own)) == 0
        if not bound or library.connect(file, address, len(address)):
            number = ctypes.get_errno()
        if number in (errno.EINPROGRESS, errno.EAGAIN):
            waited = select.select([], [connection], [], CONNECT_S)[1]
            error = connection.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            number = error if waited else errno.ETIMEDOUT
        if number:
            raise OSError(number, os.strerror(number))
    except BaseException:
        connection.close()
        raise
    return connection


def explain(url: str, address: str, error: OSError) -> str:
    """Return why there is no connection, and what to do, in one sentence."""
    reason = _REASONS.get(error.errno or 0)
    if reason is None:
        return f"cannot open {url}: {error.strerror or error}; see orbtouch docs bluetooth"
    return reason.format(address=address)


_REASONS: Final = {
    getattr(errno, name): words
    for words, names in tomllib.loads(
        (files(__package__) / "rfcomm.toml").read_text("utf-8")
    ).items()
    for name in names
}
