"""Connections to rfcomm://ADDRESS[:CHANNEL], also on a Python that was built without Bluetooth.

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
from typing import Final

from controller.errors import TroubleError
from controller.links.bluetooth.bluez import CHANNEL

CONNECT_S: Final = 10.0  # a device that is off is given up after 5 s by most adapters
AF_BLUETOOTH: Final = 31  # Linux, include/linux/socket.h; the next from include/net/bluetooth
RFCOMM: Final = 3
SOL_BLUETOOTH: Final = 274
BT_SECURITY: Final = 4
MEDIUM: Final = 2  # encrypted, with a key from pairing
ADDRESS: Final = re.compile(r"[0-9A-F]{2}(:[0-9A-F]{2}){5}", re.IGNORECASE)
_URL: Final = re.compile(rf"rfcomm://({ADDRESS.pattern})(:(?P<channel>\d+))?/?", re.IGNORECASE)


class LinkError(TroubleError, OSError):
    """A link cannot be opened or does not work; the message is one sentence for the user."""


def connect(url: str) -> socket.socket:
    """Return an encrypted connection to a paired orb; LinkError if there is none."""
    address, channel = parse(url)
    try:
        return open_channel(address, channel)
    except OSError as error:
        raise LinkError(explain(url, address, error)) from error


def parse(url: str) -> tuple[str, int]:
    """Return address and channel of a URL; LinkError if it is not one of ours."""
    match = _URL.fullmatch(url)
    channel = int(match["channel"] or CHANNEL) if match else 0
    if match is None or not 1 <= channel <= 30:
        raise LinkError(
            f"{url} is no Bluetooth address; write rfcomm://00:11:22:33:44:55, as host pair says "
            "it; a channel from 1 to 30 may follow"
        )
    return match[1].upper(), channel


def open_channel(address: str, channel: int) -> socket.socket:
    """Return an encrypted connection to an RFCOMM channel of a device; OSError if there is none."""
    if sys.platform != "linux":
        raise OSError(errno.EAFNOSUPPORT, "not Linux")
    connection = socket.socket(AF_BLUETOOTH, socket.SOCK_STREAM, RFCOMM)
    connection.setsockopt(SOL_BLUETOOTH, BT_SECURITY, bytes([MEDIUM, 0]))
    return connected(connection, packed(address, channel))


def packed(address: str, channel: int) -> bytes:
    """Return struct sockaddr_rc: family, address backwards, channel, and a byte to align it."""
    backwards = bytes.fromhex(address.replace(":", ""))[::-1]
    return struct.pack("=H6sBx", AF_BLUETOOTH, backwards, channel)


def connected(
    connection: socket.socket, address: bytes, timeout_s: float = CONNECT_S
) -> socket.socket:
    """Return a socket when it has connected to a packed address; close it if it cannot."""
    connection.setblocking(False)
    library = ctypes.CDLL(None, use_errno=True)
    try:
        number = 0
        if library.connect(connection.fileno(), address, len(address)):
            number = ctypes.get_errno()
        if number in (errno.EINPROGRESS, errno.EAGAIN):
            waited = select.select([], [connection], [], timeout_s)[1]
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
        return f"cannot open {url}: {error.strerror or error}; see docs/bluetooth.md"
    return reason.format(address=address)


_AWAY: Final = "{address} does not answer; is the orb on, near, and not connected elsewhere?"
_OFF: Final = "there is no Bluetooth adapter, or it is off; bluetoothctl power on"
_UNPAIRED: Final = "{address} refuses this computer; pair first: host pair {address}"
_NO_SOCKETS: Final = (
    "this system has no Bluetooth sockets; open the serial port that pairing made: COM5, "
    "/dev/cu.OrbTouch (docs/bluetooth.md)"
)
_REASONS: Final = {
    errno.EHOSTDOWN: _AWAY,
    errno.ETIMEDOUT: _AWAY,
    errno.EHOSTUNREACH: _OFF,
    errno.ENETDOWN: _OFF,
    errno.ENODEV: _OFF,
    errno.ECONNREFUSED: (
        "{address} refuses the connection; start the orb: controller --link rfcomm:; if it runs, "
        "it may not know this computer: host pair {address}"
    ),
    errno.EACCES: _UNPAIRED,
    errno.EPERM: _UNPAIRED,
    errno.ECONNRESET: _UNPAIRED,
    errno.EBUSY: "{address} is being connected already; wait a moment, or close the other program",
    errno.EAFNOSUPPORT: _NO_SOCKETS,
    errno.EPROTONOSUPPORT: _NO_SOCKETS,
}
