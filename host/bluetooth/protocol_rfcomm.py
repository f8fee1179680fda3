"""rfcomm://ADDRESS[:CHANNEL] for pyserial, which finds this file by its name.

`serial.protocol_handler_packages.append("host.bluetooth")` makes pyserial look here. Unlike with
/dev/rfcomm0, that opens in 10 ms with nobody there, an open port is a connection here. Options go
behind a question mark: local=ADDRESS (of the adapter to use), connect_timeout=SECONDS.
"""

from __future__ import annotations

import errno
import re
import socket
import sys
from typing import Final
from urllib.parse import parse_qsl

from serial.serialutil import SerialException

from controller.links.bluetooth.identifiers import CHANNEL, SERVICE_UUID
from host.bluetooth import sdp, sockets
from host.connection.transport import LinkError, SocketPort

CONNECT_S: Final = 10.0  # a device that is off is given up after 5 s by most adapters
_URL: Final = re.compile(
    r"rfcomm://(?P<address>[0-9A-F:]{17})(:(?P<channel>\d{1,2}))?/?(\?(?P<options>.*))?",
    re.IGNORECASE,
)


class RfcommError(SerialException, LinkError):  # type: ignore[misc]  # pyserial is not typed
    """The port cannot be opened; one sentence says why and what to do."""


class Serial(SocketPort):
    """pyserial's socket://, over another kind of socket."""

    def _connect(self) -> socket.socket:
        """Return the connection, or raise RfcommError if nothing answers."""
        url = str(self.portstr)
        address, channel, options = parse(url)
        local = options.get("local", "")
        try:
            if channel is None:
                channel = _channel(url, address, local)
            seconds = float(options.get("connect_timeout", CONNECT_S))
            return sockets.rfcomm(address, channel, seconds, local)
        except RfcommError:
            raise
        except OSError as error:
            raise RfcommError(explain(url, address, error)) from error


def parse(url: str) -> tuple[str, int | None, dict[str, str]]:
    """Return address, channel (None: to be looked up) and options of a URL.

    Raises:
        RfcommError: It is not one of ours.
    """
    match = _URL.fullmatch(url)
    if match is None or not sockets.ADDRESS.fullmatch(match["address"]):
        raise RfcommError(
            f"{url} is no Bluetooth address; write rfcomm://00:11:22:33:44:55, as host pair says it"
        )
    channel = None if match["channel"] is None else int(match["channel"])
    if channel is not None and not 1 <= channel <= 30:
        raise RfcommError(f"{url} names channel {channel}, but there are 1 to 30; leave it out")
    options = dict(parse_qsl(match["options"] or ""))
    unknown = sorted(set(options) - {"local", "connect_timeout"})
    if unknown:
        raise RfcommError(f"{url} has an option {unknown[0]}; there are local and connect_timeout")
    try:
        float(options.get("connect_timeout", 1))
    except ValueError:
        raise RfcommError(f"{url}: connect_timeout is a number of seconds") from None
    if "local" in options and not sockets.ADDRESS.fullmatch(options["local"]):
        raise RfcommError(f"{url}: local is an adapter's address, such as 00:11:22:33:44:55")
    return match["address"].upper(), channel, options


def _channel(url: str, address: str, local: str) -> int:
    """Look up the service's channel on the device."""
    if sys.platform != "linux":
        return CHANNEL  # other systems let no program ask; ours always takes this one
    found = sdp.channel(address, SERVICE_UUID, local)
    if found is None:
        raise RfcommError(
            f"{address} answers, but is no orb that waits for a host; start it there: "
            "controller --link rfcomm:"
        )
    return found


def explain(url: str, address: str, error: OSError) -> str:
    """Return why there is no connection, and what to do, in one sentence."""
    reason = _REASONS.get(error.errno or 0)
    if reason is None:
        return f"cannot open {url}: {error.strerror or error}; see docs/bluetooth.md"
    return reason.format(url=url, address=address)


_AWAY: Final = "{address} does not answer; is the orb on, near, and not connected elsewhere?"
_UNPAIRED: Final = "{address} refuses this computer; pair first: host pair {address}"
_NO_SOCKETS: Final = (
    "this system has no Bluetooth sockets; open the serial port that pairing made: COM5, "
    "/dev/cu.OrbTouch (docs/bluetooth.md)"
)
_REASONS: Final = {
    errno.EHOSTDOWN: _AWAY,
    errno.ETIMEDOUT: _AWAY,
    errno.EHOSTUNREACH: "there is no Bluetooth adapter, or it is off; bluetoothctl power on",
    errno.ENETDOWN: "the Bluetooth adapter is off; bluetoothctl power on",
    errno.ENODEV: "there is no Bluetooth adapter, or it is off; bluetoothctl power on",
    errno.ECONNREFUSED: (
        "{address} refuses the connection; if the orb runs (controller --link rfcomm:), it may "
        "not know this computer: host pair {address}"
    ),
    errno.EACCES: _UNPAIRED,
    errno.EPERM: _UNPAIRED,
    errno.ECONNRESET: _UNPAIRED,
    errno.EBUSY: "{address} is being connected already; wait a moment, or close the other program",
    errno.EAFNOSUPPORT: _NO_SOCKETS,
    errno.EPROTONOSUPPORT: _NO_SOCKETS,
}
