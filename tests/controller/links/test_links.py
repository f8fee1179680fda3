"""The device's ends of links: real sockets and ptys, and a host played by hand."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import os
import pty
import select
import socket
import threading
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
import serial

from controller.links import open_link
from controller.links.base import Link, LinkError
from controller.links.byte_link import REQUESTS
from controller.links.listen import PEERS, ListenLink
from controller.links.serial_port import PortLink
from controller.links.stdout import StdoutLink
from controller.shared.protocol import messages as wire
from controller.shared.protocol import retransmit
from controller.shared.protocol.device_session import WRONG_KEY
from tests.support.fake_device import welcome
from tests.support.manual_host import HELLO, JOIN, HandMadeHost, plain
from tests.support.waiting import until

PRESS = wire.Command("left", "press", 0.123456, (1.23456, 2.0), 9)
FRAME = wire.Telemetry(1, bytes(25), (1.0,), None, "", True, 10.0)
DEADLINE_S = 10.0
Connect = Callable[[], HandMadeHost]
Open = Callable[..., HandMadeHost]


def request(link: Link) -> list[wire.Message]:
    """Return the next requests; fail after the deadline."""
    link.wait(DEADLINE_S)
    return link.poll()


@pytest.fixture
def link() -> Iterator[ListenLink]:
    link = open_link("listen://127.0.0.1:0", welcome())
    assert isinstance(link, ListenLink)
    yield link
    link.close()


@pytest.fixture
def to() -> Iterator[Open]:
    """Connect a hand-made host to a link."""
    with contextlib.ExitStack() as stack:

        def connect(link: ListenLink, key: bytes = b"") -> HandMadeHost:
            parts = urlsplit(link.url)
            connection = socket.create_connection((parts.hostname, parts.port), DEADLINE_S)
            stack.enter_context(connection)
            host = HandMadeHost(lambda: connection.recv(4096), connection.sendall, key)
            host.close = connection.close
            return host

        yield connect


@pytest.fixture
def connect(link: ListenLink, to: Open) -> Connect:
    return lambda: to(link)


@pytest.fixture
def host(link: ListenLink, connect: Connect) -> HandMadeHost:
    """A host that the loop has heard of."""
    host = connect()
    host.greet()
    assert request(link) == [HELLO]
    return host


# --- the standard output ---


def test_commands_are_printed_as_json_lines_and_nothing_else_is() -> None:
    out = io.StringIO()
    link = StdoutLink(out)
    assert link.connected
    link.send(PRESS, 1_200)
    link.send(FRAME, 1_300)
    link.send(wire.Command("drop", "pinch", 1.0, None, 13), 1_400)
    assert link.poll() == []
    link.close()
    assert out.getvalue() == (
        '{"t": 1.2, "gesture": "press", "probability": 0.1235, "touch": [1.235, 2.0],'
        ' "command": "left"}\n'
        '{"t": 1.4, "gesture": "pinch", "probability": 1.0, "touch": null, "command": "drop"}\n'
    )
    assert link.dropped == 0


def test_a_command_carries_the_uncertainty_of_its_own_frame() -> None:
    out = io.StringIO()
    link = StdoutLink(out)
    link.send(wire.PositionUncertainty(PRESS.frame - 1, 0.3), 1_100)
    link.send(PRESS, 1_200)
    link.send(wire.PositionUncertainty(PRESS.frame, 0.12345), 1_200)
    link.send(PRESS, 1_200)
    link.close()
    lines = [json.loads(line) for line in out.getvalue().splitlines()]
    assert [line.get("sigma") for line in lines] == [None, 0.123]


def test_a_slow_reader_of_the_standard_output_delays_nobody() -> None:
    allowed = threading.Event()

    class Slow(io.StringIO):
        def write(self, text: str) -> int:
            assert allowed.wait(DEADLINE_S)
            return super().write(text)

    out = Slow()
    link = StdoutLink(out)
    for frame in range(1_000):
        link.send(wire.Command("left", "press", 1.0, None, frame), frame)
    assert out.getvalue() == ""
    allowed.set()
    link.close()
    lines = [json.loads(line)["t"] for line in out.getvalue().splitlines()]
    assert lines == [frame / 1000 for frame in range(1_000)]


def test_a_reader_that_went_away_ends_the_printing_quietly() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as out:
        link = StdoutLink(out)
        link.send(PRESS, 0)
        until(lambda: not link.connected)
        link.send(PRESS, 0)
        link.close()
        assert (link.dropped, link.problem) == (1, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs the device that is always full")
def test_a_full_disk_is_told_in_one_sentence() -> None:
    with Path("/dev/full").open("w") as out:
        link = StdoutLink(out)
        link.send(PRESS, 0)
        until(lambda: not link.connected)
        link.close()
        assert link.problem == "cannot print the commands: No space left on device"


# --- TCP ---


@pytest.mark.parametrize(
    "address", ["0.0.0.0", "192.0.2.1", "example.org", "[::]", "127.0.0.1.example.org"]
)
def test_strangers_cannot_be_let_in(address: str) -> None:
    with pytest.raises(LinkError, match=r"other machines could connect|no number of this machine"):
        open_link(f"listen://{address}:4000", welcome())


@pytest.mark.parametrize("url", ["listen://127.0.0.1", "listen://127.0.0.1:x", "listen://"])
def test_an_address_without_a_port_is_explained(url: str) -> None:
    with pytest.raises(LinkError, match="for any port"):
        open_link(url, welcome())


def test_a_port_that_is_taken_is_explained(link: ListenLink) -> None:
    with pytest.raises(LinkError, match="another program has this port"):
        open_link(link.url.replace("socket", "listen"), welcome())


def test_localhost_is_this_machine() -> None:
    link = open_link("listen://localhost:0", welcome())
    assert isinstance(link, ListenLink)
    assert link.url.startswith("socket://127.0.0.1:")
    link.close()


def test_a_host_is_welcomed_and_heard(link: ListenLink, connect: Connect) -> None:
    host = connect()
    assert not link.connected
    assert host.greet() == welcome()
    assert host.message() == wire.State(())
    assert request(link) == [HELLO]
    assert link.connected
    host.say(wire.Contacts(()))
    assert request(link) == [wire.Contacts(())]
    link.send(PRESS, 1_200)
    packet = host.packet()
    assert packet.t_ms == 1_200
    assert isinstance(packet.message, wire.Command)
    assert packet.message.name == "left"


def test_nothing_is_sent_before_the_loop_has_the_hello(link: ListenLink, connect: Connect) -> None:
    host = connect()
    host.greet()
    assert host.message() == wire.State(())
    link.send(FRAME, 1_000)  # a frame of the time before: the host must not see it
    assert request(link) == [HELLO]
    link.send(wire.State(("down",)), 0)
    assert host.message() == wire.State(("down",))
    assert link.dropped == 1


def test_a_second_host_is_refused_without_harm(link: ListenLink, connect: Connect) -> None:
    first, second = connect(), connect()
    first.greet()
    answer = second.greet(dataclasses.replace(JOIN, host_nonce=78))
    assert answer == wire.Refuse("already connected to another host; close that one first")
    assert request(link) == [HELLO]
    second.say(wire.Contacts(()))
    first.say(wire.Perform(1, "press", 0.0, 0.0))
    assert request(link) == [wire.Perform(1, "press", 0.0, 0.0)]


def test_the_next_host_is_welcome(link: ListenLink, connect: Connect, host: HandMadeHost) -> None:
    number = host.session
    host.close()
    [bye] = request(link)
    assert isinstance(bye, wire.Bye)
    assert not link.connected
    link.send(PRESS, 0)
    host = connect()
    host.greet()
    assert host.session == number + 1
    assert host.message() == wire.State(())
    assert request(link) == [HELLO]
    link.send(wire.State(("down",)), 0)
    assert host.message() == wire.State(("down",))  # and not the press of the time between


def test_a_silent_or_babbling_peer_is_let_go(link: ListenLink, connect: Connect) -> None:
    mute, babbling, host = connect(), connect(), connect()
    babbling.write(b"GET / HTTP/1.1\r\n\r\n\0" * 1000)
    assert isinstance(host.greet(dataclasses.replace(JOIN, granted=True)), wire.Welcome)
    for peer in (mute, babbling):
        with pytest.raises((EOFError, ConnectionResetError)):
            peer.packet()
    assert len(request(link)) == 1
    assert link.connected


def test_only_so_many_may_knock_at_a_time(link: ListenLink, connect: Connect) -> None:
    peers = [connect() for _ in range(PEERS)]
    until(lambda: len(link._peers) == PEERS)
    with pytest.raises((EOFError, ConnectionResetError)):
        connect().packet()
    assert isinstance(peers[-1].greet(), wire.Welcome)


def test_a_host_that_left_before_it_was_accepted_delays_nothing(link: ListenLink) -> None:
    accepting = threading.Thread(target=link._accept, args=(0,), daemon=True)
    accepting.start()
    accepting.join(DEADLINE_S)
    assert not accepting.is_alive()


def test_a_host_that_floods_is_cut_off(link: ListenLink, connect: Connect) -> None:
    host = connect()
    host.greet()

    def flood() -> None:
        while True:
            host.say(wire.Contacts(()))

    with pytest.raises(ConnectionError):
        flood()
    requests = request(link)
    assert requests[0] == HELLO
    assert isinstance(requests[-1], wire.Bye)
    assert len(requests) < REQUESTS + 2_000


def test_a_host_that_never_reads_delays_no_loop(link: ListenLink, host: HandMadeHost) -> None:
    while not link.dropped:  # the system's own buffers fill first
        for _ in range(1_000):
            link.send(FRAME, 0)
    assert link._host is not None
    assert len(link._host.session.output) < 20_000


def test_closing_says_bye_after_all_that_was_sent(link: ListenLink, host: HandMadeHost) -> None:
    for _ in range(100):
        link.send(FRAME, 0)
    closing = threading.Thread(target=link.close)
    closing.start()
    assert host.message() == wire.State(())
    assert [host.message() for _ in range(100)] == [FRAME] * 100
    assert host.message() == wire.Bye("the orb was switched off")
    closing.join()
    with pytest.raises(EOFError):
        host.packet()


def test_wait_returns_after_its_timeout_when_nobody_comes(link: ListenLink) -> None:
    link.wait(0.0)
    link.wait(0.01)
    assert link.poll() == []


# --- ports ---


class Pty:
    """A pty: the device opens `path`, the test plays the host at the other end."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.path = os.ttyname(self.slave)
        self.host = HandMadeHost(self.read, lambda data: os.write(self.master, data))

    def read(self) -> bytes:
        assert select.select([self.master], [], [], DEADLINE_S)[0]
        return os.read(self.master, 4096)

    def close(self) -> None:
        os.close(self.master)
        os.close(self.slave)


