"""The host's end: another process over TCP and over a pty, killed, hung, cut off, and back."""

from __future__ import annotations

import errno
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import pytest
import serial

from controller.links import open_link
from controller.shared.ports import why
from controller.shared.protocol import messages
from controller.shared.protocol.messages import (
    Command,
    ContactState,
    Granted,
    Hello,
    State,
    Telemetry,
)
from controller.shared.protocol.packets import Decoder, encode
from controller.shared.protocol.retransmit import SessionHistory
from host.connection import receiver as receiver_module
from host.connection.receiver import (
    Connected,
    Delivered,
    LinkError,
    Lost,
    Received,
    Receiver,
    Refused,
)
from host.connection.transport import Transport, _Polled, open_transport
from host.connection.virtual_orb import START_S, VirtualOrbProcess
from tests.support import SUPPORT
from tests.support.fake_device import welcome
from tests.support.manual_host import numbered
from tests.support.pytest_types import Patch
from tests.support.serial_cable import Cable

DEVICE = (sys.executable, str(SUPPORT / "fake_device.py"))
DEADLINE_S = 20.0


class Ear:
    """Listens to a receiver, and keeps all that it told with the time."""

    def __init__(self, receiver: Receiver) -> None:
        self.receiver = receiver
        self.told: list[tuple[float, Received]] = []
        self.at_s = 0.0  # when the newest of those asked for was told
        self._heard = 0  # how many of those told were looked at

    def until(self, condition: Callable[[Received], bool]) -> Received:
        """Return the next news that fulfils a condition; fail after the deadline."""
        end = time.monotonic() + DEADLINE_S
        while time.monotonic() < end:
            while self._heard < len(self.told):
                self.at_s, news = self.told[self._heard]
                self._heard += 1
                if condition(news):
                    return news
            self.receiver.wait(0.1)
            self.told += [(time.monotonic(), news) for news in self.receiver.poll()]
        raise AssertionError(f"it was not told: {[news for _, news in self.told[-5:]]}")

    def message(self, kind: type) -> Any:
        """Return the next message of a kind."""
        news = self.until(lambda news: isinstance(getattr(news, "message", None), kind))
        assert isinstance(news, Delivered)
        return news.message

    def next(self, kind: type) -> Any:
        """Return the next news of a kind."""
        return self.until(lambda news: isinstance(news, kind))

    def frames(self) -> list[list[int]]:
        """Return the frames of all commands heard, connection by connection."""
        connections: list[list[int]] = []
        for _, news in self.told:
            if isinstance(news, Connected):
                connections.append([])
            elif isinstance(news, Delivered) and isinstance(news.message, Command):
                connections[-1].append(news.message.frame)
        return connections

    def accounts_for_every_command(self) -> None:
        """Of one device's commands, each came once and in order, or was told to be missed."""
        frame = 0
        for _, news in self.told:
            if isinstance(news, receiver_module.Missed):
                frame += 10 * news.count
            elif isinstance(news, Delivered) and isinstance(news.message, Command):
                frame += 10
                assert news.message.frame == frame


Ears = Callable[[Receiver], Ear]  # makes an ear, and closes its receiver after the test
Peer = Callable[[Callable[[bytes], bytes]], str]  # starts a peer; returns its URL


@pytest.fixture
def device() -> Iterator[VirtualOrbProcess]:
    device = VirtualOrbProcess(1, command=(*DEVICE, "listen://127.0.0.1:0"))
    yield device
    device.close()


@pytest.fixture
def ears() -> Iterator[Ears]:
    made: list[Receiver] = []

    def make(receiver: Receiver) -> Ear:
        made.append(receiver)
        return Ear(receiver)

    yield make
    for receiver in made:
        receiver.close()


# --- two processes over TCP ---


def test_two_processes_talk_over_tcp(device: VirtualOrbProcess, ears: Ears) -> None:
    ear = ears(Receiver(device.open, token=device.token))
    answer = ear.receiver.connect()
    assert (answer.name, answer.virtual) == ("OrbTouch", True)
    assert ear.next(Connected) == Connected(answer)
    assert ear.message(State) == State(())
    assert ear.message(Telemetry).image == bytes([128] * 25)
    assert ear.message(Command).name == "drop"
    assert ear.receiver.send(messages.Contacts((messages.Contact(1, 2.0, 2.0, 3.0, 4.0),)))
    assert ear.message(State) == State(("down",))
    assert ear.receiver.send(messages.Perform(5, "press", 1.0, 1.0))
    assert ear.message(messages.GroundTruth).number == 5
    assert ear.receiver.state == "live"


