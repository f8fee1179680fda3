"""Both ends of the conversation, without ports and clocks: bytes and milliseconds go in."""

import dataclasses
import zlib

import pytest

from controller.shared.protocol import codec
from controller.shared.protocol.codec import ProtocolError
from controller.shared.protocol.device_session import BACKLOG, GRANTED_BACKLOG, DeviceSession
from controller.shared.protocol.host_session import HostSession
from controller.shared.protocol.link_events import (
    Connected,
    Delivered,
    Lost,
    Missed,
    Received,
    Refused,
    Stale,
    pause_s,
)
from controller.shared.protocol.messages import (
    VERSION,
    Bye,
    Command,
    Contacts,
    ContactState,
    Grant,
    Granted,
    Heartbeat,
    Hello,
    HostHeartbeat,
    Join,
    Message,
    NumberedCommand,
    Offer,
    Perform,
    Refuse,
    State,
    Telemetry,
    Welcome,
)
from controller.shared.protocol.packets import NEVER, Decoder, Packet, encode
from controller.shared.protocol.retransmit import RetransmitQueue, SessionHistory
from tests.support.fake_device import welcome
from tests.support.manual_host import HELLO, JOIN, numbered

DROP = Command("drop", "pinch", 0.5, None, 1)
FRAME = Telemetry(1, bytes(25), (1.0,), None, "", True, 10.0)
ALIVE = HostHeartbeat(0, 0, NEVER, 0, 0)


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


@pytest.fixture
def session() -> DeviceSession:
    return DeviceSession(welcome())


@pytest.fixture
def pair() -> Pair:
    return met()


def test_hello_gets_an_offer_and_join_a_welcome_and_the_state_that_nothing_is_held() -> None:
    session = DeviceSession(welcome(), number=41, draw=bytes)
    assert greet(session, sequence=500) == [HELLO]
    assert [(packet.session, packet.sequence, packet.message) for packet in said(session)] == [
        (42, 500, Offer(VERSION, bytes(16), False)),
        (42, 501, welcome()),
        (42, 502, State(())),
    ]


@pytest.mark.parametrize(("sequence", "following"), [(500, 501), (65_535, 0)])
def test_a_host_turned_away_gets_the_packet_after_the_offer(sequence: int, following: int) -> None:
    session = DeviceSession(welcome(), token="secret", draw=bytes)
    greet(session, sequence=sequence)
    offer, refuse = said(session)
    assert (offer.sequence, refuse.sequence) == (sequence, following)
    assert isinstance(refuse.message, Refuse)


def test_a_host_may_come_long_after_the_orb_was_switched_on(session: DeviceSession) -> None:
    greet(session, sequence=1, now_ms=3_600_000)
    assert session.tick(3_600_050) == []
    assert session.live


