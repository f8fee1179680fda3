"""Measure a link end to end, or play over one: also over Python's own Bluetooth socket.

    python -m tests.system.play URL               how long grants take to the orb's program and back
    python -m tests.system.play URL SEED SECONDS  a demo game, as `host --demo --json` plays it

URL is whatever `host --link` takes, or socket:ADDRESS/CHANNEL/LOCAL. The last line is JSON.
"""

from __future__ import annotations

import json
import socket
import sys
import time

from controller.shared.protocol.messages import Grant, Granted
from host.connection.receiver import Connected, Delivered, Receiver
from host.connection.transport import Transport, _Selected, open_transport
from host.demo import demo

GRANTS = 150


def plain(words: str) -> socket.socket:
    """Connect Python's own socket: ADDRESS/CHANNEL/LOCAL."""
    address, channel, local = words.split("/")
    connection = socket.socket(31, socket.SOCK_STREAM, 3)
    connection.bind((local, 0))
    connection.connect((address, int(channel)))
    connection.setblocking(False)
    return connection


def opened(url: str) -> Transport:
    if url.startswith("socket:") and not url.startswith("socket://"):
        return _Selected(plain(url.partition(":")[2]), url)
    return open_transport(url)


def game(url: str, seed: int, seconds: float) -> None:
    """Play a demo game, and print what came of it."""
    vars(demo)["open_transport"] = opened
    demo.run(seed=seed, seconds=seconds, as_json=True, link=url)


def measure(url: str) -> None:
    """Connect, grant, and print how long each grant took."""
    receiver = Receiver(lambda: opened(url), granted=True)
    receiver.connect()
    seconds = []
    for number in range(1, GRANTS + 1):
        start_s = time.perf_counter()
        receiver.send(Grant(number))  # milliseconds: no frame is due in most of these grants
        answer(receiver, number)
        seconds.append(time.perf_counter() - start_s)
    receiver.close()
    print(json.dumps({"seconds": seconds}))


def answer(receiver: Receiver, until_ms: int) -> None:
    """Return when the orb says that it has come so far."""
    end_s = time.monotonic() + 10.0
    while time.monotonic() < end_s:
        for item in receiver.poll():
            if isinstance(item, Delivered) and isinstance(item.message, Granted):
                if item.message.until_ms == until_ms:
                    return
            elif not isinstance(item, Connected | Delivered):
                raise SystemExit(f"the link broke: {item}")
        receiver.wait(end_s - time.monotonic())
    raise SystemExit("the orb does not answer")


if __name__ == "__main__":
    if len(sys.argv) == 4:
        game(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]))
    else:
        measure(sys.argv[1])
