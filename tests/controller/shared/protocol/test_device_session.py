"""The device's end of the conversation: bytes and milliseconds go in."""

import dataclasses

import pytest

from controller.shared.protocol.codec import ProtocolError
from controller.shared.protocol.device_session import BACKLOG, GRANTED_BACKLOG, DeviceSession
from controller.shared.protocol.messages import (
    VERSION,
    Bye,
    Contacts,
    ContactState,
    Grant,
    Heartbeat,
    Hello,
    Message,
    NumberedCommand,
    Offer,
    Perform,
    Refuse,
    State,
    Welcome,
)
from controller.shared.protocol.packets import NEVER, encode
from tests.support.fake_device import welcome
from tests.support.manual_host import HELLO, JOIN
from tests.support.sessions import ALIVE, DROP, FINGER, FRAME, greet, greeted, heard, said


@pytest.fixture
def session() -> DeviceSession:
    return DeviceSession(welcome())


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


def test_without_a_host_messages_are_dropped_and_counted_and_commands_wait() -> None:
    session = DeviceSession(welcome())
    for message in (FRAME, State(("down",)), DROP):
        session.send(message, 0, 0)
    assert (session.dropped, len(session.outbox.posted), bytes(session.output)) == (2, 1, b"")


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
