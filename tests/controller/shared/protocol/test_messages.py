"""The wire: every message there and back, and nothing at all out of noise."""

import random
import re
import zlib
from dataclasses import replace
from math import inf
from typing import Any

import pytest
from cobs import cobs as oracle
from hypothesis import example, given, settings
from hypothesis import strategies as st

from controller.shared.notices import Notice, listed, notice
from controller.shared.protocol import codec
from controller.shared.protocol import messages as protocol
from controller.shared.protocol import messages as wire
from controller.shared.protocol import teaching as teach
from controller.shared.protocol.codec import ProtocolError, image_from_bytes, quantise_image
from controller.shared.protocol.packets import MAX_FRAME, Decoder, Packet, encode, is_ahead
from tests.support import ROOT
from tests.support.fake_device import welcome

u8, u16, u32 = (st.integers(0, 2**bits - 1) for bits in (8, 16, 32))
size, span = st.integers(1, 255), st.integers(1, 65535)
f32 = st.floats(width=32, allow_nan=False, allow_infinity=False)
share = st.floats(0, 1, width=32)
flag = st.booleans()
point = st.none() | st.tuples(f32, f32)
printable = st.characters(categories=("L", "N", "P", "S"), include_characters=" ")


def text(limit: int) -> st.SearchStrategy[str]:
    return st.text(printable, max_size=limit).filter(lambda value: len(value.encode()) <= limit)


name, long, reason = text(40), text(64), text(500)
names = st.lists(text(8), max_size=40).map(tuple)
shares = st.lists(u8.map(lambda value: value / 255.0), max_size=8).map(tuple)
hop = st.builds(wire.StageTime, name, f32, f32, f32)
contact = st.builds(wire.Contact, u16, f32, f32, f32, f32)
bound = st.floats(width=32, allow_nan=False)
rule = st.builds(teach.CommandRule, name, bound, bound, bound, bound)
few_names, pixels = st.lists(text(8), max_size=20).map(tuple), st.binary(max_size=400)
FIELDS: dict[type, list[st.SearchStrategy[Any]]] = {
    wire.Hello: [u8, u8, long, long, flag],
    wire.Welcome: [
        u8,
        u32,
        long,
        long,
        flag,
        size,
        size,
        f32,
        f32,
        span,
        span,
        names,
        names,
        flag,
        u32,
    ],
    wire.Refuse: [reason],
    wire.Bye: [reason],
    wire.Heartbeat: [u32, u32, u32, u32, names],
    wire.Offer: [u8, st.binary(max_size=32), flag],
    wire.NumberedCommand: [name, name, share, point, u32, u32, u32, u32],
    wire.State: [names],
    wire.Telemetry: [u32, st.binary(max_size=900), shares, point, name, flag, f32],
    wire.GroundTruth: [u32, name, u32, u32],
    wire.Granted: [u32],
    wire.Health: [st.lists(text(120), max_size=8).map(tuple)],
    wire.PositionUncertainty: [u32, st.floats(0.0, 100.0, width=32)],
    wire.ContactState: [u32, f32, f32, share, f32, share, u8, share, *[f32, share] * 2, u32],
    wire.Contacts: [st.lists(contact, max_size=16).map(tuple)],
    wire.Perform: [u32, name, f32, f32],
    wire.Grant: [u32],
    wire.Join: [long, long, flag, st.integers(1, 2**32 - 1), u32, u32],
    wire.HostHeartbeat: [u32, u32, u32, u32, u32],
    wire.UploadStatus: [u8, u32, reason],
    wire.LatencyReport: [f32, u32, st.lists(hop, max_size=16).map(tuple)],
    wire.UserIdentified: [name, share],
    wire.UploadOffer: [st.binary(max_size=32), u32, long],
    wire.UploadChunk: [u32, st.binary(max_size=wire.PIECE)],
    wire.Correction: [name],
    teach.Describe: [],
    teach.ExampleStart: [u32, name],
    teach.ExampleEnd: [u32, flag],
    teach.ExampleDrop: [u32],
    teach.Learn: [name, name, name, flag, name],
    teach.Forget: [name],
    teach.Undo: [],
    teach.SaveAs: [name],
    teach.SetCommand: [name, name, name],
    teach.SetStrength: [share, name],
    teach.SetWaiting: [name, flag],
    teach.LessonCost: [name, name, u8, u8, share, u8, share, u8, share],
    teach.TouchStrength: [name, share],
    teach.UserInfo: [name, few_names, few_names],
    teach.DeleteExamples: [],
    teach.Record: [flag],
    teach.RecordLabel: [name],
    teach.InjectFault: [name, u8, u8],
    teach.Recalibrate: [],
    teach.Check: [flag],
    teach.CheckStep: [name, u8, u8, share],
    teach.CheckRow: [long, name, text(250), text(250), name],
    teach.Vocabulary: [few_names, few_names, long, flag, u8, text(255), text(200)],
    teach.GestureInfo: [name, long, flag, u16, pixels, st.lists(rule, max_size=3).map(tuple)],
    teach.ExampleTaken: [u32, name, flag, reason, share, pixels],
    teach.LearnStatus: [u8, share, reason, shares],
    teach.RecordingStatus: [flag, reason],
}
MESSAGES: dict[type, st.SearchStrategy[wire.Message]] = {
    kind: st.builds(kind, *fields) for kind, fields in FIELDS.items()
}
messages = st.one_of(*MESSAGES.values())

