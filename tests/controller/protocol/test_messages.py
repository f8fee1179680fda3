"""The wire: every message there and back, and nothing at all out of noise."""

import random
import re
import zlib
from dataclasses import replace
from typing import Any

import pytest
from cobs import cobs as oracle
from hypothesis import example, given, settings
from hypothesis import strategies as st

from controller.protocol import codec
from controller.protocol import messages as protocol
from controller.protocol.codec import ProtocolError, image_from_bytes, quantise_image
from controller.protocol.messages import (
    MAX_PAYLOAD,
    PIECE,
    VERSION,
    Bye,
    Command,
    Contact,
    Contacts,
    Correction,
    Grant,
    Granted,
    GroundTruth,
    Health,
    Heartbeat,
    Hello,
    HostHeartbeat,
    Join,
    LatencyReport,
    Message,
    NumberedCommand,
    Offer,
    Perform,
    PositionUncertainty,
    Refuse,
    StageTime,
    State,
    Telemetry,
    UploadChunk,
    UploadOffer,
    UploadStatus,
    UserIdentified,
    Welcome,
)
from controller.protocol.packets import MAX_FRAME, Decoder, Packet, encode, is_ahead
from tests.support import ROOT

u8, u16, u32 = (st.integers(0, 2**bits - 1) for bits in (8, 16, 32))
size, span = st.integers(1, 255), st.integers(1, 65535)
f32 = st.floats(width=32, allow_nan=False, allow_infinity=False)
share = st.floats(0, 1, width=32)
point = st.none() | st.tuples(f32, f32)
printable = st.characters(categories=("L", "N", "P", "S"), include_characters=" ")


def text(limit: int) -> st.SearchStrategy[str]:
    return st.text(printable, max_size=limit).filter(lambda value: len(value.encode()) <= limit)


name, reason = text(40), text(500)
names = st.lists(text(8), max_size=40).map(tuple)
shares = st.lists(u8.map(lambda value: value / 255.0), max_size=8).map(tuple)
hop = st.builds(StageTime, name, f32, f32, f32)
contact = st.builds(Contact, u16, f32, f32, f32, f32)
MESSAGES: dict[type, st.SearchStrategy[Message]] = {
    Hello: st.builds(Hello, u8, u8, text(64), text(64), st.booleans()),
    Welcome: st.builds(
        Welcome, u8, u32, text(64), text(64), st.booleans(), size, size, f32, f32, span, span,
        names, names, st.booleans(), u32,
    ),
    Refuse: st.builds(Refuse, reason),
    Bye: st.builds(Bye, reason),
    Heartbeat: st.builds(Heartbeat, u32, u32, u32, u32, names),
    Offer: st.builds(Offer, u8, st.binary(max_size=32), st.booleans()),
    NumberedCommand: st.builds(NumberedCommand, name, name, share, point, u32, u32, u32, u32),
    State: st.builds(State, names),
    Telemetry: st.builds(
        Telemetry, u32, st.binary(max_size=900), shares, point, name, st.booleans(), f32
    ),
    GroundTruth: st.builds(GroundTruth, u32, name, u32, u32),
    Granted: st.builds(Granted, u32),
    Health: st.builds(Health, st.lists(text(120), max_size=8).map(tuple)),
    PositionUncertainty: st.builds(PositionUncertainty, u32, st.floats(0.0, 100.0, width=32)),
    Contacts: st.builds(Contacts, st.lists(contact, max_size=16).map(tuple)),
    Perform: st.builds(Perform, u32, name, f32, f32),
    Grant: st.builds(Grant, u32),
    Join: st.builds(
        Join, text(64), text(64), st.booleans(), st.integers(1, 2**32 - 1), u32, u32
    ),
    HostHeartbeat: st.builds(HostHeartbeat, u32, u32, u32, u32, u32),
    UploadStatus: st.builds(UploadStatus, u8, u32, reason),
    LatencyReport: st.builds(LatencyReport, f32, u32, st.lists(hop, max_size=16).map(tuple)),
    UserIdentified: st.builds(UserIdentified, name, share),
    UploadOffer: st.builds(UploadOffer, st.binary(max_size=32), u32, text(64)),
    UploadChunk: st.builds(UploadChunk, u32, st.binary(max_size=PIECE)),
    Correction: st.builds(Correction, name),
}  # fmt: skip
messages = st.one_of(*MESSAGES.values())