def test_a_host_is_heard_over_a_port() -> None:
    line = Pty()
    link = open_link(line.path, welcome())
    line.host.write(b"left over from somebody else")
    assert line.host.greet() == welcome()
    assert request(link) == [HELLO]
    line.host.say(wire.Contacts(()))
    assert request(link) == [wire.Contacts(())]
    link.send(PRESS, 0)
    assert line.host.message() == wire.State(())
    assert isinstance(line.host.message(), wire.Command)
    link.close()
    assert line.host.message() == wire.Bye("the orb was switched off")
    line.close()


def test_a_port_that_vanishes_ends_the_session_and_is_opened_again(tmp_path: Any) -> None:
    name = tmp_path / "tty"
    line = Pty()
    name.symlink_to(line.path)
    link = open_link(str(name), welcome())
    line.host.greet()
    assert request(link) == [HELLO]
    name.unlink()
    line.close()  # pulled out
    [bye] = request(link)
    assert isinstance(bye, wire.Bye)
    line = Pty()
    name.symlink_to(line.path)  # plugged in again
    assert isinstance(link, PortLink)
    until(lambda: link._peers)
    assert line.host.greet() == welcome()
    assert request(link) == [HELLO]
    link.close()
    line.close()


def test_a_port_that_is_taken_is_explained_in_one_sentence() -> None:
    line = Pty()
    taken = serial.Serial(line.path, exclusive=True)
    with pytest.raises(LinkError) as refused:
        open_link(line.path, welcome())
    taken.close()
    line.close()
    assert str(refused.value) == (
        f"cannot open {line.path}: another program uses it; name another with --link"
    )


