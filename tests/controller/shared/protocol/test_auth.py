"""The key on the wire: who has it is believed, and nobody else."""

import hmac
import zlib

import pytest
from cobs import cobs

from controller.shared.protocol import messages as wire
from controller.shared.protocol.auth import SIZE, FrameAuthenticator, seals
from controller.shared.protocol.device_session import WRONG_KEY, DeviceSession
from controller.shared.protocol.host_session import HostSession
from controller.shared.protocol.link_events import Connected, Delivered, Lost, Received, Refused
from controller.shared.protocol.packets import Decoder, encode
from tests.support.fake_device import welcome

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
NONCE = bytes(range(16))
NEEDS_KEY = "the orb needs a key; add --key FILE, with the file that it was started with"
HAS_NO_KEY = (
    "the orb has no key, so it cannot be authenticated; start it with the same --key FILE, "
    "or leave --key out here"
)
DROP = wire.Command("drop", "pinch", 0.5, None, 1)
FELT = wire.Telemetry(1, bytes(25), (1.0,), None, "", True, 10.0)


class Meeting:
    """A device and a host, each with its key or none, and what was said aloud."""

    def __init__(self, device: bytes, host: bytes, *, nonce: bytes = NONCE) -> None:
        self.device = DeviceSession(welcome(), key=device)
        self.host = HostSession("orb", 100, 0, key=host, nonce=nonce)
        self.from_device, self.from_host = b"", b""
        self.requests: list[wire.Message] = []
        self.news: list[Received] = []
        self.exchange()

    def exchange(self, now_ms: int = 0) -> list[Received]:
        """Carry everything both ways until nothing is left; return the host's news."""
        news: list[Received] = []
        while self.host.output or self.device.output:
            for session in (self.host, self.device):
                data = bytes(session.output)
                session.output.clear()
                if session is self.host:
                    self.from_host += data
                    self.requests += self.device.receive(data, now_ms)
                else:
                    self.from_device += data
                    news += self.host.receive(data, now_ms)
        self.news += news
        return news


def test_two_who_share_a_key_talk_as_ever() -> None:
    both = Meeting(KEY, KEY)
    assert Connected(welcome()) in both.news
    both.device.send(DROP, 0, 0)
    assert both.exchange() == [Delivered(DROP, 0)]
    assert both.host.send(wire.Contacts(()), 0)
    both.exchange()
    assert both.requests[-1] == wire.Contacts(())
    assert both.device.outbox.posted == ()


def test_a_tag_is_what_the_specification_says() -> None:
    numbers = bytes([2, 2]) + (7).to_bytes(2, "little") + (100).to_bytes(2, "little")
    drawn = (2).to_bytes(2, "little") + b"ab" + (3).to_bytes(2, "little") + b"cde"
    own = hmac.digest(KEY, b"OrbTouch link, sessions" + numbers + drawn, "sha256")
    key = hmac.digest(own, b"host", "sha256")
    expected = hmac.digest(key, (101).to_bytes(8, "little") + b"body", "sha256")[:8]
    ours, theirs = seals(KEY, versions=(2, 2), host=b"ab", device=b"cde", session=7, sequence=100)
    assert ours.tag(b"body", 101) == expected
    assert theirs.tag(b"body", 101) != expected  # the other direction has another key


def test_a_whole_sealed_frame_is_this() -> None:
    # Version 4 with the flag of a tag, type 34, session 7, sequence 101, t_ms 3; Grant(258).
    # The tag is OpenSSL's: `openssl dgst -sha256 -mac HMAC`, by the text of docs/protocol.md.
    sealed = bytes.fromhex("44 22 0700 6500 03000000  02010000  7ca2121cf94d5a2f")
    ours, _ = seals(KEY, versions=(4, 4), host=b"ab", device=b"cde", session=7, sequence=100)
    sent = encode(wire.Grant(258), session=7, sequence=101, t_ms=3, seal=ours)
    assert cobs.decode(sent[:-1]) == sealed + zlib.crc32(sealed).to_bytes(4, "little")


@pytest.mark.parametrize(
    ("device", "host", "told", "noted"),
    [
        (KEY, OTHER, WRONG_KEY, WRONG_KEY),
        (KEY, b"", NEEDS_KEY, WRONG_KEY),
        (b"", KEY, HAS_NO_KEY, "the host needs a key, and the orb has none"),
    ],
)
def test_without_a_common_key_both_ends_say_so(
    device: bytes, host: bytes, told: str, noted: str
) -> None:
    both = Meeting(device, host)
    assert both.news == [Refused(f"orb: {told}")]
    assert both.device.refused == noted
    assert both.requests == []
    assert not both.device.live