WELCOME = Welcome(
    1, 7, "A1", "OrbTouch", False, 5, 5, 10.0, 1.0, 100, 300, ("null", "press"), ("down",), True, 6
)  # fmt: skip

# One packet of each kind before COBS and checksum: version 2 and flags 0, type, session 1,
# sequence 2, t_ms 3, then the payload, field by field. Read it beside the specification.
GOLDEN: list[tuple[Message, str]] = [
    (
        Hello(1, 1, "key", "host", True),  # written as ever: its layout never changes
        "20 01 0100 0200 03000000  01 01 03 6b6579 04 686f7374 01",
    ),
    (
        WELCOME,
        "20 02 0100 0200 03000000  01 07000000 02 4131 08 4f7262546f756368 00 05 05 00002041"
        "0000803f 6400 2c01  02 04 6e756c6c 05 7072657373  01 04 646f776e 01 06000000",
    ),
    (Refuse("no"), "20 03 0100 0200 03000000  0200 6e6f"),
    (Bye("off"), "20 04 0100 0200 03000000  0300 6f6666"),
    (
        Heartbeat(258, 1, 2, 3, ("down",)),
        "20 05 0100 0200 03000000  02010000 01000000 02000000 03000000 01 04 646f776e",
    ),
    (Offer(2, b"\1\2", True), "20 06 0100 0200 03000000  02 02 0102 01"),
    (
        NumberedCommand("left", "press", 0.5, (1.0, 2.0), 9, 7, 6, 258),
        "20 10 0100 0200 03000000  04 6c656674 05 7072657373 0000003f 01 0000803f 00000040"
        "09000000 07000000 06000000 02010000",
    ),
    (State(("left", "down")), "20 11 0100 0200 03000000  02 04 6c656674 04 646f776e"),
    (
        Telemetry(9, b"\x80\x7f", (1.0, 0.0), None, "press", True, 10.0),
        "20 12 0100 0200 03000000  09000000 0200 807f 02 ff00 00 05 7072657373 01 00002041",
    ),
    (
        GroundTruth(4, "press", 1000, 1500),
        "20 13 0100 0200 03000000  04000000 05 7072657373 e8030000 dc050000",
    ),
    (Granted(100), "20 14 0100 0200 03000000  64000000"),
    (Health(("pump", "row 1")), "20 15 0100 0200 03000000  02 04 70756d70 05 726f772031"),
    (PositionUncertainty(9, 0.5), "20 19 0100 0200 03000000  09000000 0000003f"),
    (
        Contacts((Contact(1, 2.0, 3.0, 4.0, 5.0),)),
        "20 20 0100 0200 03000000  01 0100 00000040 00004040 00008040 0000a040",
    ),
    (
        Perform(4, "press", 1.0, 2.0),
        "20 21 0100 0200 03000000  04000000 05 7072657373 0000803f 00000040",
    ),
    (Grant(100), "20 22 0100 0200 03000000  64000000"),
    (
        Join("key", "host", True, 1, 2, 3),
        "20 23 0100 0200 03000000  03 6b6579 04 686f7374 01 01000000 02000000 03000000",
    ),
    (
        HostHeartbeat(258, 1, 2, 3, 4),
        "20 24 0100 0200 03000000  02010000 01000000 02000000 03000000 04000000",
    ),
    (UploadStatus(2, 258, "ok"), "20 16 0100 0200 03000000  02 02010000 0200 6f6b"),
    (
        LatencyReport(100.0, 7, (StageTime("scan", 1.0, 1.0, 2.0),)),
        "20 17 0100 0200 03000000  0000c842 07000000 01 04 7363616e 0000803f 0000803f 00000040",
    ),
    (UserIdentified("ann", 1.0), "20 18 0100 0200 03000000  03 616e6e 0000803f"),
    (
        UploadOffer(b"\1\2", 258, "my.orb"),
        "20 30 0100 0200 03000000  02 0102 02010000 06 6d792e6f7262",
    ),
    (UploadChunk(258, b"\1\2"), "20 31 0100 0200 03000000  02010000 0200 0102"),
    (Correction("pinch"), "20 32 0100 0200 03000000  05 70696e6368"),
]


def frame(body: bytes) -> bytes:
    """Return a body as a frame, with the right checksum, by the oracle's COBS."""
    framed: bytes = oracle.encode(body + zlib.crc32(body).to_bytes(4, "little"))
    return framed + b"\0"


