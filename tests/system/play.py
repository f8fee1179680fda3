"""Time grants over a link: python -m tests.system.play URL; the last line is JSON."""

import json
import sys
import time

from controller.shared.protocol.messages import Grant, Granted
from host.connection.receiver import Connected, Delivered, Receiver
from host.connection.transport import open_transport

GRANTS = 150


def measure(url: str) -> None:
    """Connect, grant, and print how long each grant took."""
    receiver = Receiver(lambda: open_transport(url), granted=True)
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
    measure(sys.argv[1])
