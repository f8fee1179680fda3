"""Bluetooth sockets that connect, also on a Python that was built without Bluetooth.

Such Pythons (uv's, conda's, pyenv's without the right headers) still make the socket: only the
address is beyond them. So the kernel is asked to connect by way of the C library.
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

AF_BLUETOOTH: Final = 31  # Linux, include/linux/socket.h; the next from include/net/bluetooth
L2CAP, RFCOMM = 0, 3
SOL_BLUETOOTH: Final = 274
BT_SECURITY: Final = 4
MEDIUM: Final = 2  # encrypted, with a key from pairing
ADDRESS: Final = re.compile(r"[0-9A-F]{2}(:[0-9A-F]{2}){5}", re.IGNORECASE)


def rfcomm(address: str, channel: int, timeout_s: float, local: str = "") -> socket.socket:
    """Return an encrypted connection to an RFCOMM channel of a device.

    Args:
        address: The device's, such as "00:11:22:33:44:55".
        channel: 1 to 30.
        timeout_s: How long to try.
        local: The address of the adapter to use; "": whichever the system chooses.

    Raises:
        OSError: There is no connection; its errno says why.
    """
    if sys.platform == "linux":
        connection = socket.socket(AF_BLUETOOTH, socket.SOCK_STREAM, RFCOMM)
        connection.setsockopt(SOL_BLUETOOTH, BT_SECURITY, bytes([MEDIUM, 0]))
        own = rfcomm_address(local, 0) if local else b""
        return _connected(connection, rfcomm_address(address, channel), own, timeout_s)
    family = getattr(socket, "AF_BLUETOOTH", None)
    if family is None:
        raise OSError(errno.EAFNOSUPPORT, "this system's Python has no Bluetooth sockets")
    connection = socket.socket(family, socket.SOCK_STREAM, socket.BTPROTO_RFCOMM)
    try:
        connection.settimeout(timeout_s)
        connection.connect((address, channel))
    except BaseException:
        connection.close()
        raise
    return connection


def l2cap(address: str, psm: int, timeout_s: float, local: str = "") -> socket.socket:
    """Return a connection to an L2CAP service of a device; Linux only.

    Raises:
        OSError: There is no connection; its errno says why.
    """
    connection = socket.socket(AF_BLUETOOTH, socket.SOCK_SEQPACKET, L2CAP)
    own = l2cap_address(local, 0) if local else b""
    return _connected(connection, l2cap_address(address, psm), own, timeout_s)


def rfcomm_address(address: str, channel: int) -> bytes:
    """Return struct sockaddr_rc: family, address backwards, channel, and a byte to align it."""
    return struct.pack("=H6sBx", AF_BLUETOOTH, _backwards(address), channel)


def l2cap_address(address: str, psm: int) -> bytes:
    """Return struct sockaddr_l2: family, PSM, address backwards, channel and kind (0), aligned."""
    return struct.pack("=H2s6sHBx", AF_BLUETOOTH, struct.pack("<H", psm), _backwards(address), 0, 0)


def _backwards(address: str) -> bytes:
    return bytes.fromhex(address.replace(":", ""))[::-1]


def _connected(
    connection: socket.socket, address: bytes, own: bytes, timeout_s: float
) -> socket.socket:
    """Return a socket when it has connected; close it if it cannot."""
    try:
        if own:
            _call("bind", connection, own)
        connection.setblocking(False)
        try:
            _call("connect", connection, address)
        except BlockingIOError:
            if not select.select([], [connection], [], timeout_s)[1]:
                raise TimeoutError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT)) from None
            number = connection.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if number:
                raise OSError(number, os.strerror(number)) from None
        connection.setblocking(True)
    except BaseException:
        connection.close()
        raise
    return connection


def _call(name: str, connection: socket.socket, address: bytes) -> None:
    """Call bind or connect of the C library with a packed address."""
    library = ctypes.CDLL(None, use_errno=True)
    if getattr(library, name)(connection.fileno(), address, len(address)):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