def packet(message: Message) -> Packet:
    return Packet(session=1, sequence=2, t_ms=3, version=VERSION, message=message)


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
def test_every_message_arrives_as_it_was_sent(kind: type) -> None:
    @settings(max_examples=60, deadline=None)
    @given(MESSAGES[kind], u16, u16, u32)
    def there_and_back(message: Message, session: int, sequence: int, t_ms: int) -> None:
        data = encode(message, session=session, sequence=sequence, t_ms=t_ms)
        assert data.count(0) == 1
        assert data.endswith(b"\0")
        assert len(data) <= MAX_FRAME + 1
        assert Decoder().feed(data) == [Packet(session, sequence, t_ms, VERSION, message)]

    there_and_back()


def test_every_message_is_tried_and_has_its_golden_bytes() -> None:
    # A command travels as Numbered, which all programs but the two sessions do not see.
    assert {*MESSAGES, Command} == {*protocol.TYPES, Command}
    assert [type(message) for message, _ in GOLDEN] == list(MESSAGES)


@pytest.mark.parametrize(("message", "body"), GOLDEN, ids=lambda value: type(value).__name__)
def test_the_bytes_of_each_message_are_these(message: Message, body: str) -> None:
    data = frame(bytes.fromhex(body))
    assert encode(message, session=1, sequence=2, t_ms=3) == data
    assert Decoder().feed(data) == [packet(message)]


def test_a_whole_frame_on_the_wire_is_this() -> None:
    # Each zero of header, payload and checksum is the distance to the next zero.
    data = "04 202201 02 02 02 03 01 01 03 0201 01 05 acc6e975 00"
    assert encode(Grant(258), session=1, sequence=2, t_ms=3) == bytes.fromhex(data)


@settings(deadline=None)
@given(st.binary(max_size=1200) | st.integers(0, 1100).map(lambda size: b"\x11" * size))
@example(b"\x11" * 253)
@example(b"\x11" * 254)
@example(bytes(range(1, 255)) * 2)
def test_cobs_agrees_with_its_oracle(data: bytes) -> None:
    assert codec.cobs_encode(data) == oracle.encode(data)
    assert codec.cobs_decode(codec.cobs_encode(data)) == data


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=600).map(lambda data: data.replace(b"\0", b"")))
def test_cobs_refuses_what_its_oracle_refuses(data: bytes) -> None:
    try:
        expected = oracle.decode(data)
    except oracle.DecodeError:
        with pytest.raises(ProtocolError):
            codec.cobs_decode(data)
    else:
        assert codec.cobs_decode(data) == expected


@settings(deadline=None)
@given(st.lists(messages, min_size=1, max_size=5), st.data())
def test_a_stream_can_be_cut_anywhere(sent: list[Message], data: st.DataObject) -> None:
    stream = b"".join(encode(message, session=1, sequence=2, t_ms=3) for message in sent)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    decoder = Decoder()
    received = []
    for begin, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        received += decoder.feed(stream[begin:end])
    assert received == [packet(message) for message in sent]


@settings(deadline=None)
@given(st.lists(st.tuples(messages, st.binary(max_size=40)), max_size=5))
def test_noise_between_packets_costs_no_packet_that_follows_a_zero(
    sent: list[tuple[Message, bytes]],
) -> None:
    stream = b"".join(
        noise + b"\0" + encode(message, session=1, sequence=2, t_ms=3) for message, noise in sent
    )
    assert Decoder().feed(stream) == [packet(message) for message, _ in sent]