WELCOME = wire.Welcome(
    1, 7, "A1", "OrbTouch", False, 5, 5, 10.0, 1.0, 100, 300, ("null", "press"), ("down",), True, 6
)  # fmt: skip

# Type and payload of one packet of each kind, field by field. Read it beside the specification.
GOLDEN: list[tuple[wire.Message, str]] = [
    # Written as ever: its layout never changes.
    (wire.Hello(1, 1, "key", "host", True), "01  01 01 03 6b6579 04 686f7374 01"),
    (
        WELCOME,
        "02  01 07000000 02 4131 08 4f7262546f756368 00 05 05 00002041"
        "0000803f 6400 2c01  02 04 6e756c6c 05 7072657373  01 04 646f776e 01 06000000",
    ),
    (wire.Refuse("no"), "03  0200 6e6f"),
    (wire.Bye("off"), "04  0300 6f6666"),
    (
        wire.Heartbeat(258, 1, 2, 3, ("down",)),
        "05  02010000 01000000 02000000 03000000 01 04 646f776e",
    ),
    (wire.Offer(4, b"\1\2", True), "06  04 02 0102 01"),
    (
        wire.NumberedCommand("left", "press", 0.5, (1.0, 2.0), 9, 7, 6, 258),
        "10  04 6c656674 05 7072657373 0000003f 01 0000803f 00000040"
        "09000000 07000000 06000000 02010000",
    ),
    (wire.State(("left", "down")), "11  02 04 6c656674 04 646f776e"),
    (
        wire.Telemetry(9, b"\x80\x7f", (1.0, 0.0), None, "press", True, 10.0),
        "12  09000000 0200 807f 02 ff00 00 05 7072657373 01 00002041",
    ),
    (wire.GroundTruth(4, "press", 1000, 1500), "13  04000000 05 7072657373 e8030000 dc050000"),
    (wire.Granted(100), "14  64000000"),
    (wire.Health(("pump", "row 1")), "15  02 05 00 70756d70 06 00 726f772031"),
    (wire.PositionUncertainty(9, 0.5), "19  09000000 0000003f"),
    (
        wire.ContactState(9, 2.0, 3.0, 0.5, 4.0, 0.25, 2, 1.0, -30.0, 8.0, 1.5, 0.5, 258),
        "0c  09000000 00000040 00004040 0000003f 00008040 0000803e 02 0000803f"
        "0000f0c1 00000041 0000c03f 0000003f 02010000",
    ),
    (
        wire.Contacts((wire.Contact(1, 2.0, 3.0, 4.0, 5.0),)),
        "20  01 0100 00000040 00004040 00008040 0000a040",
    ),
    (wire.Perform(4, "press", 1.0, 2.0), "21  04000000 05 7072657373 0000803f 00000040"),
    (wire.Grant(100), "22  64000000"),
    (
        wire.Join("key", "host", True, 1, 2, 3),
        "23  03 6b6579 04 686f7374 01 01000000 02000000 03000000",
    ),
    (wire.HostHeartbeat(258, 1, 2, 3, 4), "24  02010000 01000000 02000000 03000000 04000000"),
    (wire.UploadStatus(2, 258, "ok"), "16  02 02010000 0300 00 6f6b"),
    (
        wire.LatencyReport(100.0, 7, (wire.StageTime("scan", 1.0, 1.0, 2.0),)),
        "17  0000c842 07000000 01 04 7363616e 0000803f 0000803f 00000040",
    ),
    (wire.UserIdentified("ann", 1.0), "18  03 616e6e 0000803f"),
    (wire.UploadOffer(b"\1\2", 258, "my.orb"), "30  02 0102 02010000 06 6d792e6f7262"),
    (wire.UploadChunk(258, b"\1\2"), "31  02010000 0200 0102"),
    (wire.Correction("pinch"), "32  05 70696e6368"),
    (teach.Describe(), "33  "),
    (teach.ExampleStart(258, "pinch"), "34  02010000 05 70696e6368"),
    (teach.ExampleEnd(258, True), "35  02010000 01"),
    (teach.ExampleDrop(258), "36  02010000"),
    (
        teach.Learn("tap", "hold", "half", True, "ann"),
        "37  03 746170 04 686f6c64 04 68616c66 01 03 616e6e",
    ),
    (teach.Forget("tap"), "38  03 746170"),
    (teach.Undo(), "39  "),
    (teach.SaveAs("tap"), "3a  03 746170"),
    (teach.SetCommand("tap", "hold", "ann"), "3b  03 746170 04 686f6c64 03 616e6e"),
    (teach.SetStrength(0.5, "ann"), "42  0000003f 03 616e6e"),
    (teach.SetWaiting("tap", True), "43  03 746170 01"),
    (
        teach.LessonCost("tap", "a", 20, 20, 0.5, 19, 1.0, 18, 0.25),
        "0b  03 746170 01 61 14 14 0000003f 13 0000803f 12 0000803e",
    ),
    (teach.TouchStrength("ann", 0.5), "0d  03 616e6e 0000003f"),
    (teach.UserInfo("ann", ("tap",), ("hold",)), "0e  03 616e6e 01 03 746170 01 04 686f6c64"),
    (teach.DeleteExamples(), "3c  "),
    (teach.Record(True), "3d  01"),
    (teach.RecordLabel("tap"), "3e  03 746170"),
    (teach.InjectFault("dead", 2, 3), "3f  04 64656164 02 03"),
    (teach.Recalibrate(), "40  "),
    (teach.Check(True), "41  01"),
    (teach.CheckStep("press", 2, 3, 1.0), "1f  05 7072657373 02 03 0000803f"),
    (
        teach.CheckRow("air", "good", "1 kPa", "b", "a"),
        "0f  04 00 616972 04 676f6f64 06 00 31206b5061 02 00 62 01 61",
    ),
    (
        teach.Vocabulary(("null", "tap"), ("hold",), "b", True, 1, "/d", "no"),
        "1a  02 04 6e756c6c 03 746170 01 04 686f6c64 01 62 01 01 02 2f64 03 00 6e6f",
    ),
    (
        teach.GestureInfo(
            "tap", "a tap", True, 5, b"\x80", (teach.CommandRule("hold", inf, -inf, 1.0, -inf),)
        ),
        "1b  03 746170 05 6120746170 01 0500 0100 80"
        "01 04 686f6c64 0000807f 000080ff 0000803f 000080ff",
    ),
    (
        teach.ExampleTaken(258, "tap", True, "ok", 0.5, b"\x80", "half", True),
        "1c  02010000 03 746170 01 0300 00 6f6b 0000003f 0100 80 04 68616c66 01",
    ),
    (teach.LearnStatus(1, 1.0, "ok", (1.0, 0.0)), "1d  01 0000803f 0300 00 6f6b 02 ff00"),
    (teach.RecordingStatus(True, "here"), "1e  01 0500 00 68657265"),
]