def test_clock_offset_is_known_only_while_connected(device: VirtualOrbProcess, ears: Ears) -> None:
    receiver = Receiver(device.open, token=device.token)
    ear = ears(receiver)
    assert receiver.clock_offset_ms is None
    receiver.connect()
    ear.until(lambda _: receiver.clock_offset_ms is not None)
    receiver.close()
    assert receiver.clock_offset_ms is None


def test_nothing_of_a_receiver_runs_on_after_it_is_closed(device: VirtualOrbProcess) -> None:
    receiver = Receiver(device.open, token=device.token)
    receiver.connect()
    running = set(threading.enumerate())
    receiver.close()
    assert set(threading.enumerate()) < running


def test_waiting_ends_when_there_is_news_to_poll(device: VirtualOrbProcess) -> None:
    receiver = Receiver(device.open, token=device.token)
    receiver.start()
    for _ in range(2):  # at the latest the second time, with what waits already
        receiver.wait(DEADLINE_S)
    assert isinstance(receiver.poll()[0], Connected)
    receiver.close()


def test_granted_time_gives_the_same_messages_however_it_is_cut(ears: Ears) -> None:
    def play(step_ms: int) -> list[Delivered]:
        device = VirtualOrbProcess(1, command=(*DEVICE, "listen://127.0.0.1:0"))
        ear = ears(Receiver(device.open, token=device.token, granted=True))
        ear.receiver.connect()
        for until_ms in range(step_ms, 6_001, step_ms):
            assert ear.receiver.send(messages.Grant(until_ms))
            assert ear.message(Granted) == Granted(until_ms)
        ear.receiver.close()
        device.close()
        delivered = [news for _, news in ear.told if isinstance(news, Delivered)]
        return [news for news in delivered if not isinstance(news.message, Granted)]

    played = play(10)
    assert len(played) == 1 + 60 + 6  # the state, 60 frames, and every tenth a command
    assert play(100) == play(2_000) == played


def test_killed_device_restarts_and_repeats_nothing(device: VirtualOrbProcess, ears: Ears) -> None:
    ear = ears(Receiver(device.open, token=device.token))
    ear.receiver.connect()
    ear.message(Command)
    assert device.process is not None
    killed = device.process
    killed.send_signal(signal.SIGKILL)
    killed_s = time.monotonic()
    assert ear.next(Lost) == Lost("the virtual orb was cut off")
    assert ear.at_s - killed_s < 2.0
    assert ear.receiver.state == "lost"
    assert not ear.receiver.send(messages.Contacts(()))
    ear.next(Connected)
    ear.message(Command)
    ear.message(Command)
    assert device.process is not killed
    before, after = ear.frames()
    assert before == list(range(10, 10 * len(before) + 1, 10))
    assert after == list(range(10, 10 * len(after) + 1, 10))


def test_a_hung_device_is_stale_then_lost_then_found(device: VirtualOrbProcess, ears: Ears) -> None:
    ear = ears(Receiver(device.open, token=device.token))
    ear.receiver.connect()
    ear.message(Command)
    assert device.process is not None
    device.process.send_signal(signal.SIGSTOP)
    stopped_s = time.monotonic()
    ear.next(receiver_module.Stale)
    ear.next(Lost)
    assert ear.at_s - stopped_s < 2.0
    device.process.send_signal(signal.SIGCONT)
    ear.next(Connected)
    ear.message(Command)
    ear.accounts_for_every_command()


def test_a_receiver_that_was_only_started_waits_for_an_orb_to_come(ears: Ears) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    url = f"socket://127.0.0.1:{port}"
    ear = ears(Receiver(lambda: open_transport(url)))
    ear.receiver.start()
    refused = ear.next(Refused)
    assert "nothing listens there" in refused.reason
    assert ear.receiver.state == "connecting"
    link = open_link(f"listen://127.0.0.1:{port}", welcome())
    ear.next(Connected)
    assert len([news for _, news in ear.told if isinstance(news, Refused)]) == 1  # not each time
    link.close()
    assert ear.next(Lost).reason == f"{url}: the orb was switched off"


