"""The host's end of the conversation, and both together: bytes and milliseconds go in."""

import dataclasses
import zlib

import pytest

from controller.shared.protocol import codec
from controller.shared.protocol.device_session import DeviceSession
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
    Message,
    Offer,
    Refuse,
    State,
)
from controller.shared.protocol.packets import encode
from controller.shared.protocol.retransmit import SessionHistory
from tests.support.fake_device import welcome
from tests.support.manual_host import JOIN, numbered
from tests.support.sessions import ALIVE, DROP, FINGER, FRAME, Pair, greeted, heard, met, said


@pytest.fixture
def pair() -> Pair:
    return met()


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
