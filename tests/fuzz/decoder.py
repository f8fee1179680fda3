"""The decoder: the same packets however the bytes are cut, and no more memory than a frame.

The first byte says what the others are: bytes of the wire, or bodies that get a frame with a valid
checksum, so that the readers of payloads are reached, too. Another of its bits gives the decoder a
key, without which nothing may then be taken.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable

from controller.shared.protocol import codec, teaching
from controller.shared.protocol import messages as m
from controller.shared.protocol.auth import FrameAuthenticator
from controller.shared.protocol.packets import MAX_FRAME, Decoder, Packet, encode

from .choices import Choices

DICTIONARY: tuple[bytes, ...] = (b"\0", b"\x10\x01", b"\x10\x02", b"\x10\x12", b"\xff\xff")
MESSAGES: tuple[m.Message, ...] = (
    m.Hello(2, 2, "token", "host", False),
    m.Offer(2, bytes(range(16)), True),
    m.Join("token", "host", False, 77, 7, 3),
    m.Welcome(
        *(2, 7, "virtual-1", "Orb", True, 5, 5, 10.0, 10.0, 100, 300),
        *(("null", "press"), ("left",), True, 3),
    ),
    m.Refuse("another host is there"),
    m.Bye("the host was closed"),
    m.Heartbeat(1000, 900, 5, 3, ("down",)),
    m.HostHeartbeat(1000, 900, 5, 3, 1),
    m.NumberedCommand("drop", "pinch", 0.9, (2.0, 1.5), 17, 4, 3, 900),
    m.State(("down",)),
    m.Telemetry(3, bytes([128] * 25), (1.0, 0.0), (1.0, 2.0), "press", True, 10.0),
    m.GroundTruth(1, "press", 100, 600),
    m.Contacts((m.Contact(1, 2.0, 2.0, 5.0, 6.0),)),
    m.Perform(2, "pinch", 2.0, 2.0),
    m.Grant(500),
    teaching.ExampleStart(7, "swipe"),
    teaching.Learn("swipe", "hold", "half", True, "ann"),
    teaching.Vocabulary(("null", "swipe"), ("hold",), "mine", True, 1, "/data"),
    teaching.GestureInfo(
        "swipe", "swipe", True, 5, bytes(25), (teaching.CommandRule("hold", 1.0, 0.0, 2.0, 1.0),)
    ),
    teaching.ExampleTaken(7, "swipe", True, "", 0.5, bytes(25)),
    teaching.LearnStatus(1, 1.0, "learned", (1.0, 1.0)),
)
OPEN: tuple[type, ...] = (m.Hello, m.Refuse)  # what is taken without the key
_KEY = bytes(range(32))


def seeds() -> Iterable[bytes]:
    """Return inputs to begin with: every kind of message, as bytes of the wire and as a body."""
    for number, message in enumerate(MESSAGES):
        frame = encode(message, session=1, sequence=number, t_ms=1000 * number)
        yield b"\0\7" + frame
        body = codec.cobs_decode(frame[:-1])[:-4]
        yield b"\1\5" + len(body).to_bytes(2, "little") + body


def one(data: bytes) -> None:
    """Raise AssertionError if bytes at once and piece by piece differ, or too much is kept."""
    choices = Choices(data)
    how, step = choices.number(), choices.number() % 64 + 1
    stream = _framed(choices) if how & 1 else choices.rest()
    whole, pieces = Decoder(), Decoder()
    if how & 2:
        whole.seal, pieces.seal = FrameAuthenticator(_KEY, 0), FrameAuthenticator(_KEY, 0)
    packets = whole.feed(stream)
    found: list[Packet] = []
    for at in range(0, len(stream), step):
        found += pieces.feed(stream[at : at + step])
        assert _remembers(pieces) <= MAX_FRAME
    assert found == packets
    assert pieces.feed(b"\0") == whole.feed(b"\0")
    for packet in packets:
        if packet.message is None:
            assert packet.version != m.VERSION or how & 2
        else:
            assert not how & 2 or isinstance(packet.message, OPEN), "taken without the key"
            _there_and_back(packet, packet.message)


def _framed(choices: Choices) -> bytes:
    """Return bodies, each behind its length, with checksums and as frames."""
    stream = b""
    while choices.left:
        body = choices.octets(choices.number(2) % 1200)
        stream += codec.cobs_encode(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0"
    return stream


def _there_and_back(packet: Packet, message: m.Message) -> None:
    """What was read can be written, and is then read as the same."""
    session, sequence, t_ms = packet.session, packet.sequence, packet.t_ms
    frame = encode(message, session=session, sequence=sequence, t_ms=t_ms)
    assert len(frame) - 1 <= MAX_FRAME
    again = Decoder().feed(frame)
    assert again == [packet._replace(version=m.VERSION)]


def _remembers(decoder: Decoder) -> int:
    """Return how many bytes a decoder keeps until the next call."""
    return sum(
        len(value) for value in vars(decoder).values() if isinstance(value, bytes | bytearray)
    )