def test_a_host_that_closes_is_gone_for_the_orb_at_once() -> None:
    link: Any = open_link("listen://127.0.0.1:0", welcome())
    receiver = Receiver(lambda: open_transport(link.url))
    receiver.connect()
    receiver.close()
    receiver.close()
    requests: list[str] = []
    while len(requests) < 2:
        link.wait(DEADLINE_S)
        requests += [type(request).__name__ for request in link.poll()]
    assert requests == ["Hello", "Bye"]
    assert not link.connected
    link.close()


# --- two processes over a pty ---


@pytest.fixture
def cable() -> Iterator[Cable]:
    cable = Cable()
    yield cable
    cable.close()


def test_two_processes_talk_over_a_pty_whose_cable_is_replugged(cable: Cable, ears: Ears) -> None:
    far, near = cable.ends
    with subprocess.Popen([*DEVICE, far], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert b"listening" in process.stdout.readline()
        ear = ears(Receiver(lambda: open_transport(near)))
        assert ear.receiver.connect().name == "OrbTouch"
        ear.message(Command)
        cable.plugged = False
        ear.next(receiver_module.Stale)
        ear.next(Lost)
        cable.plugged = True
        ear.next(Connected)
        ear.message(Command)
        ear.receiver.close()
        process.terminate()
    ear.accounts_for_every_command()


# --- who is not an orb, and orbs that do not want us ---


@pytest.fixture
def peer() -> Iterator[Peer]:
    """Start a peer that answers what it hears with a function; return its URL."""
    listeners: list[socket.socket] = []
    threads: list[threading.Thread] = []

    def start(answer: Callable[[bytes], bytes]) -> str:
        listener = socket.create_server(("127.0.0.1", 0))

        def serve() -> None:
            connection, _ = listener.accept()
            with connection:
                while data := connection.recv(4096):
                    connection.sendall(answer(data))

        listeners.append(listener)
        threads.append(threading.Thread(target=serve))
        threads[-1].start()
        return f"socket://127.0.0.1:{listener.getsockname()[1]}"

    yield start
    for thread in threads:
        thread.join()
    for listener in listeners:
        listener.close()


def failure(url: str, token: str = "") -> str:
    """Return why a connection cannot be made."""
    with pytest.raises(LinkError) as raised:
        Receiver(lambda: open_transport(url), token=token).connect()
    return str(raised.value)


def test_silence_nonsense_and_our_own_echo_are_no_orb(peer: Peer, ears: Ears) -> None:
    silent, babbling = peer(lambda data: b""), peer(lambda data: b"AT+OK\r\n\0" * 3)
    other = "sends bytes, but not the OrbTouch protocol; name the orb's own port with --link"
    sentences = {
        silent: f"opened {silent}, but no OrbTouch answered within 2 s; switch the orb on, or "
        "name its own port with --link",
        babbling: f"{babbling} {other}",
        "loop://": f"loop:// {other}",
    }
    listening = {}
    for url in sentences:
        listening[url] = ears(Receiver(partial(open_transport, url)))
        listening[url].receiver.start()
    for url, ear in listening.items():
        assert ear.next(Refused) == Refused(sentences[url])
        assert ear.receiver.state == "connecting"


def test_a_key_has_to_be_the_same_at_both_ends(ears: Ears) -> None:
    link: Any = open_link("listen://127.0.0.1:0", welcome(), key=bytes(32))
    for key, sentence in (
        (b"", "the orb needs a key; add --key"),
        (bytes(range(32)), "has another key"),
    ):
        with pytest.raises(LinkError, match=sentence):
            Receiver(lambda: open_transport(link.url), key=key).connect()
    ear = ears(Receiver(lambda: open_transport(link.url), key=bytes(32)))
    assert ear.receiver.connect() == welcome()
    link.wait(DEADLINE_S)
    assert [type(request) for request in link.poll()] == [Hello]
    link.send(Command("drop", "pinch", 0.5, None, 1), 0)
    assert ear.message(Command).name == "drop"
    link.close()


def test_a_port_that_closes_before_an_orb_answers_is_explained() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"socket://127.0.0.1:{server.getsockname()[1]}"
        threading.Thread(target=lambda: server.accept()[0].close(), daemon=True).start()
        assert failure(url).startswith(f"{url} was cut off before an OrbTouch answered; name")


def test_an_orb_that_is_taken_refuses_and_comes_when_it_is_free(ears: Ears) -> None:
    link: Any = open_link("listen://127.0.0.1:0", welcome())
    first = Receiver(lambda: open_transport(link.url))
    first.connect()
    ear = ears(Receiver(lambda: open_transport(link.url)))
    ear.receiver.start()
    assert "already connected to another host" in ear.next(Refused).reason
    first.close()
    ear.next(Connected)
    link.close()


def test_pauses_grow_with_failures_until_a_connection(ears: Ears, monkeypatch: Patch) -> None:
    link: Any = open_link("listen://127.0.0.1:0", welcome())
    failures: list[int] = []

    def pause_s(failed: int, jitter: float) -> float:
        failures.append(failed)
        return 0.01

    monkeypatch.setattr(receiver_module, "pause_s", pause_s)
    attempts = iter((False, False, True))

    def attempt() -> Transport:
        if next(attempts, False):
            return open_transport(link.url)
        raise LinkError("there is no orb")

    ear = ears(Receiver(attempt))
    ear.receiver.start()
    ear.next(Connected)
    link.close()
    ear.next(Lost)
    ear.next(Refused)
    assert failures[:3] == [1, 2, 0]


# --- ports that do not open ---


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("/dev/ttyNONE", "there is no such port"),
        ("0.0.0.0:4000", "an address in a network is written socket://0.0.0.0:4000"),
        ("/", "it is not a serial port"),
        ("socket://x:y", "expected is socket://ADDRESS:PORT"),
        ("foo://x", "invalid URL, protocol 'foo' not known"),
    ],
)
def test_a_port_that_cannot_be_opened_is_explained(url: str, reason: str) -> None:
    assert failure(url) == f"cannot open {url}: {reason}; name another with --link"


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (PermissionError(errno.EACCES, "Permission denied"), "you may not; join the"),
        (serial.SerialException(errno.EBUSY, "could not open port"), "another program uses it"),
        (OSError(errno.EHOSTDOWN, "Host is down"), "it does not answer; check the address"),
        # as pyserial says it on Windows
        (
            serial.SerialException("could not open port 'COM9': FileNotFoundError(2, 'The system"),
            "there is no such port",
        ),
        (
            serial.SerialException("could not open port 'COM3': PermissionError(13, 'Access is"),
            "another program uses it",
        ),
        (socket.gaierror(-2, "Name or service not known"), "[Errno -2] Name or service not"),
        (RuntimeError("something\nelse"), "something else"),
    ],
)
def test_every_error_has_words(error: Exception, reason: str) -> None:
    assert why(error).startswith(reason)