def test_before_it_has_proved_the_key_a_host_learns_the_version_and_no_more() -> None:
    both = Meeting(KEY, OTHER)
    offer, refuse = (packet.message for packet in Decoder().feed(both.from_device))
    assert isinstance(offer, wire.Offer)
    assert (offer.version, len(offer.nonce), offer.keyed) == (wire.VERSION, 16, True)
    assert isinstance(refuse, wire.Refuse)
    hello = Decoder().feed(both.from_host)[0].message
    assert hello == wire.Hello(
        wire.VERSION, wire.VERSION, NONCE.hex(), "", False
    )  # and neither does the device
    for word in (b"virtual-1", b"OrbTouch", b"press"):
        assert word not in both.from_device


def test_an_orb_that_does_not_know_the_key_is_not_believed() -> None:
    host = HostSession("orb", 100, 0, key=KEY, nonce=NONCE)
    offer = encode(wire.Offer(wire.VERSION, bytes(16), True), session=9, sequence=100, t_ms=0)
    assert host.receive(offer, 0) == []
    sealed = FrameAuthenticator(OTHER, 100)
    for answer in (
        encode(welcome(), session=9, sequence=101, t_ms=0, seal=sealed),
        encode(welcome(), session=9, sequence=101, t_ms=0),
    ):
        impostor = HostSession("orb", 100, 0, key=KEY, nonce=NONCE)
        impostor.receive(offer, 0)
        [refused] = impostor.receive(answer, 0)
        assert refused == Refused("orb has another key; give both the same --key FILE")


def test_a_lower_version_than_was_offered_cannot_be_made_of_a_hello() -> None:
    numbers = {"host": b"n", "device": b"m", "session": 1, "sequence": 2}
    honest, _ = seals(KEY, versions=(2, 3), **numbers)  # type: ignore[arg-type]
    changed, _ = seals(KEY, versions=(2, 2), **numbers)  # type: ignore[arg-type]
    assert not changed.confirms(b"join", 3, honest.tag(b"join", 3))


def test_frames_without_a_tag_or_with_a_wrong_one_are_not_taken_and_prove_no_life() -> None:
    both = Meeting(KEY, KEY)
    number, sequence = both.device.number, 500
    for seal in (None, FrameAuthenticator(OTHER, 100)):
        forged = encode(FELT, session=number, sequence=sequence, t_ms=0, seal=seal)
        assert both.host.receive(forged, 10) == []
        forged = encode(wire.Contacts(()), session=number, sequence=sequence, t_ms=0, seal=seal)
        assert both.device.receive(forged, 10) == []
    [stale] = both.host.receive(b"", 300)
    assert type(stale).__name__ == "Stale"


def test_what_one_session_said_is_nothing_to_the_next_nor_to_the_other_end() -> None:
    first, second = Meeting(KEY, KEY), Meeting(KEY, KEY, nonce=bytes(16))
    assert first.device.number == second.device.number
    requests = second.device.receive(first.from_host, 0)  # Hello, and a Join of yesterday
    assert requests == [wire.Bye("the host started again")]
    assert second.device.state == "offered"  # it waits for a Join that fits this session
    second = Meeting(KEY, KEY, nonce=bytes(16))
    first.device.send(DROP, 0, 0)
    assert second.host.receive(bytes(first.device.output), 0) == []
    assert first.device.receive(bytes(first.device.output), 0) == []


def test_a_packet_that_was_kept_until_the_sequence_came_round_is_not_taken() -> None:
    sender, receiver = FrameAuthenticator(KEY, 65_000), FrameAuthenticator(KEY, 65_000)
    kept = sender.tag(b"drop", 65_001)
    assert receiver.confirms(b"drop", 65_001, kept)
    for number in range(65_002, 65_002 + 65_536 - 100):
        tag = sender.tag(b"", number & 0xFFFF)
        assert receiver.confirms(b"", number & 0xFFFF, tag)
    assert not receiver.confirms(b"drop", 65_001, kept)
    assert len(kept) == SIZE


def test_a_packet_from_before_the_beginning_is_none() -> None:
    assert not FrameAuthenticator(KEY, 5).confirms(b"", 65_535, bytes(8))


@pytest.mark.parametrize("nonce", [b"", bytes(15)])
def test_a_key_without_a_fresh_number_is_a_mistake_of_the_caller(nonce: bytes) -> None:
    with pytest.raises(ValueError, match="needs 16 random bytes"):
        HostSession("orb", 1, 0, key=KEY, nonce=nonce)


def test_a_sealed_session_lives_as_long_as_any() -> None:
    both = Meeting(KEY, KEY)
    for now_ms in range(0, 60_000, 10):
        assert both.device.tick(now_ms) == []
        assert not any(isinstance(item, Lost) for item in both.host.tick(now_ms))
        both.exchange(now_ms)
    assert both.host.state == "live"