def frame(body: bytes) -> bytes:
    """Return a body as a frame, with the right checksum, by the oracle's COBS."""
    framed: bytes = oracle.encode(body + zlib.crc32(body).to_bytes(4, "little"))
    return framed + b"\0"


def wired(message: wire.Message) -> bytes:
    return encode(message, session=1, sequence=2, t_ms=3)


def packet(message: wire.Message) -> Packet:
    return Packet(session=1, sequence=2, t_ms=3, version=wire.VERSION, message=message)


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
def test_every_message_arrives_as_it_was_sent(kind: type) -> None:
    @settings(max_examples=60, deadline=None)
    @given(MESSAGES[kind], u16, u16, u32)
    def there_and_back(message: wire.Message, session: int, sequence: int, t_ms: int) -> None:
        data = encode(message, session=session, sequence=sequence, t_ms=t_ms)
        assert data.count(0) == 1
        assert data.endswith(b"\0")
        assert len(data) <= MAX_FRAME + 1
        assert Decoder().feed(data) == [Packet(session, sequence, t_ms, wire.VERSION, message)]

    there_and_back()


def test_every_message_is_tried_and_has_its_golden_bytes() -> None:
    # A command travels as Numbered, which all programs but the two sessions do not see.
    assert {*MESSAGES, wire.Command} == {*protocol.TYPES, wire.Command}
    assert [type(message) for message, _ in GOLDEN] == list(MESSAGES)