# --- an orb of our own ---


def python(code: str) -> tuple[str, ...]:
    return (sys.executable, "-c", code)


STARTS_NOT = "the virtual orb does not start, it "


@pytest.mark.parametrize(
    ("code", "sentence"),
    [
        (
            "raise SystemExit('the bundle is\\nmissing')",
            "ended with status 1: the bundle is missing",
        ),
        ("input()", "does not say where it is: it left no message"),
        *(
            (f"print({line!r}, flush=True)", "")
            for line in ("", "hello", "[]", "{}", "{" * 100_000)
        ),
    ],
)
def test_an_orb_that_does_not_say_where_it_listens_is_ended(code: str, sentence: str) -> None:
    start_s = 0.1 if code == "input()" else START_S
    device = VirtualOrbProcess(1, command=python(code), start_s=start_s)
    with pytest.raises(LinkError, match=STARTS_NOT + sentence):
        device.open()
    assert device.process is None
    device.close()


def test_options_that_an_orb_does_not_know_are_told_without_all_that_it_knows() -> None:
    device = VirtualOrbProcess(1, ("--presett", "nominal"))
    told = r"status 2: unrecognized arguments: --presett nominal; did you mean --preset\?$"
    with pytest.raises(LinkError, match=told):
        device.open()


def test_an_orb_that_ignores_the_request_to_end_is_killed(monkeypatch: Patch) -> None:
    monkeypatch.setattr("host.connection.virtual_orb.END_S", 0.1)
    code = (
        "import json, signal, sys;"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN);"
        "print(json.dumps({'listening': 'loop://'}), flush=True);"
        "sys.stdin.read(); signal.pause()"
    )
    device = VirtualOrbProcess(1, command=python(code))
    device.open().close()
    process = device.process
    assert process is not None
    device.close()
    assert process.returncode == -signal.SIGKILL
    with pytest.raises(LinkError, match="switched off"):
        device.open()