@pytest.mark.parametrize(
    ("url", "problem"),
    [
        ("/dev/there-is-no-such-port", "there is no such port"),
        ("/dev/null", "it is not a serial port"),
        ("/", "it is not a serial port"),
        ("socket://127.0.0.1", "expected is socket://ADDRESS:PORT"),
        ("socket://127.0.0.1:x", "expected is socket://ADDRESS:PORT"),
        ("loop://", "select cannot wait for such a port here"),
        ("nonsense://x", "invalid URL, protocol 'nonsense' not known"),
    ],
)
def test_a_port_that_cannot_be_opened_is_explained_in_one_sentence(url: str, problem: str) -> None:
    with pytest.raises(LinkError) as refused:
        open_link(url, welcome())
    assert str(refused.value) == f"cannot open {url}: {problem}; name another with --link"


def test_a_port_without_a_name_is_explained_in_one_sentence() -> None:
    with pytest.raises(LinkError, match="names no port; leave it out to have commands printed"):
        open_link("", welcome())


def test_a_handshake_that_fits_in_no_packet_is_refused_first() -> None:
    chatty = dataclasses.replace(welcome(), commands=tuple(f"wish_{k}" for k in range(65)))
    with pytest.raises(LinkError, match="cannot send Welcome: 65 values, where at most 64 fit; "):
        open_link("listen://127.0.0.1:0", chatty)