@pytest.mark.parametrize(("message", "body"), GOLDEN, ids=lambda value: type(value).__name__)
def test_the_bytes_of_each_message_are_these(message: wire.Message, body: str) -> None:
    kind, payload = body.split("  ", 1)  # between them: session 1, sequence 2, t_ms 3
    data = frame(bytes.fromhex(f"40 {kind} 0100 0200 03000000 {payload}"))  # version 4, flags 0
    assert wired(message) == data
    assert Decoder().feed(data) == [packet(message)]


def test_a_whole_frame_on_the_wire_is_this() -> None:
    # Each zero of header, payload and checksum is the distance to the next zero.
    data = "04 402201 02 02 02 03 01 01 03 0201 01 05 854934f9 00"
    assert wired(wire.Grant(258)) == bytes.fromhex(data)


def carried(text: str) -> str:
    """Return what arrives of the text of a status."""
    [packet] = Decoder().feed(wired(teach.RecordingStatus(True, text)))
    assert isinstance(packet.message, teach.RecordingStatus)
    return packet.message.text


def body_of(text: str) -> Any:
    return Decoder().feed(frame(bytes.fromhex(f"40 1e 0100 0200 03000000 01 {text}")))


NUMBERS = "06 6e756d626572"  # a code that does not exist: "number"
LEAD = "08 6c6561645f6f6666 0800 03 726f77 0200 00 32"  # lead_off(row("2"))


def test_a_notice_arrives_with_its_code_and_arguments() -> None:
    sent = notice("lead_off", notice("row", 2))
    assert body_of("1300" + LEAD)[0].message.text == sent
    assert wired(teach.RecordingStatus(True, sent)) == frame(
        bytes.fromhex(f"40 1e 0100 0200 03000000 01 1300 {LEAD}")
    )
    arrived = carried(sent)
    assert isinstance(arrived, Notice)
    assert (arrived, arrived.code, arrived.arguments) == (sent, "lead_off", ("row 2",))
    assert isinstance(arrived.arguments[0], Notice)


def test_an_unknown_code_is_shown_with_its_arguments() -> None:
    [packet] = body_of(f"0b00 {NUMBERS} 0200 00 37")
    assert packet.message.text == "number: 7"


def test_a_sentence_is_made_printable_and_cut() -> None:
    assert carried("two\nlines") == "two\\nlines"
    assert carried("ä" * 300) == "ä" * 250
    long = notice("the_bundle", "x" * 600)
    assert carried(long) == str(long)[:500]
    assert not isinstance(carried(long), Notice)


@pytest.mark.parametrize(
    "text",
    [
        "0000",  # not even a code
        "0200 00 07",  # unprintable
        "0400 03 726f77",  # row without its number
        "0a00 03 726f77 0100 00 0100 00",  # and with two
        "0500 04 6c697374",  # an empty list
        "0700 04 6c697374 0500",  # an argument that is cut off
        "2000 04 6c697374" + " 0100 00" * 9,  # nine arguments
    ],
)
def test_a_malformed_notice_is_a_bad_frame(text: str) -> None:
    assert body_of(text) == []


