"""Round trips of the link, in turns with bare pyserial over the same kind of wire.

    python -m tests.benchmarks.link [--trips N] [--json]

A round trip is Grant and its Granted, program to program; pyserial at both ends sends as many
bytes, and knows how many. The pty's wire is a process between two ptys. Linux.
"""

import json
import os
import pty
import select
import socket
import statistics
import subprocess
import sys
import time
import tty
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final

import serial
from serial.urlhandler import protocol_socket

from controller.shared.protocol.messages import Grant, Granted
from controller.shared.protocol.packets import encode
from host.connection.receiver import Delivered, Receiver
from host.connection.transport import open_transport
from tests.support import SUPPORT
from tests.support.processes import LineProcess

from .results import Results, command_line

GOAL: Final = 1.3
BATCH: Final = 250  # round trips in one turn
PATIENCE_S: Final = 30.0
FRAME: Final = len(encode(Grant(0), session=1, sequence=1, t_ms=1))  # as long as its answer
ORB: Final = (sys.executable, str(SUPPORT / "fake_device.py"))
OWN: Final = (sys.executable, "-m", "tests.benchmarks.link")
WIRES: Final = ("pty", "tcp")
Trip = Callable[[], object]


def far_end(stack: ExitStack, wire: str, program: tuple[str, ...]) -> str:
    """Start a program at the far end of a wire; return the URL of the near end."""

    def started(*command: str) -> Any:
        process = LineProcess(command, stderr=subprocess.DEVNULL)
        stack.callback(process.close)
        return json.loads(process.line())

    if wire == "tcp":
        return str(started(*program, "listen://127.0.0.1:0")["listening"])
    near, far = started(*OWN, "cable")
    started(*program, far)
    return str(near)


def our_trip(stack: ExitStack, wire: str) -> Trip:
    """Connect a receiver, and return what makes a round trip."""
    url = far_end(stack, wire, ORB)
    receiver = Receiver(lambda: open_transport(url), granted=True)
    stack.callback(receiver.close)
    receiver.connect()

    def trip() -> None:
        receiver.send(Grant(0))
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            receiver.wait(1.0)
            if any(isinstance(n, Delivered) and isinstance(n.message, Granted)
                   for n in receiver.poll()):  # fmt: skip
                return
        raise RuntimeError("the orb does not answer")

    return trip


def bare_trip(stack: ExitStack, wire: str) -> Trip:
    """Open the wire with pyserial, and return what makes a round trip."""
    url = far_end(stack, wire, (*OWN, "echo"))
    port: Any = serial.serial_for_url(url, baudrate=115_200, timeout=PATIENCE_S, exclusive=True)
    stack.callback(port.close)
    if wire == "tcp":
        with socket.socket(fileno=os.dup(port.fileno())) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def trip() -> None:
        port.write(bytes(FRAME))
        assert len(port.read(FRAME)) == FRAME

    return trip


def batch_us(trip: Trip) -> float:
    """Return the median of some round trips, microseconds."""
    taken = []
    for _ in range(BATCH):
        began_ns = time.perf_counter_ns()
        trip()
        taken.append((time.perf_counter_ns() - began_ns) / 1000)
    return statistics.median(taken)


def cable() -> None:
    """Join two ptys, and print their names."""
    pairs = [pty.openpty(), pty.openpty()]
    for _, slave in pairs:
        tty.setraw(slave)
    print(json.dumps([os.ttyname(slave) for _, slave in pairs]), flush=True)
    (one, _), (other, _) = pairs
    far = {one: other, other: one}
    while True:
        for end in select.select([*far], [], [])[0]:
            os.write(far[end], os.read(end, 1 << 14))


def echo(url: str) -> None:
    """Send back every frame from a pty, or from one host over TCP, with pyserial as well."""
    if url.startswith("listen:"):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            near = f"socket://127.0.0.1:{listener.getsockname()[1]}"
            print(json.dumps({"listening": near}), flush=True)
            connection, _ = listener.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)
        port: Any = protocol_socket.Serial()
        port._socket, port.is_open = connection, True
    else:
        port = serial.serial_for_url(url, baudrate=115_200, exclusive=True)
        print(json.dumps({"listening": url}), flush=True)
    while True:
        port.write(port.read(FRAME))


def main() -> None:
    """Measure both in turns over each wire, and print medians and their ratio."""
    options, results = command_line(__doc__, trips=5000).parse_args(), Results("link")
    for wire in WIRES:
        with ExitStack() as stack:
            ours, bare = our_trip(stack, wire), bare_trip(stack, wire)
            turns = max(options.trips // BATCH, 2)
            pairs = [(batch_us(ours), batch_us(bare)) for _ in range(turns)]
        results.spread("round_trip_us", [one for one, _ in pairs], "us", preset=wire)
        results.spread("round_trip_us@pyserial", [one for _, one in pairs], "us", preset=wire)
        ratios = [one / other for one, other in pairs]
        results.spread("round_trip_ratio", ratios, "", preset=wire, goal=GOAL)
    results.finish(options.json)


if __name__ == "__main__":
    if sys.argv[1:2] == ["cable"]:
        cable()
    elif sys.argv[1:2] == ["echo"]:
        echo(sys.argv[2])
    else:
        main()