# --- keys, other machines, and hosts that come back ---

KEY = bytes(range(32))


def listening(url: str = "listen://127.0.0.1:0", **access: Any) -> ListenLink:
    link = open_link(url, welcome(), **access)
    assert isinstance(link, ListenLink)
    return link


def test_a_host_needs_the_right_key(to: Open, caplog: pytest.LogCaptureFixture) -> None:
    link = listening(key=KEY)
    for wrong in (bytes(32), b""):
        assert to(link, wrong).greet() == wire.Refuse(WRONG_KEY)
    assert link.poll() == []
    host = to(link, KEY)
    assert host.greet() == welcome()
    assert request(link) == [HELLO]
    link.send(PRESS, 0)
    assert host.message() == wire.State(())
    command = plain(host.message())
    assert isinstance(command, wire.Command)
    assert command.name == "left"
    link.close()
    assert caplog.text.count(f"a host was refused: {WRONG_KEY}") == 1  # not for every knock


def test_other_machines_need_a_key(caplog: pytest.LogCaptureFixture, to: Open) -> None:
    with pytest.raises(LinkError, match="add --key FILE"):
        listening("listen://0.0.0.0:0")
    link = listening("listen://0.0.0.0:0", key=KEY)
    assert link.url.startswith("socket://127.0.0.1:")
    assert "for hosts with the key; sensor data is not encrypted" in caplog.text
    assert to(link, KEY).greet() == welcome()
    link.close()


def test_a_reconnecting_host_replaces_its_line(
    link: ListenLink, connect: Connect, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(retransmit, "LATE_MS", 60_000)  # however slow this machine is
    gone, again = connect(), connect()
    gone.greet()
    assert request(link) == [HELLO]
    link.send(PRESS, 0)  # it never gets there: nobody reads that line any more
    join = dataclasses.replace(JOIN, boot_nonce=welcome().boot_nonce)
    assert again.greet(join) == dataclasses.replace(welcome(), resumed=True)
    assert again.message() == wire.State(())
    assert isinstance(plain(again.message()), wire.Command)
    assert request(link) == [HELLO]
    assert link.connected
    until(lambda: len(link._peers) == 1)
    again.say(wire.Contacts(()))
    assert request(link) == [wire.Contacts(())]


def test_commands_await_a_host(link: ListenLink, to: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retransmit, "LATE_MS", 60_000)  # however slow this machine is
    first = to(link)
    first.greet()
    assert request(link) == [HELLO]
    first.say(wire.Bye("back in a moment"))
    assert request(link) == [wire.Bye("back in a moment")]
    link.send(PRESS, 0)
    join = dataclasses.replace(JOIN, boot_nonce=welcome().boot_nonce)
    again = to(link)
    again.greet(join)
    assert again.message() == wire.State(())
    assert isinstance(plain(again.message()), wire.Command)
    again.say(wire.Bye(""))
    heard: list[wire.Message] = []
    while wire.Bye("") not in heard:
        heard += request(link)
    link.send(PRESS, 0)
    stranger = to(link)
    stranger.greet(dataclasses.replace(join, host_nonce=78))
    assert stranger.message() == wire.State(())
    assert link.outbox.posted == ()


def test_a_host_may_greet_again_on_an_old_line(link: ListenLink, host: HandMadeHost) -> None:
    [peer] = link._peers
    peer.since_ms = -60_000  # when it connected; but it has a session
    until(lambda: peer.since_ms >= 0)
    assert host.message() == wire.State(())
    assert host.greet() == welcome()
    requests = request(link)
    assert [*requests, *([] if HELLO in requests else request(link))][1:] == [HELLO]