def test_an_orb_that_talks_on_is_never_made_to_wait(device: VirtualOrbProcess) -> None:
    code = (
        "import json, os, sys;"
        "print(json.dumps({'listening': 'loop://'}), flush=True);"
        "sys.stdout.write('x' * 1_000_000); sys.stdout.flush(); os._exit(7)"
    )
    talker = VirtualOrbProcess(1, command=python(code))
    talker.open().close()
    assert talker.process is not None
    assert talker.process.wait(DEADLINE_S) == 7
    talker.close()


def test_the_last_words_of_an_orb_that_dies_are_seen(caplog: pytest.LogCaptureFixture) -> None:
    code = "import json; print(json.dumps({'listening': 'loop://'}), flush=True); 1 / 0"
    device = VirtualOrbProcess(1, command=python(code))
    device.open().close()
    assert device.process is not None
    device.process.wait(DEADLINE_S)
    device.open().close()
    device.close()
    [record] = caplog.records
    assert record.levelname == "ERROR"
    assert "the virtual orb ended with status 1" in caplog.text
    assert "ZeroDivisionError: division by zero" in caplog.text


def test_an_orb_of_our_own_hears_of_our_end_from_its_input(device: VirtualOrbProcess) -> None:
    device.open().close()
    assert device.process is not None
    assert device.process.stdin is not None
    device.process.stdin.close()  # what the system does when we are killed
    assert device.process.wait(DEADLINE_S) == 0


# --- the receiver's own limits ---


class Scripted(_Polled):
    """A transport that says what it is given."""

    name = "script"

    def __init__(self) -> None:
        self.chunks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self.commands = self.written = 0

    def read(self, timeout_s: float) -> bytes:
        try:
            return self.chunks.get(timeout=min(timeout_s, 0.05))
        except queue.Empty:
            return b""

    def write(self, data: bytes) -> None:
        self.written += len(data)
        for packet in Decoder().feed(data):
            if isinstance(packet.message, Hello):
                self.sequence = packet.sequence
                self.say(messages.Offer(messages.VERSION, bytes(16), False))
            elif isinstance(packet.message, messages.Join):
                self.say(welcome())

    def say(self, message: messages.Message) -> None:
        travelling = message
        if isinstance(message, Command):
            self.commands += 1
            travelling = numbered(message, self.commands)
        self.chunks.put(encode(travelling, session=1, sequence=self.sequence, t_ms=0))
        self.sequence = (self.sequence + 1) & 0xFFFF

    def wake(self) -> None:
        pass

    def close(self) -> None:
        pass


def test_commands_and_contacts_that_a_busy_program_left_are_too_late(
    ears: Ears, monkeypatch: Patch
) -> None:
    transport = Scripted()
    ear = ears(Receiver(lambda: transport))
    ear.receiver.connect()
    transport.say(Command("drop", "pinch", 0.5, None, 1))
    transport.say(State(("down",)))
    ear.until(lambda news: news == Delivered(State(("down",)), 0))
    assert ear.frames() == [[1]]
    transport.say(Command("drop", "pinch", 0.5, None, 2))
    transport.say(ContactState(3, fingers=1))
    transport.say(State(()))
    monkeypatch.setattr(receiver_module, "LATE_MS", -1)  # so anything has waited too long
    ear.until(lambda news: news == Delivered(State(()), 0))
    assert (ear.frames(), ear.receiver.past.missed) == ([[1]], 1)
    told = [news for _, news in ear.told]
    assert receiver_module.Missed(1) in told
    assert not [one for one in told if isinstance(getattr(one, "message", None), ContactState)]
    assert 0 < ear.receiver.bytes_sent <= transport.written
    assert ear.receiver.bytes_received > 0


