"""Probe of one port for an orb; prints one line of JSON.

    python -m host.discovery.probe URL [KEYFILE]

It is a process of its own, which the caller can kill. It sends Hello, waits for the answer, and
sends Bye.
"""

from __future__ import annotations

import json
import secrets
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from controller.protocol import psk
from controller.protocol.auth import NONCE
from controller.protocol.host_session import HostSession
from controller.protocol.link_events import Connected, Received, Refused
from controller.protocol.messages import SILENCE_MS
from host.connection.transport import Transport, open_transport

Outcome = Literal["orb", "refused", "foreign", "closed", "stuck"]


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer of a port.

    Attributes:
        url: The port.
        outcome: "orb": a device, named below; "refused": one that would not talk to us;
            "foreign": something else, or nothing; "closed": it does not open; "stuck": it hangs.
        why: One sentence, if it is no orb.
        device_id: The device's identity.
        name: What it calls itself.
        virtual: Whether it is simulated.
    """

    url: str
    outcome: Outcome
    why: str = ""
    device_id: str = ""
    name: str = ""
    virtual: bool = False


def ask(url: str, key: str = "", *, clock: Callable[[], float] = time.monotonic) -> Answer:
    """Open a port, and probe it.

    Args:
        url: The port.
        key: The file with the key that the orb may ask for; "": none.
        clock: Seconds that never turn back.
    """
    try:
        secret = psk.read(Path(key)) if key else b""
        transport = open_transport(url)
    except (OSError, psk.KeyFileError) as error:
        return Answer(url, "closed", str(error))
    try:
        return converse(transport, url, clock, secret)
    except OSError as error:
        return Answer(url, "foreign", f"{url} was cut off: {error}")
    finally:
        transport.close()


def converse(
    transport: Transport, url: str, clock: Callable[[], float], key: bytes = b""
) -> Answer:
    """Ask over an open port; it takes 2 s at most, however much is said there."""

    def now_ms() -> int:
        return round(clock() * 1000)

    began_ms = now_ms()
    sequence, nonce = secrets.randbelow(0x10000), secrets.token_bytes(NONCE)
    session = HostSession(url, sequence, began_ms, key=key, nonce=nonce)
    news: list[Received] = []
    while not news:
        transport.write(bytes(session.output))
        session.output.clear()
        data = transport.read(session.wait_ms(now_ms()) / 1000)
        news = session.receive(data, now_ms()) if data else session.tick(now_ms())
    match news[0]:
        case Connected(welcome=welcome):
            session.close("the host was only looking who is there", now_ms())
            transport.write(bytes(session.output))
            if not welcome.device_id:
                return Answer(url, "foreign", f"{url} answers, but says no identity")
            return Answer(url, "orb", "", welcome.device_id, welcome.name, welcome.virtual)
        case Refused(reason=reason):
            early = now_ms() - began_ms < SILENCE_MS  # else it is our own impatience that speaks
            return Answer(url, "refused" if early else "foreign", reason)
        case other:
            return Answer(url, "foreign", f"{url}: {other}")


def main() -> None:
    """Print the answer of the port that the command line names."""
    print(json.dumps(asdict(ask(*sys.argv[1:3]))), flush=True)


if __name__ == "__main__":
    main()
