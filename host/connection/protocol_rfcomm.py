"""rfcomm://ADDRESS for pyserial, which finds this file by its name: docs/bluetooth.md.

`serial.protocol_handler_packages.append("host.connection")` makes pyserial look here.
"""

from __future__ import annotations

from serial.serialutil import SerialException
from serial.urlhandler import protocol_socket

from host.connection import rfcomm


class Serial(protocol_socket.Serial):  # type: ignore[misc]  # pyserial is not typed
    """pyserial's socket://, over another kind of socket, and without its sleep at close."""

    def open(self) -> None:
        """Connect, or raise SerialException, which says why not."""
        self.logger = None
        try:
            self._socket = rfcomm.connect(str(self.portstr))
        except rfcomm.LinkError as error:
            raise SerialException(str(error)) from error
        self.is_open = True

    def close(self) -> None:
        """Close at once, also if the other end was faster."""
        if self.is_open:
            self.is_open = False
            self._socket.close()