def test_a_listener_gets_what_is_polled_when_an_item_is_of_its_kind(ears: Ears) -> None:
    transport, heard = Scripted(), list[Sequence[receiver_module.Received]]()
    ear = ears(Receiver(lambda: transport))
    ear.receiver.subscribe(heard.append, Connected)
    ear.receiver.connect()
    ear.next(Connected)
    transport.say(State(("down",)))
    ear.until(lambda news: news == Delivered(State(("down",)), 0))
    assert [type(items[0]) for items in heard] == [Connected]


@pytest.mark.parametrize(("drawn", "nonce"), [(1.0, 2**32 - 1), (0.0, 1)])
def test_the_nonce_of_a_host_fills_32_bits_and_is_never_0(
    drawn: float, nonce: int, monkeypatch: Patch
) -> None:
    monkeypatch.setattr("secrets.randbits", lambda bits: int(drawn * (2**bits - 1)))
    receiver = Receiver(Scripted)
    assert receiver.past.host_nonce == nonce
    receiver.past = SessionHistory(host_nonce=7)
    receiver.reopen(Scripted)
    assert receiver.past.host_nonce == nonce


def test_a_program_that_listens_no_more_costs_no_memory(ears: Ears, monkeypatch: Patch) -> None:
    monkeypatch.setattr(receiver_module, "INBOX", 10)
    transport = Scripted()
    ear = ears(Receiver(lambda: transport))
    ear.receiver.connect()
    for number in range(50):
        transport.say(State(("down",) if number % 2 else ()))
    end_s = time.monotonic() + DEADLINE_S
    while ear.receiver.state != "lost" and time.monotonic() < end_s:
        time.sleep(0.001)
    told = ear.receiver.poll()
    assert len(told) <= 13
    assert told[-1] == Lost("the program did not listen to the orb any more")


def test_a_mistake_in_the_receivers_thread_is_seen(ears: Ears) -> None:
    def fail() -> Transport:
        raise ZeroDivisionError

    ear = ears(Receiver(fail))
    for ask in (ear.receiver.connect, ear.receiver.poll):
        with pytest.raises(RuntimeError, match="thread has died") as raised:
            ask()
        assert isinstance(raised.value.__cause__, ZeroDivisionError)


def test_another_device_is_connected_when_it_is_chosen(
    device: VirtualOrbProcess, ears: Ears
) -> None:
    other = VirtualOrbProcess(2, command=(*DEVICE, "listen://127.0.0.1:0"))
    ear = ears(Receiver(device.open, token=device.token))
    ear.receiver.connect()
    ear.message(Command)
    ear.receiver.reopen(other.open, token=other.token)
    assert ear.next(Lost) == Lost("another orb was chosen")
    ear.next(Connected)
    ear.message(Command)
    assert other.process is not None
    other.close()


def test_another_device_is_chosen_while_the_first_does_not_answer(
    device: VirtualOrbProcess, ears: Ears
) -> None:
    waiting, go_on = threading.Event(), threading.Event()

    def hang() -> Transport:
        waiting.set()
        go_on.wait(DEADLINE_S)
        raise LinkError("no orb answers")

    ear = ears(Receiver(hang))
    ear.receiver.start()
    assert waiting.wait(DEADLINE_S)
    ear.receiver.reopen(device.open, token=device.token)
    go_on.set()
    ear.next(Connected)
    assert not any(isinstance(news, Refused) for _, news in ear.told)


def test_only_a_first_connection_that_is_refused_ends_the_program() -> None:
    refused = receiver_module.Refused("the orb is taken")
    assert not receiver_module.ever_connected([], before=False)
    assert receiver_module.ever_connected([], before=True)
    assert receiver_module.ever_connected([Lost("cut")], before=False)
    assert receiver_module.ever_connected([refused], before=True)
    with pytest.raises(LinkError, match="the orb is taken"):
        receiver_module.ever_connected([refused], before=False)
