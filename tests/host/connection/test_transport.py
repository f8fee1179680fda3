"""Ports, as the receiver reads and writes them: whole, in order, and without waiting."""

import contextlib
import random
import socket
import threading
import time
from typing import cast

import pytest

from controller.shared.ports import Stream
from host.connection.receiver import LinkError
from host.connection.transport import BACKLOG, _Polled, _Selected, open_transport

DEADLINE_S = 20.0


def test_a_port_without_a_file_descriptor_gives_all_that_has_come() -> None:
    transport = open_transport("loop://")
    assert transport.read(0.0) == b""
    transport.write(b"OrbTouch")
    assert transport.read(DEADLINE_S) == b"OrbTouch"
    transport.write(b"!")
    assert transport.read(0.0) == b"!"
    assert transport.read(0.0) == b""
    transport.close()


def test_a_reader_that_is_woken_again_and_again_makes_nobody_wait() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = open_transport(f"socket://127.0.0.1:{server.getsockname()[1]}")

        def wake() -> None:
            for _ in range(5_000):  # more than fit between reader and others
                transport.wake()

        waking = threading.Thread(target=wake, daemon=True)
        waking.start()
        waking.join(DEADLINE_S)
        assert not waking.is_alive()
        assert transport.read(DEADLINE_S) == b""
        transport.close()


def test_what_did_not_fit_is_sent_while_the_host_reads() -> None:
    data = random.Random(1).randbytes(4096)
    port, peer = socket.socketpair()
    port.setblocking(False)
    peer.settimeout(DEADLINE_S)
    transport = _Selected(port, "orb")
    with peer, contextlib.closing(transport):
        sent = 0
        while not transport._backlog:  # the system's own buffers fill first
            transport.write(data)
            sent += 1
        received = b""
        while len(received) < 4096 * sent:
            received += peer.recv(1 << 20)
            transport.read(0.0)
    assert received == data * sent


def test_what_did_not_fit_wakes_the_reader_who_sends_it() -> None:
    port, peer = socket.socketpair()
    port.setblocking(False)
    transport = _Selected(port, "orb")
    with peer, contextlib.closing(transport):
        while not transport._backlog:
            assert transport.read(0.0) == b""
            transport.write(bytes(4096))
        begun_s = time.monotonic()
        assert transport.read(DEADLINE_S) == b""
        assert time.monotonic() - begun_s < DEADLINE_S / 2


def test_an_orb_that_takes_nothing_any_more_is_gone_before_it_costs_memory() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = open_transport(f"socket://127.0.0.1:{server.getsockname()[1]}")
        peer, _ = server.accept()

        def write_on() -> None:
            while True:  # the system's own buffers fill first
                transport.write(bytes(4096))

        with peer, pytest.raises(LinkError, match="takes no more bytes"):
            write_on()
        transport.close()
    assert isinstance(transport, _Selected)
    assert len(transport._backlog) <= BACKLOG + 4096


def test_a_port_that_takes_three_bytes_at_a_time_gets_each_once() -> None:
    class Narrow:
        taken = b""

        def send(self, data: bytes) -> int:
            self.taken += data[:3]
            return len(data[:3])

        def close(self) -> None:
            pass

    port = Narrow()
    transport = _Selected(cast(Stream, port), "narrow")
    transport.write(b"OrbTouch")
    assert port.taken == b"OrbTouch"
    transport.close()


@pytest.mark.parametrize(("waiting", "asked"), [(4, [1, 3]), (1, [1])])
def test_a_port_without_a_file_descriptor_waits_for_one_byte_only(
    waiting: int, asked: list[int]
) -> None:
    class Port:
        in_waiting, asked = waiting, list[int]()

        def read(self, size: int) -> bytes:
            self.asked.append(size)
            self.in_waiting -= size
            return b"!" * size

    port = Port()
    assert _Polled(port, "port").read(DEADLINE_S) == b"!" * waiting
    assert port.asked == asked