def test_one_wrong_bit_anywhere_never_gives_a_packet() -> None:
    command = NumberedCommand("drop", "pinch", 0.9, (1.0, 2.0), 9, 1, 0, 0)
    data = encode(command, session=1, sequence=2, t_ms=3)
    for bit in range(8 * len(data)):
        wrong = bytearray(data)
        wrong[bit // 8] ^= 1 << bit % 8
        assert Decoder().feed(bytes(wrong) + b"\0") == [], f"bit {bit}"


def test_a_cut_frame_never_gives_a_packet() -> None:
    data = encode(
        NumberedCommand("drop", "pinch", 0.9, None, 9, 1, 0, 0), session=1, sequence=2, t_ms=3
    )
    for size in range(len(data) - 1):
        decoder = Decoder()
        assert decoder.feed(data[:size] + b"\0") == []


def test_ten_megabytes_of_noise_raise_nothing_and_command_nothing() -> None:
    noise = random.Random(1)
    decoder = Decoder()
    for _ in range(10):
        assert decoder.feed(noise.randbytes(1_000_000)) == []


def test_structured_noise_with_right_checksums_raises_nothing() -> None:
    # Past the checksum, too, every byte may be anything.
    noise = random.Random(2)
    decoder, refused = Decoder(), 0
    for _ in range(20_000):
        kind = noise.choice([*range(1, 7), *range(16, 21), *range(32, 37)])
        body = bytes([VERSION << 4, kind]) + noise.randbytes(noise.randrange(8, 60))
        found = decoder.feed(frame(body))
        refused += not found
        for received in found:
            assert received.message is not None
            again = encode(received.message, session=0, sequence=0, t_ms=0)
            assert Decoder().feed(again)[0].message == received.message
    assert refused > 10_000


def test_a_run_without_end_takes_no_memory_and_the_next_packet_is_read() -> None:
    decoder = Decoder()
    for _ in range(1000):
        assert decoder.feed(b"x" * 1000) == []
        assert len(decoder._tail) <= MAX_FRAME
    data = encode(Bye("off"), session=1, sequence=2, t_ms=3)
    assert decoder.feed(b"\0" + data) == [packet(Bye("off"))]


def test_the_largest_packet_fits_and_one_byte_more_does_not() -> None:
    def telemetry(labels: int) -> Telemetry:
        return Telemetry(0, bytes(900), (0.0,) * labels, None, "", True, 1.0)

    payload = len(bytes.fromhex("00000000 8403 00 00 00 01 0000803f")) + 900
    most = MAX_PAYLOAD - payload
    data = encode(telemetry(most), session=1, sequence=2, t_ms=3)
    assert Decoder().feed(data) == [packet(telemetry(most))]
    with pytest.raises(ProtocolError, match="1025 bytes"):
        encode(telemetry(most + 1), session=1, sequence=2, t_ms=3)
    assert Decoder().feed(frame(bytes.fromhex("20120100020003000000") + bytes(1025))) == []


SPECIFICATION = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
NAMES = ": u8 count <= 64, each text40"  # what the specification says that names are
SAMPLES: dict[str, Any] = {type(message).__name__: message for message, _ in GOLDEN}
SPECIFIED = {  # the payload of each message, as the specification's table has it
    kind: " ".join(payload.split())
    for kind, payload in re.findall(
        r"^    \d+ +(\w+) +(?:H|D|H,D) +(.+?)(?=^    [\d=])", SPECIFICATION, re.M | re.S
    )
}
TEXTS = [
    (kind, field, int(width))
    for kind, payload in SPECIFIED.items()
    for field, width in re.findall(r"(?<!each )\b(?!each\b)(\w+) (?:text|octets)(\d+)", payload)
]
LISTS = [
    (kind, field, int(count))
    for kind, payload in SPECIFIED.items()
    for field, count in re.findall(r"(\w+): u8 count <= (\d+)", payload.replace(" names", NAMES))
]
LISTED_TEXTS = [
    (kind, field, int(width))
    for kind, payload in SPECIFIED.items()
    for field, width in re.findall(r"(\w+): .*?each text(\d+)", payload.replace(" names", NAMES))
]


def fits(message: Message) -> bool:
    """Return whether a message arrives as it was sent; if not, sending it was refused."""
    try:
        data = encode(message, session=1, sequence=2, t_ms=3)
    except ProtocolError:
        return False
    return Decoder().feed(data) == [packet(message)]


def test_the_specification_says_how_long_every_text_and_every_list_may_be() -> None:
    values: dict[tuple[str, str], Any] = {
        (kind, field): getattr(message, field)
        for kind, message in SAMPLES.items()
        for field in message.__match_args__
    }
    del values["Telemetry", "image"], values["Telemetry", "probabilities"]  # kinds of their own
    texts = {place for place, value in values.items() if isinstance(value, (str, bytes))}
    lists = {place for place, value in values.items() if isinstance(value, tuple)}
    assert set(SPECIFIED) == set(SAMPLES)
    assert f"names is{NAMES[1:]}" in SPECIFICATION
    assert {(kind, field) for kind, field, _ in TEXTS} == texts
    assert {(kind, field) for kind, field, _ in LISTS} == lists - {("NumberedCommand", "touch")}


@pytest.mark.parametrize(("kind", "field", "size"), TEXTS + LISTS)
def test_a_text_or_list_fits_up_to_its_specified_size(kind: str, field: str, size: int) -> None:
    message = SAMPLES[kind]
    value = getattr(message, field)[:1]
    assert fits(replace(message, **{field: value * size}))
    assert not fits(replace(message, **{field: value * (size + 1)}))


@pytest.mark.parametrize(("kind", "field", "width"), LISTED_TEXTS)
def test_a_text_of_a_list_fits_up_to_its_width(kind: str, field: str, width: int) -> None:
    message: Any = SAMPLES[kind]
    assert fits(replace(message, **{field: ("x" * width,)}))
    assert not fits(replace(message, **{field: ("x" * (width + 1),)}))


def test_an_unknown_type_is_ignored() -> None:
    assert Decoder().feed(frame(bytes.fromhex("20 63 0100 0200 03000000 0102"))) == []


def test_compatible_flags_are_ignored_and_incompatible_ones_rejected() -> None:
    decoder = Decoder()
    body = "22 0100 0200 03000000 02010000"
    assert decoder.feed(frame(bytes.fromhex("23" + body))) == [packet(Grant(258))]
    assert decoder.feed(frame(bytes.fromhex("24" + body))) == []
    assert decoder.feed(frame(bytes.fromhex("28" + body))) == []


def test_of_a_foreign_version_only_hello_and_refuse_are_understood() -> None:
    def foreign(body: str) -> list[Packet]:
        return Decoder().feed(frame(bytes.fromhex(body)))

    assert foreign("10 05 0100 0200 03000000 02010000") == [Packet(1, 2, 3, 1, None)]
    assert foreign("30 63 0100 0200 03000000") == [Packet(1, 2, 3, 3, None)]
    assert foreign("30 03 0100 0200 03000000 0200 6e6f") == [Packet(1, 2, 3, 3, Refuse("no"))]
    hello = foreign("10 01 0000 0200 03000000 01 01 00 00 00")
    assert hello == [Packet(0, 2, 3, 1, Hello(1, 1, "", "", False))]


@pytest.mark.parametrize(
    "message",
    [
        Bye("two\nlines"),
        Bye("\x1b[2J"),
        Bye("x" * 501),
        Bye("\ud800"),
        Grant(-1),
        Grant(2**32),
        Command("left", "press", 0.5, None, 0),
        NumberedCommand("x" * 41, "", 0.5, None, 0, 1, 0, 0),
        NumberedCommand("left", "press", 1.5, None, 0, 1, 0, 0),
        NumberedCommand("left", "press", float("nan"), None, 0, 1, 0, 0),
        NumberedCommand("left", "press", 0.5, (float("inf"), 0.0), 0, 1, 0, 0),
        Offer(2, bytes(33), False),
        Join("", "", False, 0, 1, 2),
        Perform(1, "press", 1e39, 0.0),
        Telemetry(0, b"", (1.5,), None, "", True, 1.0),
        Telemetry(0, bytes(901), (), None, "", True, 1.0),
        Contacts((Contact(1, 0.0, 0.0, 0.0, 0.0),) * 17),
        State(("x",) * 65),
        Welcome(1, 1, "", "", True, 0, 5, 1.0, 1.0, 100, 300, (), ()),
    ],
    ids=str,
)
def test_what_the_wire_cannot_carry_is_refused_where_it_is_sent(message: Message) -> None:
    with pytest.raises(ProtocolError):
        encode(message, session=1, sequence=2, t_ms=3)


def test_an_image_is_quantised_to_steps_of_five_thousandths() -> None:
    assert quantise_image([1.0, 1.005, 0.9, 0.0, 9.0]) == bytes([128, 129, 108, 0, 255])
    assert image_from_bytes(bytes([128, 129, 108])) == [1.0, 1.005, 0.9]
    assert quantise_image(image_from_bytes(bytes(range(256)))) == bytes(range(256))
    with pytest.raises(ProtocolError, match="finite"):
        quantise_image([float("nan")])


def test_a_sequence_is_ahead_by_less_than_half_of_its_circle() -> None:
    assert is_ahead(6, 5)
    assert is_ahead(0, 65535)
    assert not is_ahead(5, 5)
    assert not is_ahead(4, 5)
    assert not is_ahead(65535, 0)
