"""Orb pace: from the times of commands to a gravity that leaves room for eight of them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tetris.engine.modes import FIRST_LEVEL, Pace, level_for
from tetris.engine.rules import seconds_per_row


def paced(*intervals_s: float) -> Pace:
    pace, now_s = Pace(), 0.0
    pace.command(now_s)
    for interval_s in intervals_s:
        now_s += interval_s
        pace.command(now_s)
    return pace


@pytest.mark.parametrize(
    ("rate_hz", "level"),
    [
        (0.3, 1),  # 8 commands in 27 s: slower than any level
        (0.4, 1),  # 20 s, as long as 20 rows at level 1
        (0.5, 1),  # 16 s, and level 2 gives 15.9: just not
        (0.7, 3),  # 11.4 s in 12.4
        (1.0, 4),  # 8 s in 9.5
        (5.0, 9),  # a quick thumb
        (1e9, 20),
    ],
)
def test_the_faster_the_hand_the_faster_the_fall(rate_hz: float, level: int) -> None:
    assert level_for(rate_hz) == level


@given(st.floats(0.41, 100.0))
def test_it_is_the_highest_level_that_leaves_time_for_eight_commands(rate_hz: float) -> None:
    level = level_for(rate_hz)
    assert 20 * seconds_per_row(level) >= 8 / rate_hz
    assert level == 20 or 20 * seconds_per_row(level + 1) < 8 / rate_hz


def test_until_the_player_is_known_it_is_level_3() -> None:
    assert paced(*[0.1] * 7).level == FIRST_LEVEL == 3
    assert paced(*[0.1] * 7).rate_hz is None
    assert paced(*[0.1] * 8).level > 3


def test_a_command_every_second_and_a_half_is_level_2() -> None:
    pace = paced(*[1.5] * 10)
    assert pace.rate_hz == pytest.approx(1 / 1.5)
    assert pace.level == 3
    assert paced(*[1.7] * 10).level == 2


@pytest.mark.parametrize(
    ("intervals_s", "rate_hz"),
    [
        ([3.0, *[0.5] * 23], 24 / 14.5),
        ([3.0, *[0.5] * 24], 2.0),  # the last twenty-four count
        ([4.0] * 8, 0.25),
        ([4.001] * 8, None),  # longer than four seconds
        ([*[1.0] * 8, 60.0, *[1.0] * 4], 1.0),  # a long rest
        ([*[2.0] * 30, *[0.5] * 24], 2.0),  # a hand that warms up
    ],
)
def test_the_rate_is_that_of_the_last_intervals(intervals_s: list[float], rate_hz: float) -> None:
    assert paced(*intervals_s).rate_hz == pytest.approx(rate_hz)


def test_an_interrupted_interval_does_not_count() -> None:
    pace = paced(*[1.0] * 8)
    pace.interrupt()
    pace.command(11.5)
    assert pace.rate_hz == pytest.approx(1.0)


def test_commands_of_one_moment_are_as_fast_as_can_be() -> None:
    assert paced(*[0.0] * 9).level == 20
