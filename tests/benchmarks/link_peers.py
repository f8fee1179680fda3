"""Processes of the link benchmark: far ends, and the wire in between.

    python -m tests.benchmarks.link_peers device URL      an orb that feels nothing
    python -m tests.benchmarks.link_peers sessions URL    the same without locks, queues, threads
    python -m tests.benchmarks.link_peers echo URL        a bare pyserial loop: a frame in, one out
    python -m tests.benchmarks.link_peers lines URL       the same, which looks for a frame's end
    python -m tests.benchmarks.link_peers cable           two ptys, joined
    python -m tests.benchmarks.link_peers air             the same, by RFCOMM over Bumble
    python -m tests.benchmarks.link_peers proxy PORT      a TCP port, joined with another one

Each prints where it is as its first line, and ends with its standard input.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import socket
import sys
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from controller.shared.protocol.messages import Welcome

CHUNK: Final = 16 * 1024
FRAME: Final = 20  # bytes that Grant and Granted have on the wire


def say(**values: Any) -> None:
    print(json.dumps(values), flush=True)


def on_line(take: Callable[[str], None]) -> None:
    """Call `take` with each line of the standard input, on a thread; end the program with it."""

    def read() -> None:
        for line in sys.stdin:
            take(line.strip())
        os._exit(0)

    threading.Thread(target=read, daemon=True).start()


def device(url: str) -> None:
    """Answer every grant at once."""
    from controller.links import open_link
    from controller.shared.protocol.messages import Grant, Granted

    link = open_link(url, _welcome())
    on_line(lambda line: None)
    say(url=getattr(link, "url", url))
    while True:
        link.wait(60.0)
        for request in link.poll():
            if isinstance(request, Grant):
                link.send(Granted(request.until_ms), request.until_ms)


def sessions(url: str) -> None:
    """Answer every grant with a device's session and nothing around it."""
    from controller.shared.protocol.device_session import DeviceSession
    from controller.shared.protocol.messages import Grant, Granted

    port = _port(url)
    descriptor = port.fileno()
    session = DeviceSession(_welcome())
    while True:
        select.select([descriptor], [], [])
        now_ms = time.monotonic_ns() // 1_000_000
        for request in session.receive(os.read(descriptor, CHUNK), now_ms):
            if isinstance(request, Grant):
                session.send(Granted(request.until_ms), request.until_ms, now_ms)
        os.write(descriptor, bytes(session.output))
        session.output.clear()


def echo(url: str) -> None:
    """Send back every frame, whose length is known."""
    port = _port(url)
    while True:
        port.write(port.read(FRAME))


def lines(url: str) -> None:
    """Send back every line, as pyserial finds it: byte by byte."""
    port = _port(url)
    while True:
        port.write(port.readline())


def _port(url: str) -> Any:
    """Open a pyserial port (a TCP one is given its connection), and say where the other end is."""
    import serial
    from serial.urlhandler import protocol_socket

    on_line(lambda line: None)
    if not url.startswith("listen:"):
        port: Any = serial.serial_for_url(url, baudrate=115_200, exclusive=True)
        say(url=url)
        return port
    with socket.create_server(("127.0.0.1", 0)) as listener:
        say(url=f"socket://127.0.0.1:{listener.getsockname()[1]}")
        connection, _ = listener.accept()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setblocking(False)
    port = protocol_socket.Serial()
    port._socket, port.is_open = connection, True
    return port


def _welcome() -> Welcome:
    from tests.support.fake_device import welcome

    return welcome(nonce=int.from_bytes(os.urandom(4), "little"))


class Joint:
    """Two ends that are joined while nobody has pulled the plug."""

    def __init__(self) -> None:
        self.passed = [0, 0]  # bytes so far, from the first end to the second and back
        self.pulled = False

    def run(self, ends: list[int], far: list[int] | None = None) -> None:
        """Pass bytes on until one end is gone: to the other end, or through `far`, one each."""
        ways = dict(zip(ends, far or ends[::-1], strict=True))
        back = dict(zip(far, ends, strict=True)) if far else {}
        while True:
            for end in select.select([*ways, *back], [], [])[0]:
                data = os.read(end, CHUNK)
                if not data:
                    return
                if end in back:
                    os.write(back[end], data)
                    continue
                self.passed[ends.index(end)] += len(data)
                if not self.pulled:
                    os.write(ways[end], data)


def cable(far: list[int] | None = None) -> None:
    """Join two ptys; "pull", "plug" and "bytes" are taken from the standard input."""
    import pty
    import tty

    joint = Joint()
    pairs = [pty.openpty(), pty.openpty()]
    for _, slave in pairs:
        tty.setraw(slave)

    def take(line: str) -> None:
        joint.pulled = {"pull": True, "plug": False}.get(line, joint.pulled)
        say(bytes=joint.passed)

    on_line(take)
    say(ends=[os.ttyname(slave) for _, slave in pairs])
    joint.run([master for master, _ in pairs], far)


def air() -> None:
    """Join two ptys by RFCOMM over Bumble's virtual controllers; it takes what a cable takes."""
    import queue

    from controller.links.bluetooth.serial_profile import record
    from controller.shared.bluetooth.bluez import CHANNEL
    from tests.support.bumble_radio import ORB, Air

    radio = Air(record(), CHANNEL)
    came: queue.SimpleQueue[socket.socket] = queue.SimpleQueue()
    radio.arrived = came.put
    sockets = [radio.open_channel(ORB), came.get(timeout=10.0)]
    cable([each.fileno() for each in sockets])


def proxy(port: str) -> None:
    """Join each connection with one to a port of this machine; "pull" closes both at once."""
    joint = Joint()
    present: list[socket.socket] = []

    def take(line: str) -> None:
        if line == "pull":
            for end in present:
                with contextlib.suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
        say(bytes=joint.passed)

    on_line(take)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        say(ends=[f"socket://127.0.0.1:{listener.getsockname()[1]}"])
        while True:
            host, _ = listener.accept()
            with host, socket.create_connection(("127.0.0.1", int(port))) as far:
                for end in (host, far):
                    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                present[:] = [far, host]
                with contextlib.suppress(OSError):
                    joint.run([far.fileno(), host.fileno()])


_ROLES: Final[dict[str, Callable[..., None]]] = {
    role.__name__: role for role in (device, sessions, echo, lines, cable, air, proxy)
}

if __name__ == "__main__":
    _ROLES[sys.argv[1]](*sys.argv[2:])
