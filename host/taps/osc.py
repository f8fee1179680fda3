"""Open Sound Control tap: one UDP message for each event."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from controller.shared.errors import how_to_install
from controller.shared.protocol.codec import image_from_bytes
from controller.shared.protocol.messages import Command, ContactState, Telemetry, Welcome
from host.taps import CONTACT, Tap, TapError, TapUnavailableError

if TYPE_CHECKING:
    from pythonosc.udp_client import SimpleUDPClient

DEFAULT: Final = "127.0.0.1:9000"
DESCRIBE_S: Final = 2.0  # between two descriptions, for programs that start later


class OscTap(Tap):
    """Messages below /orbtouch; docs/taps.md has the table."""

    def __init__(
        self, client: SimpleUDPClient, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._client, self._clock = client, clock
        self._welcome: Welcome | None = None
        self._described_s = -DESCRIBE_S

    def connected(self, welcome: Welcome) -> None:
        """Describe the device."""
        self._welcome = welcome
        self._describe()

    def telemetry(self, message: Telemetry, t_ms: int) -> None:
        """Send the frame and the probabilities."""
        if self._clock() - self._described_s >= DESCRIBE_S:
            self._describe()
        self._send("frame", message.frame, t_ms / 1000, *image_from_bytes(message.image))
        self._send("probabilities", message.frame, t_ms / 1000, *message.probabilities)

    def gesture(self, label: str, t_ms: int) -> None:
        """Send the gesture that is held, "" for none."""
        self._send("gesture", label, t_ms / 1000)

    def command(self, message: Command, t_ms: int) -> None:
        """Send a command, with its position if it has one."""
        place = message.touch or ()
        self._send("command", message.name, message.label, t_ms / 1000, message.probability, *place)

    def contact(self, message: ContactState, t_ms: int) -> None:
        """Send what touches."""
        values = (getattr(message, name) for name in CONTACT)
        self._send("contact", message.frame, t_ms / 1000, *values)

    def missed(self, count: int) -> None:
        """Send the number of lost commands."""
        self._send("missed", count)

    def link(self, state: str) -> None:
        """Send the state of the link."""
        self._send("link", state)

    def close(self) -> None:
        """Close the socket."""
        self._client.close()

    def _describe(self) -> None:
        if (device := self._welcome) is None:
            return
        self._described_s = self._clock()
        self._send(
            *("device", device.device_id, device.name, device.rows, device.columns),
            *(device.pitch_mm, device.rate_hz, int(device.virtual)),
        )
        self._send("labels", *device.labels)
        self._send("commands", *device.commands)

    def _send(self, address: str, *values: str | float) -> None:
        with contextlib.suppress(OSError):  # the buffer is full, or the network is gone
            self._client.send_message(f"/orbtouch/{address}", values)


def create(where: str) -> OscTap:
    """Send to HOST:PORT, 127.0.0.1:9000 if it is left out."""
    try:
        parts = urlsplit(f"//{where or DEFAULT}")
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if not host or not port or parts.path:
        raise TapError(f"--tap osc://{where} is no address; write osc://{DEFAULT}")
    try:
        from pythonosc.udp_client import SimpleUDPClient
    except ModuleNotFoundError:
        raise TapUnavailableError(f"--tap osc needs python-osc; {how_to_install('osc')}") from None
    try:
        # The numeric address, since the client would resolve a name for every message.
        address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0][4][0]
    except OSError as error:
        raise TapUnavailableError(
            f"--tap osc://{where}: {host} is not known ({error.strerror})"
        ) from error
    return OscTap(SimpleUDPClient(str(address), port))