def test_notices_are_nested_four_deep_at_most() -> None:
    older = listed([notice("gesture", "press"), notice("gesture", "swipe")])
    told = notice("joined", notice("forgotten", "tap"), notice("wait", older, 0.3))
    assert carried(told) == "tap is forgotten; press and swipe now wait 0.30 s for it"
    deep = listed([listed([listed([listed(["x"])])])])
    assert carried(deep) == "x"
    assert Decoder().feed(wired(teach.RecordingStatus(True, listed([deep])))) == []


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
def test_a_stream_can_be_cut_anywhere(sent: list[wire.Message], data: st.DataObject) -> None:
    stream = b"".join(wired(message) for message in sent)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    decoder = Decoder()
    received = []
    for begin, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        received += decoder.feed(stream[begin:end])
    assert received == [packet(message) for message in sent]


@settings(deadline=None)
@given(st.lists(st.tuples(messages, st.binary(max_size=40)), max_size=5))
def test_noise_costs_no_packet_that_follows_a_zero(sent: list[tuple[wire.Message, bytes]]) -> None:
    stream = b"".join(noise + b"\0" + wired(message) for message, noise in sent)
    assert Decoder().feed(stream) == [packet(message) for message, _ in sent]


def test_a_welcome_continues_nothing_unless_it_says_so() -> None:
    first = welcome()
    assert (first.resumed, first.done) == (False, 0)


