"""The link: a host is played on this very machine, and the answer's time is taken."""

import socket
import time
from typing import Final

from controller.diagnostics.report import Row, Verdict
from controller.links import LinkError, open_link
from controller.protocol.messages import DEADMAN_MS, HEARTBEAT_MS, VERSION, Hello, Offer, Welcome
from controller.protocol.packets import Decoder, encode

_ANSWER_S: Final = 2.0
_SLOW_MS: Final = 150.0  # half of the dead man's time
_WELCOME: Final = Welcome(
    VERSION, 1, "doctor", "OrbTouch", False, 1, 1, 10.0, 10.0, HEARTBEAT_MS, DEADMAN_MS,
    ("null",), ("pause",),
)  # fmt: skip


def link(url: str) -> Row:
    """Return how a link does: a loopback is talked through, another one opened and closed.

    Args:
        url: As of `controller --link`; "-" stands for a loopback.
    """
    if url == "-":
        return _loopback()
    try:
        open_link(url, _WELCOME).close()
    except LinkError as error:
        return Row("link", Verdict.FAULT, str(error), "Choose another --link.", "link")
    return Row("link", Verdict.GOOD, f"{url} can be opened")


def _loopback() -> Row:
    try:
        device = open_link("listen://127.0.0.1:0", _WELCOME)
    except LinkError as error:
        return Row("link", Verdict.FAULT, str(error), "Is loopback networking off?", "link")
    try:
        port = int(str(getattr(device, "url", "")).rpartition(":")[2])
        began = time.perf_counter()
        with socket.create_connection(("127.0.0.1", port), _ANSWER_S) as host:
            hello = Hello(VERSION, VERSION, "", "doctor", granted=False)
            host.sendall(b"\0" + encode(hello, session=0, sequence=1, t_ms=0))
            decoder = Decoder()
            while time.perf_counter() - began < _ANSWER_S:
                device.wait(0.01)
                device.poll()
                host.settimeout(_ANSWER_S)
                messages = [packet.message for packet in decoder.feed(host.recv(4096))]
                if any(isinstance(message, Offer) for message in messages):
                    took_ms = 1e3 * (time.perf_counter() - began)
                    found = f"a host on this machine is answered in {took_ms:.1f} ms"
                    if took_ms > _SLOW_MS:
                        advice = "The machine is too busy: end other programs."
                        return Row("link", Verdict.DOUBTFUL, found, advice, "slow_link")
                    return Row("link", Verdict.GOOD, found)
    except (OSError, ValueError) as error:
        return Row("link", Verdict.FAULT, f"no answer: {error}", "Report this.", "link")
    finally:
        device.close()
    return Row("link", Verdict.FAULT, f"no answer within {_ANSWER_S:.0f} s", "Report this.", "link")