def test_an_orb_is_heard_every_tenth_of_a_second_and_echoes_the_host_s_newest_clock() -> None:
    session = DeviceSession(welcome())
    greet(session, sequence=1, now_ms=7)
    said(session)
    beats = []
    for now_ms in range(10, 1_000, 15):  # the thread's ticks are not those of the beat
        if now_ms == 505:
            heard(session, dataclasses.replace(ALIVE, sent_ms=4711), sequence=3, now_ms=now_ms)
        session.tick(now_ms)
        beats += [(now_ms, packet.message) for packet in said(session)]
    assert [now_ms // 100 for now_ms, _ in beats] == list(range(1, 10))
    for now_ms, beat in beats:
        echo = (4711, now_ms - 505) if now_ms > 505 else (0, NEVER)
        assert beat == Heartbeat(now_ms, *echo, done=0, pressed=())


def test_nothing_is_accepted_before_hello(session: DeviceSession) -> None:
    assert heard(session, Contacts(()), sequence=1, now_ms=0) == []
    assert heard(session, Grant(100), sequence=2, now_ms=0) == []
    assert bytes(session.output) == b""


def test_another_hello_begins_a_new_session_and_the_old_number_is_not_heard_any_more() -> None:
    session = greeted()
    old = encode(Contacts(()), session=session.number, sequence=9, t_ms=0)
    assert greet(session, sequence=5) == [Bye("the host started again"), HELLO]
    assert session.number == 2
    assert session.receive(old, 0) == []


@pytest.mark.parametrize(
    ("versions", "sentence"),
    [
        ((5, 6), "the orb has protocol version 4, the host versions 5 to 6; "
         "on the orb, run: pip install --upgrade orbtouch"),
        ((1, 1), "the orb has protocol version 4, the host version 1; on the host, run: "
         "pip install --upgrade orbtouch"),
    ],
)  # fmt: skip
def test_a_host_of_other_versions_is_told_both(versions: tuple[int, int], sentence: str) -> None:
    session = DeviceSession(welcome())
    hello = Hello(*versions, "", "a test", False)
    assert heard(session, hello, sequence=7, now_ms=0) == []
    assert [(packet.sequence, packet.message) for packet in said(session)] == [
        (7, Refuse(sentence))
    ]
    assert not session.live


def test_a_host_of_versions_around_ours_is_welcome(session: DeviceSession) -> None:
    heard(session, Hello(0, 15, "", "", False), sequence=7, now_ms=0)
    assert heard(session, JOIN, sequence=8, now_ms=0) == [Hello(0, 15, "", "a test", False)]


@pytest.mark.parametrize("token", ["", "wrong", "secret "])
def test_a_host_without_the_token_is_refused(token: str) -> None:
    session = DeviceSession(welcome(), token="secret")
    assert greet(session, sequence=7, join=dataclasses.replace(JOIN, token=token)) == []
    assert isinstance(said(session)[-1].message, Refuse)
    join = dataclasses.replace(JOIN, token="secret")
    assert greet(session, sequence=9, join=join) == [dataclasses.replace(HELLO, token="secret")]


def test_only_a_virtual_device_takes_granted_time_fingers_and_hands() -> None:
    session = DeviceSession(welcome(virtual=False))
    assert greet(session, sequence=7, join=dataclasses.replace(JOIN, granted=True)) == []
    assert isinstance(said(session)[-1].message, Refuse)
    greet(session, sequence=10)
    assert session.live
    assert heard(session, Contacts(()), sequence=12, now_ms=0) == []
    assert heard(session, Perform(1, "press", 0.0, 0.0), sequence=13, now_ms=0) == []


def test_grants_count_only_where_time_is_granted(session: DeviceSession) -> None:
    assert not session.granted
    greet(session, sequence=6)
    assert heard(session, Grant(100), sequence=8, now_ms=0) == []
    greet(session, sequence=9, join=dataclasses.replace(JOIN, granted=True))
    assert heard(session, Grant(100), sequence=11, now_ms=0) == [Grant(100)]


def test_the_session_after_number_65535_has_number_1() -> None:
    numbers = []
    for number in (65_533, 65_534, 65_535):
        session = DeviceSession(welcome(), number=number, draw=bytes)
        greet(session, sequence=6)
        numbers.append(session.number)
    assert numbers == [65_534, 65_535, 1]


def test_a_request_is_taken_once(session: DeviceSession) -> None:
    greet(session, sequence=65_534)
    press = Perform(1, "press", 0.0, 0.0)
    assert heard(session, press, sequence=0, now_ms=0) == [press]
    assert heard(session, press, sequence=0, now_ms=0) == []
    assert heard(session, press, sequence=65_535, now_ms=0) == []
    assert heard(session, press, sequence=1, now_ms=0) == [press]


def test_a_command_without_a_host_never_comes_to_one_who_was_not_there() -> None:
    session = DeviceSession(welcome())
    session.send(DROP, 0, 0)
    greet(session, sequence=1)
    assert [type(packet.message) for packet in said(session)] == [Offer, Welcome, State]
    assert session.outbox.lost == 1


def test_what_one_host_did_not_get_the_next_one_does_not_get_either() -> None:
    session = greeted()
    session.send(DROP, 0, 0)
    del session.output[:-5]  # the link took most of it: half a frame is on its way
    greet(session, sequence=3, join=dataclasses.replace(JOIN, host_nonce=78))
    assert [type(packet.message) for packet in said(session)] == [Offer, Welcome, State]


def test_a_host_that_is_silent_for_two_seconds_is_forgotten() -> None:
    session = greeted()
    heard(session, ALIVE, sequence=3, now_ms=500)
    assert session.tick(2_500) == []
    assert session.tick(2_501) == [Bye("the host was silent for 2 s")]
    assert not session.live
    assert session.tick(9_000) == []
    assert bytes(session.output) == b""


def test_a_host_that_grants_time_may_think_for_as_long_as_it_likes(session: DeviceSession) -> None:
    greet(session, sequence=1, join=dataclasses.replace(JOIN, granted=True))
    said(session)
    assert session.tick(1_000_000) == []
    assert session.live
    assert bytes(session.output) == b""


def test_a_second_host_is_told_that_the_orb_is_taken(session: DeviceSession) -> None:
    session.taken_by = 1234
    assert greet(session, sequence=1) == []
    reason = "already connected to another host; close that one first"
    assert said(session)[-1].message == Refuse(reason)
    assert session.refused == reason
    assert greet(session, sequence=3, join=dataclasses.replace(JOIN, host_nonce=1234)) != []


@pytest.mark.parametrize(("granted", "most"), [(False, BACKLOG), (True, GRANTED_BACKLOG)])
def test_what_exceeds_a_full_backlog_is_dropped_and_counted(granted: bool, most: int) -> None:
    session = DeviceSession(welcome())
    greet(session, sequence=1, join=dataclasses.replace(JOIN, granted=granted))
    session.output[:] = bytes(most)
    session.send(FRAME, 0, 0)
    assert (len(session.output) > most, session.dropped) == (True, 0)
    session.send(FRAME, 0, 0)
    session.send(FRAME, 0, 0)
    assert session.dropped == 2


FINGER = ContactState(7, 2.0, 1.5, 0.0625, 6.0, 0.5, 1, 0.875)


def contacts_said(session: DeviceSession) -> list[Message | None]:
    return [p.message for p in said(session) if not isinstance(p.message, Offer | Welcome | State)]


def test_a_contact_is_sent_at_once_when_nothing_is_before_it() -> None:
    session = greeted()
    said(session)
    session.send(FINGER, 700, 750)
    assert contacts_said(session) == [dataclasses.replace(FINGER, sent_ms=750)]


def test_only_the_newest_contact_waits_for_a_slow_host() -> None:
    session = greeted()
    said(session)
    session.send(FRAME, 0, 0)  # the host reads nothing
    for frame in (8, 9, 10):
        session.send(dataclasses.replace(FINGER, frame=frame), 0, 0)
    assert contacts_said(session) == [FRAME]
    session.tick(50)
    assert contacts_said(session) == [dataclasses.replace(FINGER, frame=10)]


def test_no_contact_waits_behind_a_command_or_its_own_end() -> None:
    end = ContactState(8)
    for newer in (DROP, end):
        session = greeted()
        said(session)
        session.send(FRAME, 0, 0)
        session.send(FINGER, 0, 0)
        session.send(newer, 0, 0)
        frame, after = contacts_said(session)
        assert (frame, isinstance(after, NumberedCommand | ContactState)) == (FRAME, True)
        session.tick(50)
        assert FINGER.frame not in [getattr(one, "frame", 0) for one in contacts_said(session)]


def test_in_granted_time_every_contact_is_sent() -> None:
    session = DeviceSession(welcome())
    greet(session, sequence=1, join=dataclasses.replace(JOIN, granted=True))
    sent: list[Message] = [FRAME, FINGER, dataclasses.replace(FINGER, frame=8), ContactState(8)]
    for message in sent:
        session.send(message, 0, 0)
    assert contacts_said(session) == sent


def test_a_loop_that_hangs_ends_its_contact(pair: Pair) -> None:
    pair.device.send(FINGER, pair.now_ms, pair.now_ms)
    pair.exchange()
    pair.now_ms += 290
    pair.device.tick(pair.now_ms, loop_ms=pair.now_ms - 300)
    assert pair.exchange() == [Delivered(ContactState(7), pair.now_ms)]


def test_a_host_ends_a_contact_of_which_nothing_more_comes(pair: Pair) -> None:
    pair.device.send(FINGER, 5000, pair.now_ms)
    (begun,) = pair.exchange()
    assert isinstance(begun, Delivered)
    assert begun.message == dataclasses.replace(FINGER, sent_ms=pair.now_ms)
    assert pair.let(290) == []  # heartbeats only: the end was lost
    assert pair.let(10) == [Delivered(ContactState(7), 5000)]
    pair.device.send(ContactState(7), 5400, pair.now_ms)
    assert pair.exchange() == []  # it has ended already


def test_a_contact_that_comes_late_is_not_delivered(pair: Pair) -> None:
    pair.device.send(FINGER, pair.now_ms, pair.now_ms)
    pair.now_ms += 251
    assert pair.exchange() == []


def test_without_a_host_messages_are_dropped_and_counted_and_commands_wait() -> None:
    session = DeviceSession(welcome())
    for message in (FRAME, State(("down",)), DROP):
        session.send(message, 0, 0)
    assert (session.dropped, len(session.outbox.posted), bytes(session.output)) == (2, 1, b"")


def test_whatever_has_no_business_here_is_ignored() -> None:
    session = greeted()
    for sequence, message in (
        (2, ALIVE),  # not ahead of Join
        (3, JOIN),  # a second time
        (4, welcome()),  # which only orbs say
        (5, Grant(100)),  # time is not granted
    ):
        assert heard(session, message, sequence=sequence, now_ms=0) == []
    foreign = encode(ALIVE, session=session.number + 1, sequence=6, t_ms=0)
    assert session.receive(foreign, 0) == []
    host = HostSession("orb", 1, 0)
    assert host.receive(encode(State(()), session=0, sequence=1, t_ms=0), 0) == []
    pair = met()
    foreign = encode(State(("down",)), session=9, sequence=1, t_ms=0)
    assert pair.host.receive(foreign, pair.now_ms) == []


def test_host_and_device_greet_each_other_and_stay_alive() -> None:
    pair = Pair(token="secret")
    assert pair.exchange() == [Connected(welcome()), Delivered(State(()), 0)]
    assert pair.let(60_000) == []
    assert pair.host.state == "live"
    assert pair.requests == [Hello(VERSION, VERSION, "secret", "host", False)]


def test_commands_arrive_once_and_in_order_across_the_wrap_of_the_sequence(pair: Pair) -> None:
    frames = []
    for frame in range(1_000):  # the first sequence is 65000
        pair.device.send(dataclasses.replace(DROP, frame=frame), 0, pair.now_ms)
        stream = bytes(pair.device.output)
        pair.device.output.clear()
        for news in pair.host.receive(stream + stream, pair.now_ms):  # an echo on the line
            assert isinstance(news, Delivered)
            assert isinstance(news.message, Command)
            frames.append(news.message.frame)
    assert frames == list(range(1_000))


@pytest.mark.parametrize("asked_ms", [1, 300, 65_535])
def test_after_300_ms_of_silence_the_host_is_stale_and_after_a_second_lost(asked_ms: int) -> None:
    pair = Pair(deadman_ms=asked_ms)  # whatever the orb asks for
    pair.exchange()
    start_ms = pair.now_ms
    news = {now_ms: pair.host.tick(start_ms + now_ms) for now_ms in range(0, 1100, 10)}
    assert [now_ms for now_ms, items in news.items() if items] == [300, 1000]
    assert news[300] == [Stale()]
    assert news[1000] == [Lost("orb: nothing came for 1 s")]
    assert pair.host.tick(start_ms + 2000) == []


def test_a_stale_link_revives_but_a_command_out_of_the_stall_is_too_late(pair: Pair) -> None:
    pair.now_ms += 400
    pair.device.send(DROP, 0, pair.now_ms)
    pair.device.send(FRAME, 0, pair.now_ms)
    assert pair.exchange() == [Stale(), Missed(1), Delivered(FRAME, 0)]
    assert (pair.host.state, pair.host.past.missed) == ("live", 1)
    pair.device.send(DROP, 0, pair.now_ms)
    assert pair.exchange() == [Delivered(DROP, 0)]


def test_what_arrives_after_a_second_of_silence_cannot_save_the_connection(pair: Pair) -> None:
    pair.now_ms += 1000
    pair.device.send(DROP, 0, pair.now_ms)
    assert pair.exchange() == [Lost("orb: nothing came for 1 s")]
    assert not pair.host.send(Contacts(()), pair.now_ms)


def test_bye_of_the_device_is_a_loss(pair: Pair) -> None:
    pair.device.send(Bye("the orb was switched off"), 0, pair.now_ms)
    assert pair.exchange() == [Lost("orb: the orb was switched off")]


def test_a_loop_that_hangs_holds_nothing_and_then_sends_no_heartbeats() -> None:
    session = greeted()
    session.send(State(("down",)), 0, 0)
    sent: list[tuple[int, Message | None]] = []
    for now_ms in range(10, 1_500, 10):  # the loop's latest sign is that of time 0
        if now_ms % 500 == 0:
            heard(session, ALIVE, sequence=3 + now_ms // 500, now_ms=now_ms)
        session.tick(now_ms, 0)
        sent += [(now_ms, packet.message) for packet in said(session)]
    states = [(at, message) for at, message in sent if isinstance(message, State) and at]
    assert states[-1] == (300, State(()))
    beats = {at: message.pressed for at, message in sent if isinstance(message, Heartbeat)}
    assert list(beats) == [100, 200, 300, 400, 500, 600, 700, 800, 900]
    assert [at for at, pressed in beats.items() if pressed] == [100, 200]
    assert session.state == "hung"
    session.tick(1_500, 1_500)  # the loop goes on
    assert [type(packet.message) for packet in said(session)] == [Heartbeat]
    assert session.state == "live"
    session.send(State(("left",)), 1_510, 1_510)  # a new touch holds again
    session.tick(1_610, 1_600)
    assert said(session)[-1].message == Heartbeat(1610, 0, 610, 0, ("left",))


@pytest.mark.parametrize(("rate_hz", "release_ms"), [(40.0, 300), (10.0, 300), (2.0, 1500)])
def test_three_frames_may_pass_before_a_loop_counts_as_hung(
    rate_hz: float, release_ms: int
) -> None:
    session = DeviceSession(dataclasses.replace(welcome(), rate_hz=rate_hz))
    greet(session, sequence=1)
    session.send(State(("down",)), 0, 0)
    for now_ms in (release_ms - 1, release_ms):
        session.tick(now_ms, 0)
        assert bool(session._pressed) == (now_ms < release_ms)


def test_granted_time_has_no_heartbeats_and_waits_two_seconds_for_an_answer() -> None:
    pair = met(granted=True)
    assert pair.let(5_000) == []
    assert pair.host.send(Grant(100), pair.now_ms)
    assert pair.exchange() == []
    assert pair.requests[-1] == Grant(100)
    assert pair.let(1_990) == []
    pair.device.send(Granted(100), 100, pair.now_ms)
    assert pair.exchange() == [Delivered(Granted(100), 100)]
    assert pair.let(5_000) == []
    pair.host.send(Grant(200), pair.now_ms)
    assert pair.let(2_000) == [Lost("orb: a grant was not answered within 2 s")]


def test_a_device_that_works_on_a_long_grant_is_alive_as_long_as_it_sends() -> None:
    pair = met(granted=True)
    pair.host.send(Grant(60_000), pair.now_ms)
    for _ in range(10):
        assert pair.let(1_500) == []
        pair.device.send(FRAME, 0, pair.now_ms)
        assert pair.exchange() == [Delivered(FRAME, 0)]


@pytest.mark.parametrize(
    ("answer", "sentence"),
    [
        (b"", "opened orb, but no OrbTouch answered within 2 s; switch the orb on"),
        (b"login: \r\n", "orb sends bytes, but not the OrbTouch protocol; name"),
        (b"login: \r\n\0", "orb sends bytes, but not the OrbTouch protocol; name"),
        (encode(Bye(""), session=1, sequence=1, t_ms=0), "orb sends bytes, but not"),
    ],
    ids=["silence", "text", "nonsense", "somebody else's conversation"],
)
def test_a_device_that_is_no_orb_is_told_so_after_two_seconds(answer: bytes, sentence: str) -> None:
    host = HostSession("orb", 1, 0)
    assert host.receive(answer, 10) == []
    assert host.tick(1_999) == []
    [refused] = host.tick(2_000)
    assert isinstance(refused, Refused)
    assert refused.reason.startswith(sentence)


def test_an_orb_of_another_version_is_told_apart() -> None:
    body = bytes.fromhex("50 05 0100 0200 03000000 00000000")  # a heartbeat of version 5
    beat = codec.cobs_encode(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0"
    host = HostSession("orb", 1, 0)
    assert host.receive(beat, 10) == []
    sentence = (
        "orb has protocol version 5, this host version 4; on the host, run: "
        "pip install --upgrade orbtouch"
    )
    assert host.tick(2_000) == [Refused(sentence)]


def test_a_refusal_ends_the_attempt_with_the_orbs_own_words() -> None:
    host = HostSession("orb", 9, 0)
    answer = encode(Refuse("not now"), session=0, sequence=9, t_ms=0)
    assert host.receive(answer, 10) == [Refused("orb: not now")]
    assert host.state == "over"


def test_the_answer_to_an_earlier_hello_is_no_answer_to_this_one() -> None:
    host = HostSession("orb", 9, 0)
    offer = Offer(VERSION, bytes(16), False)
    stale = encode(offer, session=3, sequence=8, t_ms=0)
    command = encode(numbered(DROP), session=3, sequence=9, t_ms=0)
    assert host.receive(stale + command, 10) == []
    answer = encode(offer, session=4, sequence=9, t_ms=0)
    other = encode(welcome(), session=3, sequence=10, t_ms=0)
    assert host.receive(command + answer + command + other, 20) == []
    assert host.state == "joining"
    answer = encode(welcome(), session=4, sequence=10, t_ms=0)
    assert host.receive(command + answer + command, 20) == [Connected(welcome())]


def test_a_host_says_how_long_it_can_wait() -> None:
    pair = Pair()
    assert pair.host.wait_ms(pair.now_ms) == 2_000
    pair.exchange()
    assert pair.host.wait_ms(pair.now_ms) == 100
    assert pair.host.wait_ms(pair.now_ms + 30) == 70
    assert pair.host.wait_ms(pair.now_ms + 5_000) == 0
    pair.host.tick(pair.now_ms + 250)  # a heartbeat goes out, and nothing has come
    assert pair.host.wait_ms(pair.now_ms + 260) == 40  # until the dead-man time


def test_a_host_waits_for_an_orb_or_for_the_answer_to_a_grant_and_never_less_than_nothing() -> None:
    host = HostSession("orb", 1, 0)
    assert [host.wait_ms(now_ms) for now_ms in (0, 1_990, 2_010)] == [2_000, 10, 0]
    pair = met(granted=True)
    assert pair.host.wait_ms(pair.now_ms + 5_000) == 1_000  # a Grant may follow at any time
    pair.host.send(Grant(100), pair.now_ms)
    waits = [pair.host.wait_ms(pair.now_ms + later_ms) for later_ms in (0, 1_990, 2_010)]
    assert waits == [2_000, 10, 0]


# --- acknowledgement, resume, and what is missed ---


def test_a_command_is_acknowledged_at_once_and_forgotten(pair: Pair) -> None:
    pair.device.send(DROP, 0, pair.now_ms)
    assert [posted.number for posted in pair.device.outbox.posted] == [1]
    assert pair.exchange() == [Delivered(DROP, 0)]  # no time has passed
    assert pair.device.outbox.posted == ()
    assert pair.let(1_000) == []


def test_a_command_that_got_lost_is_sent_again_and_those_behind_it_wait_for_it(pair: Pair) -> None:
    pair.device.send(DROP, 0, pair.now_ms)
    pair.device.output.clear()  # a bad moment of the wire
    left = dataclasses.replace(DROP, name="left")
    pair.device.send(left, 0, pair.now_ms)
    assert pair.exchange() == []
    assert pair.let(50) == [Delivered(DROP, 0), Delivered(left, 0)]
    assert pair.let(1_000) == []


def test_a_command_that_never_gets_through_is_missed_and_both_ends_know(pair: Pair) -> None:
    pair.let(200)
    pair.device.send(DROP, 0, pair.now_ms)
    for _ in range(30):  # only heartbeats get through
        pair.now_ms += 10
        pair.device.tick(pair.now_ms)
        beats = [packet for packet in said(pair.device) if isinstance(packet.message, Heartbeat)]
        for beat in beats:
            assert beat.message is not None
            data = encode(
                beat.message, session=beat.session, sequence=beat.sequence, t_ms=beat.t_ms
            )
            pair.news += pair.host.receive(data, pair.now_ms)
    assert pair.news == [Missed(1)]
    pair.let(200)
    assert (pair.host.past.missed, pair.device.outbox.missed, pair.device.outbox.lost) == (1, 1, 1)


def test_a_command_of_250_ms_is_obeyed_and_an_older_one_is_not() -> None:
    for age_ms, news in ((250, Delivered(DROP, 0)), (251, Missed(1))):
        pair = met()
        pair.let(500)
        pair.device.send(DROP, 0, pair.now_ms)
        assert pair.host.receive(bytes(pair.device.output), pair.now_ms + age_ms) == [news]


def test_young_commands_come_after_a_cut_and_old_ones_are_told_to_be_missed(pair: Pair) -> None:
    for name in ("left", "right"):
        pair.device.send(dataclasses.replace(DROP, name=name), 0, pair.now_ms)
        pair.now_ms += 200
    again = dataclasses.replace(welcome(), resumed=True, done=1)
    right = dataclasses.replace(DROP, name="right")
    # left is 400 ms old by now, right 200
    assert pair.meet_again() == [
        Connected(again), Missed(1), Delivered(State(()), 0), Delivered(right, 0)
    ]  # fmt: skip
    assert pair.meet_again() == [
        Connected(dataclasses.replace(again, done=2)), Delivered(State(()), 0)
    ]  # fmt: skip
    assert (pair.host.past.missed, pair.device.outbox.lost) == (1, 1)


def test_what_was_delivered_but_not_acknowledged_does_not_come_twice(pair: Pair) -> None:
    pair.device.send(DROP, 0, pair.now_ms)
    assert pair.host.receive(bytes(pair.device.output), pair.now_ms) == [Delivered(DROP, 0)]
    pair.host.output.clear()  # the acknowledgement is cut off
    assert [type(news) for news in pair.meet_again()] == [Connected, Delivered]
    assert pair.device.outbox.posted == ()


def test_a_command_given_while_nobody_was_there_waits_for_the_same_host_only(pair: Pair) -> None:
    pair.device.end("cut")
    pair.device.send(DROP, 0, pair.now_ms)
    assert pair.meet_again()[-1] == Delivered(DROP, 0)
    pair.device.end("cut")
    pair.device.send(DROP, 0, pair.now_ms)
    pair.host.past = SessionHistory(host_nonce=99)  # another program
    assert [type(news) for news in pair.meet_again()] == [Connected, Delivered]
    assert pair.device.outbox.lost == 1


def test_after_a_restart_of_the_device_nothing_is_resumed(pair: Pair) -> None:
    pair.device.send(DROP, 0, pair.now_ms)
    assert pair.meet_again(nonce=8) == [Connected(welcome(nonce=8)), Delivered(State(()), 0)]
    pair.device.send(DROP, 0, pair.now_ms)
    assert pair.exchange() == [Delivered(DROP, 0)]
    assert pair.host.past == SessionHistory(1, boot_nonce=8, done=1, missed=0)


def test_the_heartbeat_repeats_what_is_held_and_mends_a_lost_release(pair: Pair) -> None:
    pair.device.send(State(("down",)), 0, pair.now_ms)
    assert pair.exchange() == [Delivered(State(("down",)), 0)]
    pair.device.send(State(()), 0, pair.now_ms)
    pair.device.output.clear()  # the release is lost
    assert "down" in pair.host.pressed
    assert [type(news) for news in pair.let(100)] == [Delivered]
    assert not pair.host.pressed
    assert pair.let(1_000) == []  # and is not told again and again


def test_what_is_held_is_let_go_after_300_ms_and_told_again_if_it_is_held_still(pair: Pair) -> None:
    pair.device.send(State(("down",)), 0, pair.now_ms)
    pair.exchange()
    pair.now_ms += 300
    assert pair.host.tick(pair.now_ms) == [Stale()]
    assert pair.host.pressed == ()
    news = pair.let(100)
    assert [item.message for item in news if isinstance(item, Delivered)] == [State(("down",))]


def test_round_trip_and_offset_are_measured_at_both_ends(pair: Pair) -> None:
    pair.device.send(FRAME, 71_000, pair.now_ms)
    pair.let(500)
    assert (pair.host.clock.rtt_ms, pair.device.clock.rtt_ms) == (0, 0)
    assert pair.host.clock_offset_ms == 71_000 - 1_000


# --- peers that lie, flood or echo ---


def test_a_line_that_echoes_is_no_orb_and_keeps_nobody_alive() -> None:
    host = HostSession("orb", 9, 0)
    for now_ms in range(0, 2_000, 10):
        host.receive(bytes(host.output), now_ms)
        host.output.clear()
        assert host.state == "greeting"
    [refused] = host.tick(2_000)
    assert isinstance(refused, Refused)
    pair = met()
    news: list[Received] = []
    for _ in range(100):  # the orb is pulled out, and the line begins to echo
        pair.now_ms += 10
        news += pair.host.tick(pair.now_ms)
        data = bytes(pair.host.output)
        pair.host.output.clear()
        news += pair.host.receive(data, pair.now_ms)
    assert [type(item) for item in news] == [Stale, Lost]


def test_an_orb_that_greets_for_ever_is_given_up_after_two_seconds() -> None:
    host = HostSession("orb", 9, 0)
    offer = encode(Offer(VERSION, bytes(16), False), session=4, sequence=9, t_ms=0)
    for now_ms in range(0, 2_000, 10):
        assert host.receive(offer, now_ms) == []
    assert isinstance(host.tick(2_000)[0], Refused)
    assert len(host.output) < 200


def test_a_host_that_greets_for_ever_costs_no_memory_and_is_given_up() -> None:
    session = DeviceSession(welcome())
    for sequence in range(10_000):
        heard(session, Hello(2, 2, str(sequence), "", False), sequence=sequence, now_ms=0)
    assert len(session.output) < 150
    session.tick(2_001)
    assert session.state == "waiting"


def test_a_hello_that_the_line_doubles_does_not_end_the_session(session: DeviceSession) -> None:
    hello = Hello(VERSION, VERSION, "a number", "", False)
    heard(session, hello, sequence=1, now_ms=0)
    heard(session, JOIN, sequence=2, now_ms=0)
    assert heard(session, hello, sequence=1, now_ms=0) == []
    assert session.live


def test_an_orb_that_lies_about_its_commands_invents_none_and_costs_no_memory(pair: Pair) -> None:
    news: list[Received] = []
    lies: tuple[Message, ...] = (
        numbered(DROP, 2**32 - 1, done=0),  # far ahead
        numbered(DROP, 0, done=0),
        Heartbeat(0, 0, 0, 2**32 - 1, ()),  # done with four thousand million
        numbered(DROP, 5, done=4),
    )
    for sequence, message in enumerate(lies):
        data = encode(message, session=pair.host.number, sequence=100 + sequence, t_ms=0)
        news += pair.host.receive(data, pair.now_ms)
    assert news == [Missed(2**32 - 1)]


def test_a_host_that_lies_about_what_it_has_loses_nothing(pair: Pair) -> None:
    pair.device.send(DROP, 0, pair.now_ms)
    lie = dataclasses.replace(ALIVE, done=2**32 - 1, missed=2**32 - 1)
    heard(pair.device, lie, sequence=65_100, now_ms=pair.now_ms)
    assert len(pair.device.outbox.posted) == 1


def test_a_host_that_acknowledges_nothing_costs_no_memory() -> None:
    session = greeted()
    for now_ms in range(0, 1_900, 5):
        session.send(DROP, 0, now_ms)
        session.tick(now_ms)
    assert len(session.output) < BACKLOG + 200
    assert len(session.outbox.posted) <= 32


def test_what_the_wire_cannot_carry_is_refused_where_it_is_said() -> None:
    session = greeted()
    with pytest.raises(ProtocolError):
        session.send(dataclasses.replace(DROP, name="x" * 41), 0, 0)
    assert session.outbox.number == 0
    assert session.tick(60) == []


def test_pauses_grow_and_hosts_do_not_knock_in_step() -> None:
    assert [pause_s(failures, 0.5) for failures in range(6)] == [0.25, 0.5, 1.0, 2.0, 2.0, 2.0]
    assert (pause_s(0, 0.0), pause_s(0, 1.0)) == (0.1875, 0.3125)


def test_the_handshake_tells_how_far_the_clocks_are_apart_so_that_no_command_is_too_old() -> None:
    device, host = DeviceSession(welcome()), HostSession("orb", 9, 1_000)
    for _ in range(2):
        data = bytes(host.output)
        host.output.clear()
        device.receive(data, 71_000)
        answer = bytes(device.output)
        device.output.clear()
        host.receive(answer, 1_040)
    assert (host.state, host.clock.offset_ms) == ("live", 70_000 - 40)
    device.send(DROP, 0, 71_000)
    assert host.receive(bytes(device.output), 1_300) == [Missed(1)]


def test_granted_time_begins_without_what_was_before_it(session: DeviceSession) -> None:
    join = dataclasses.replace(JOIN, boot_nonce=welcome().boot_nonce)
    greet(session, sequence=1, join=join)
    session.send(DROP, 0, 0)
    said(session)
    greet(session, sequence=5, join=dataclasses.replace(join, granted=True))
    assert [type(packet.message) for packet in said(session)] == [Offer, Welcome, State]
    session.send(DROP, 0, 0)
    [packet] = said(session)
    assert isinstance(packet.message, NumberedCommand)
    assert (packet.message.number, packet.message.done) == (2, 1)


def test_a_new_description_with_a_reason_ends_the_session_by_telling_it() -> None:
    pair = met()
    other = dataclasses.replace(welcome(), labels=("null", "swipe"))
    ended = pair.device.renew(other, "another bundle", pair.now_ms)
    assert ended == [Bye("another bundle")]
    assert not pair.device.live
    assert [packet.message for packet in said(pair.device)] == [Bye("another bundle")]


def test_a_new_description_without_a_reason_is_for_the_next_session() -> None:
    pair = met()
    other = dataclasses.replace(welcome(), labels=("null", "swipe"))
    assert pair.device.renew(other, "", pair.now_ms) == []
    assert pair.let(200) == []
    assert pair.device.live
    pair.device.end("cut")
    pair.host = HostSession("orb", 9, pair.now_ms, past=pair.host.past)
    (connected,) = (item for item in pair.exchange() if isinstance(item, Connected))
    assert connected.welcome.labels == ("null", "swipe")
