"""Commands on their way, and how far away the other end is: numbers in, numbers out."""

import pytest

from controller.shared.protocol.messages import LATE_MS, Command
from controller.shared.protocol.packets import NEVER, ClockSync
from controller.shared.protocol.retransmit import MOST, RetransmitQueue

DROP = Command("drop", "pinch", 0.5, None, 1)


def filled(count: int, *, every_ms: int = 0) -> RetransmitQueue:
    box = RetransmitQueue()
    for number in range(count):
        box.put(DROP, 0, number * every_ms)
    return box


def numbers(box: RetransmitQueue) -> list[int]:
    return [posted.number for posted in box.posted]


def test_an_acknowledgement_counts_for_all_before_it() -> None:
    box = filled(5)
    assert (numbers(box), box.done, box.missed) == ([1, 2, 3, 4, 5], 0, 0)
    box.acknowledge(3)
    assert (numbers(box), box.done, box.lost) == ([4, 5], 3, 0)
    box.acknowledge(2)
    assert numbers(box) == [4, 5]
    box.acknowledge(5)
    assert (numbers(box), box.done) == ([], 5)


def test_an_acknowledgement_of_what_was_never_sent_is_a_lie() -> None:
    box = filled(2)
    box.acknowledge(3)
    assert numbers(box) == [1, 2]


def test_what_is_too_old_is_given_up_and_counted() -> None:
    box = filled(3, every_ms=100)
    box.expire(LATE_MS)
    assert box.lost == 0
    box.expire(LATE_MS + 1)
    assert (numbers(box), box.done, box.lost) == ([2, 3], 1, 1)
    box.put(DROP, 0, 10_000)
    assert (numbers(box), box.done, box.lost) == ([4], 3, 3)


def test_a_flood_of_commands_costs_no_memory() -> None:
    box = filled(1_000)
    assert len(box.posted) == MOST
    assert box.lost == 1_000 - MOST
    assert box.done == 1_000 - MOST


def test_another_host_has_no_claim_on_what_was_before_it() -> None:
    box = filled(3)
    box.begin(host=7)
    assert (numbers(box), box.done, box.lost, box.host) == ([], 3, 3, 7)


@pytest.mark.parametrize("start_ms", [0, 2**32 - 50])
def test_two_clocks_are_compared_to_within_half_a_round_trip(start_ms: int) -> None:
    here, there = ClockSync(), ClockSync()
    now_ms, ahead_ms = 1_000, start_ms
    for _ in range(10):
        there.take(*here.stamps(now_ms), now_ms + ahead_ms + 10)
        now_ms += 60  # 10 ms on the way, 30 held, 20 on the way back
        here.take(*there.stamps(now_ms - 20 + ahead_ms), now_ms)
    assert here.rtt_ms == 30
    assert here.offset_ms is not None
    assert abs((here.offset_ms - ahead_ms + 2**31) % 2**32 - 2**31) <= 15
    age_ms = here.age_ms((now_ms + ahead_ms - 200) & 0xFFFFFFFF, now_ms)
    assert age_ms is not None
    assert abs(age_ms - 200) <= 15


def test_the_shortest_round_trip_tells_the_offset_best() -> None:
    echo = ClockSync()
    echo.take(sent_ms=5_002, echo_ms=1_000, held_ms=0, now_ms=1_004)
    assert (echo.rtt_ms, echo.offset_ms) == (4, 4_000)
    echo.take(sent_ms=5_100, echo_ms=1_090, held_ms=0, now_ms=1_190)  # 90 ms late, one way
    assert (echo.rtt_ms, echo.offset_ms) == (100, 4_000)


@pytest.mark.parametrize(("now_ms", "rtt_ms"), [(10_000, 10_000), (10_001, None)])
def test_a_round_trip_of_more_than_ten_seconds_is_none(now_ms: int, rtt_ms: int | None) -> None:
    echo = ClockSync()
    echo.take(sent_ms=1, echo_ms=0, held_ms=0, now_ms=now_ms)
    assert echo.rtt_ms == rtt_ms


def test_of_the_last_thirty_two_round_trips_the_shortest_counts() -> None:
    echo = ClockSync()
    echo.take(sent_ms=5_002, echo_ms=1_000, held_ms=0, now_ms=1_004)
    for number in range(1, 33):
        assert echo.offset_ms == 4_000
        sent_ms = 1_000 + 100 * number
        echo.take(sent_ms + 4_060, sent_ms, 0, sent_ms + 100)  # 100 ms, and 10 off
    assert echo.offset_ms == 4_010


def test_two_samples_may_differ_by_half_of_both_round_trips_and_two_milliseconds() -> None:
    for off_ms, offset_ms in ((5, 4_000), (6, 4_006)):
        echo = ClockSync()
        for sent_ms, trip_ms, wrong_ms in ((1_000, 2, 0), (1_100, 4, off_ms)):
            there_ms = sent_ms + 4_000 + trip_ms // 2 + wrong_ms
            echo.take(there_ms, sent_ms, 0, sent_ms + trip_ms)
        assert echo.offset_ms == offset_ms


def test_a_clock_that_was_set_is_noticed() -> None:
    echo = ClockSync()
    echo.take(sent_ms=5_002, echo_ms=1_000, held_ms=0, now_ms=1_004)
    echo.take(sent_ms=902, echo_ms=2_000, held_ms=0, now_ms=2_010)
    assert echo.offset_ms == 902 + 5 - 2_010


def test_nothing_is_measured_before_something_came_back_nor_from_nonsense() -> None:
    echo = ClockSync()
    assert echo.stamps(5) == (5, 0, NEVER)
    echo.take(1, 0, NEVER, 10)
    echo.take(1, 5_000, 0, 10)  # an echo of what was not said yet
    echo.take(1, 0, 0, 1_000_000)  # or of an hour ago
    assert (echo.rtt_ms, echo.offset_ms, echo.age_ms(1, 10)) == (None, None, None)
    assert echo.stamps(1_000_002) == (1_000_002, 1, 2)