def test_one_wrong_bit_anywhere_never_gives_a_packet() -> None:
    command = wire.NumberedCommand("drop", "pinch", 0.9, (1.0, 2.0), 9, 1, 0, 0)
    data = wired(command)
    for bit in range(8 * len(data)):
        wrong = bytearray(data)
        wrong[bit // 8] ^= 1 << bit % 8
        assert Decoder().feed(bytes(wrong) + b"\0") == [], f"bit {bit}"


def test_a_cut_frame_never_gives_a_packet() -> None:
    data = encode(
        wire.NumberedCommand("drop", "pinch", 0.9, None, 9, 1, 0, 0), session=1, sequence=2, t_ms=3
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
        body = bytes([wire.VERSION << 4, kind]) + noise.randbytes(noise.randrange(8, 60))
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
    data = wired(wire.Bye("off"))
    assert decoder.feed(b"\0" + data) == [packet(wire.Bye("off"))]


def test_the_end_of_a_run_that_is_too_long_is_no_packet() -> None:
    decoder = Decoder()
    decoder.feed(b"x" * (MAX_FRAME + 1))
    assert decoder.feed(wired(wire.Bye("off"))) == []
    assert decoder.feed(wired(wire.Bye("off"))) == [packet(wire.Bye("off"))]


def test_a_message_has_at_most_255_shares() -> None:
    def telemetry(labels: int) -> wire.Telemetry:
        return wire.Telemetry(0, b"", (0.0,) * labels, None, "", True, 1.0)

    assert Decoder().feed(wired(telemetry(255))) == [packet(telemetry(255))]
    with pytest.raises(ProtocolError):
        wired(telemetry(256))


def test_the_largest_packet_fits_and_one_byte_more_does_not() -> None:
    def telemetry(labels: int) -> wire.Telemetry:
        return wire.Telemetry(0, bytes(900), (0.0,) * labels, None, "", True, 1.0)

    payload = len(bytes.fromhex("00000000 8403 00 00 00 01 0000803f")) + 900
    most = wire.MAX_PAYLOAD - payload
    data = wired(telemetry(most))
    assert Decoder().feed(data) == [packet(telemetry(most))]
    with pytest.raises(ProtocolError, match="1025 bytes"):
        wired(telemetry(most + 1))
    assert Decoder().feed(frame(bytes.fromhex("40120100020003000000") + bytes(1025))) == []


SPECIFICATION = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
NAMES = ": u8 count <= 64, each text40"  # what the specification says that names are
SAMPLES: dict[str, Any] = {type(message).__name__: message for message, _ in GOLDEN}
SPECIFIED = {  # the payload of each message, as the specification's table has it
    kind: " ".join(payload.split())
    for kind, payload in re.findall(
        r"^    \d+ +(\w+) +(?:H|D|H,D) +(.+?)(?=^    [\d=])", SPECIFICATION, re.M | re.S
    )
}


def sizes(pattern: str) -> list[tuple[str, str, int]]:
    """Return message, field and size wherever the specification has the pattern."""
    return [
        (kind, field, int(size))
        for kind, payload in SPECIFIED.items()
        for field, size in re.findall(pattern, payload.replace(" names", NAMES))
    ]


TEXTS = sizes(r"(?<!each )\b(?!each\b)(\w+) (?:text|octets|sentence)(\d+)")
LISTS = sizes(r"(\w+): u8 count <= (\d+)")
LISTED_TEXTS = sizes(r"(\w+): .*?each (?:text|sentence)(\d+)")


def fits(message: wire.Message) -> bool:
    """Return whether a message arrives as it was sent; if not, sending it was refused."""
    try:
        data = wired(message)
    except ProtocolError:
        return False
    return Decoder().feed(data) == [packet(message)]


def test_the_specification_says_how_long_every_text_and_every_list_may_be() -> None:
    values: dict[tuple[str, str], Any] = {
        (kind, field): getattr(message, field)
        for kind, message in SAMPLES.items()
        for field in message.__match_args__
    }
    for place in (("Telemetry", "image"), ("Telemetry", "probabilities"), ("LearnStatus", "kept")):
        del values[place]  # kinds of their own
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


def test_unknown_types_and_incompatible_flags_are_ignored_and_compatible_flags_pass() -> None:
    decoder = Decoder()
    body = "22 0100 0200 03000000 02010000"
    assert decoder.feed(frame(bytes.fromhex("40 63 0100 0200 03000000 0102"))) == []
    assert decoder.feed(frame(bytes.fromhex("43" + body))) == [packet(wire.Grant(258))]
    assert decoder.feed(frame(bytes.fromhex("44" + body))) == []
    assert decoder.feed(frame(bytes.fromhex("48" + body))) == []


def test_of_a_foreign_version_only_hello_and_refuse_are_understood() -> None:
    def foreign(body: str) -> list[Packet]:
        return Decoder().feed(frame(bytes.fromhex(body)))

    assert foreign("10 05 0100 0200 03000000 02010000") == [Packet(1, 2, 3, 1, None)]
    assert foreign("50 63 0100 0200 03000000") == [Packet(1, 2, 3, 5, None)]
    assert foreign("50 03 0100 0200 03000000 0200 6e6f") == [Packet(1, 2, 3, 5, wire.Refuse("no"))]
    # A command set for a user and an example with its guess: payloads of version 2 lack them.
    assert foreign("20 3b 0100 0200 03000000 03 746170 04 686f6c64") == [Packet(1, 2, 3, 2, None)]
    hello = foreign("10 01 0000 0200 03000000 01 01 00 00 00")
    assert hello == [Packet(0, 2, 3, 1, wire.Hello(1, 1, "", "", False))]


@pytest.mark.parametrize(
    "message",
    [
        wire.Bye("two\nlines"),
        wire.Bye("\x1b[2J"),
        wire.Bye("x" * 501),
        wire.Bye("\ud800"),
        wire.Grant(-1),
        wire.Grant(2**32),
        wire.Command("left", "press", 0.5, None, 0),
        wire.NumberedCommand("x" * 41, "", 0.5, None, 0, 1, 0, 0),
        wire.NumberedCommand("left", "press", 1.5, None, 0, 1, 0, 0),
        wire.NumberedCommand("left", "press", float("nan"), None, 0, 1, 0, 0),
        wire.NumberedCommand("left", "press", 0.5, (float("inf"), 0.0), 0, 1, 0, 0),
        wire.Offer(2, bytes(33), False),
        wire.Join("", "", False, 0, 1, 2),
        wire.Perform(1, "press", 1e39, 0.0),
        wire.Telemetry(0, b"", (1.5,), None, "", True, 1.0),
        wire.Telemetry(0, bytes(901), (), None, "", True, 1.0),
        wire.Contacts((wire.Contact(1, 0.0, 0.0, 0.0, 0.0),) * 17),
        wire.State(("x",) * 65),
        wire.Welcome(1, 1, "", "", True, 0, 5, 1.0, 1.0, 100, 300, (), ()),
        wire.PositionUncertainty(1, -0.5),
        wire.ContactState(1, place_sigma=float("inf")),
    ],
    ids=str,
)
def test_what_the_wire_cannot_carry_is_refused_where_it_is_sent(message: wire.Message) -> None:
    with pytest.raises(ProtocolError):
        wired(message)


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
