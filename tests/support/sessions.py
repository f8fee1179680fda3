"""Ends of the conversation for tests, without ports and clocks: bytes and milliseconds go in."""

import dataclasses

from controller.shared.protocol.device_session import DeviceSession
from controller.shared.protocol.host_session import HostSession
from controller.shared.protocol.link_events import Received
from controller.shared.protocol.messages import (
    VERSION,
    Command,
    ContactState,
    Hello,
    HostHeartbeat,
    Join,
    Message,
    Telemetry,
)
from controller.shared.protocol.packets import NEVER, Decoder, Packet, encode
from controller.shared.protocol.retransmit import RetransmitQueue
from tests.support.fake_device import welcome
from tests.support.manual_host import JOIN

DROP = Command("drop", "pinch", 0.5, None, 1)
FRAME = Telemetry(1, bytes(25), (1.0,), None, "", True, 10.0)
ALIVE = HostHeartbeat(0, 0, NEVER, 0, 0)
FINGER = ContactState(7, 2.0, 1.5, 0.0625, 6.0, 0.5, 1, 0.875)


def said(session: DeviceSession | HostSession) -> list[Packet]:
    """Return what a session has sent, and take it."""
    packets = Decoder().feed(bytes(session.output))
    session.output.clear()
    return packets


def greet(
    session: DeviceSession, *, sequence: int, now_ms: int = 0, join: Join = JOIN
) -> list[Message]:
    """Let a session hear Hello and Join; what it hears next is of sequence + 2."""
    ended = heard(session, Hello(VERSION, VERSION, "", "", False), sequence=sequence, now_ms=now_ms)
    return ended + heard(session, join, sequence=(sequence + 1) & 0xFFFF, now_ms=now_ms)


def heard(session: DeviceSession, message: Message, *, sequence: int, now_ms: int) -> list[Message]:
    """Let a session hear one packet of its present session."""
    number = 0 if isinstance(message, Hello) else session.number
    data = encode(message, session=number, sequence=sequence, t_ms=now_ms)
    return session.receive(data, now_ms)


class Pair:
    """A device and a host with a perfect line between them, and one clock."""

    def __init__(self, *, granted: bool = False, token: str = "", deadman_ms: int = 300) -> None:
        self.now_ms = 1000
        self.device = DeviceSession(
            dataclasses.replace(welcome(), deadman_ms=deadman_ms), token=token
        )
        self.host = HostSession("orb", 65_000, self.now_ms, token=token, granted=granted)
        self.requests: list[Message] = []
        self.news: list[Received] = []

    def exchange(self) -> list[Received]:
        """Carry everything both ways until nothing is left; return the host's news."""
        news: list[Received] = []
        while self.host.output or self.device.output:
            data = bytes(self.host.output)
            self.host.output.clear()
            self.requests += self.device.receive(data, self.now_ms)
            data = bytes(self.device.output)
            self.device.output.clear()
            news += self.host.receive(data, self.now_ms)
        return news

    def let(self, pass_ms: int) -> list[Received]:
        """Let time pass for both, in steps of 10 ms; return the host's news."""
        news: list[Received] = []
        for _ in range(pass_ms // 10):
            self.now_ms += 10
            self.requests += self.device.tick(self.now_ms)
            news += self.host.tick(self.now_ms)
            news += self.exchange()
        return news

    def meet_again(self, *, nonce: int = 7) -> list[Received]:
        """Connect anew; a device with another nonce has been switched off and on."""
        past, box = self.host.past, self.device.outbox
        if nonce != 7:
            box = RetransmitQueue()
        self.device.end("cut")
        self.device = DeviceSession(welcome(nonce=nonce), outbox=box, number=50)
        self.host = HostSession("orb", 9, self.now_ms, past=past)
        return self.exchange()


def greeted() -> DeviceSession:
    """Return a live session of a device; the host's next sequence number is 3."""
    session = DeviceSession(welcome())
    greet(session, sequence=1)
    return session


def met(*, granted: bool = False) -> Pair:
    """Return a device and a host in a live session."""
    pair = Pair(granted=granted)
    pair.exchange()
    return pair
