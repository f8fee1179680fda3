"""A host played by hand at the end of a byte stream, packet by packet; it sends no heartbeats."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from controller.shared.protocol.auth import FrameAuthenticator, seals
from controller.shared.protocol.messages import (
    VERSION,
    Command,
    Heartbeat,
    Hello,
    Join,
    Message,
    NumberedCommand,
    Offer,
)
from controller.shared.protocol.packets import Decoder, Packet, encode

HELLO = Hello(VERSION, VERSION, "", "a test", False)  # as the device's program is told of it
JOIN = Join("", "a test", False, host_nonce=77, boot_nonce=0, done=0)


class HandMadeHost:
    """The host's end of a byte stream; b"" is its end; the key seals if the device asks for it."""

    def __init__(
        self, read: Callable[[], bytes], write: Callable[[bytes], Any], key: bytes = b""
    ) -> None:
        self._read, self._write, self._key = read, write, key
        self.decoder = Decoder()
        self._packets: list[Packet] = []
        self._seal: FrameAuthenticator | None = None
        self.session = 0
        self.sequence = 100
        self.close: Callable[[], None] = lambda: None

    def write(self, data: bytes) -> None:
        """Write bytes that are no packet."""
        self._write(data)

    def say(self, message: Message) -> None:
        self.sequence += 1
        numbers = {"session": self.session, "sequence": self.sequence}
        self._write(encode(message, **numbers, t_ms=0, seal=self._seal))

    def greet(self, join: Join = JOIN, *, versions: tuple[int, int] = (VERSION, VERSION)) -> Any:
        """Say Hello and Join, and return the last answer: Welcome or Refuse."""
        self.session, self._seal, self.decoder.seal = 0, None, None
        self._write(b"\0")
        hello = Hello(*versions, f"{self.sequence:032x}", "", False)
        self.say(hello)
        packet = self.packet()
        if isinstance(packet.message, Offer):
            self.session = packet.session
            if packet.message.keyed and self._key:
                self._seal, self.decoder.seal = seals(
                    self._key, versions=versions, host=hello.token.encode(),
                    device=packet.message.nonce, session=packet.session, sequence=self.sequence,
                )  # fmt: skip
            self.say(join)
            packet = self.packet()
        return packet.message

    def packet(self) -> Packet:
        """Return the next packet that is no heartbeat; raise EOFError at the end."""
        while True:
            while not self._packets:
                data = self._read()
                if not data:
                    raise EOFError
                self._packets += self.decoder.feed(data)
            packet = self._packets.pop(0)
            if not isinstance(packet.message, Heartbeat):
                return packet

    def message(self) -> Message | None:
        return self.packet().message


def numbered(
    command: Command, number: int = 1, done: int | None = None, sent_ms: int = 0
) -> NumberedCommand:
    """Return a command as it travels, with none before it that is still to come."""
    done = number - 1 if done is None else done
    c = command
    return NumberedCommand(c.name, c.label, c.probability, c.touch, c.frame, number, done, sent_ms)


def plain(message: Message | None) -> Message | None:
    """Return a message, and a command as it was before it travelled."""
    if not isinstance(message, NumberedCommand):
        return message
    m = message
    return Command(m.name, m.label, m.probability, m.touch, m.frame)
