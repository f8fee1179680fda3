"""The orb marathon: from the times of commands to a gravity that leaves room for eight of them."""

import pytest

from tetris.engine.modes import Pace, gravity_for, pace_of


def paced(*intervals_s: float, lines: int = 0) -> Pace:
    pace, now_s = Pace(), 0.0
    pace.command(now_s, lines)
    for interval_s in intervals_s:
        now_s += interval_s
        pace.command(now_s, lines)
    return pace


@pytest.mark.parametrize(
    ("pace_hz", "row_us"),
    [
        (0.4, 1_000_000),  # 8 commands in 20 s, as long as 20 rows at level 1
        (1.0, 400_000),
        (3.0, 133_333),
        (1e9, 1_000),  # nothing falls faster
        (0.01, 9_999_999),  # nor slower
    ],
)
def test_twenty_rows_last_as_long_as_eight_commands(pace_hz: float, row_us: int) -> None:
    assert gravity_for(pace_hz).row_us == row_us


def test_the_pace_is_that_of_the_gravity_and_0_where_gravity_is_the_levels() -> None:
    assert pace_of(gravity_for(1.25).row_us) == pytest.approx(1.25)
    assert pace_of(None) == 0.0


def test_until_the_player_is_known_there_is_room_for_two_commands_in_three_seconds() -> None:
    assert paced(*[0.5] * 11).rate_hz is None
    assert paced(*[0.5] * 11).gravity(0) == gravity_for(0.65)
    assert paced(*[0.5] * 12).gravity(0) == gravity_for(2.0)


def test_the_pace_rises_by_a_tenth_with_every_ten_lines() -> None:
    pace = paced(*[0.5] * 12)
    assert pace.gravity(9) == gravity_for(2.0)
    assert pace.gravity(10) == gravity_for(2.2)
    assert pace.gravity(25) == gravity_for(2.42)


def test_a_hand_that_slows_down_makes_nothing_slower() -> None:
    pace = paced(*[0.5] * 24, *[2.0] * 24)
    assert pace.rate_hz == pytest.approx(0.5)
    assert pace.gravity(0) == gravity_for(2.0)


def test_after_ten_lines_a_faster_hand_makes_nothing_faster() -> None:
    pace = paced(*[0.1] * 24, lines=10)
    assert pace.rate_hz == pytest.approx(10.0)
    assert pace.gravity(10) == gravity_for(0.65 * 1.1)


def test_a_game_that_was_recorded_goes_on_at_its_pace() -> None:
    assert Pace(2.42, lines=25).gravity(29) == gravity_for(2.42)


@pytest.mark.parametrize(
    ("intervals_s", "rate_hz"),
    [
        ([3.0, *[0.5] * 23], 24 / 14.5),
        ([3.0, *[0.5] * 24], 2.0),  # the last twenty-four count
        ([4.0] * 12, 0.25),
        ([4.001] * 12, None),  # longer than four seconds
        ([*[1.0] * 8, 60.0, *[1.0] * 9], 1.0),  # a long rest
        ([*[2.0] * 30, *[0.5] * 24], 2.0),  # a hand that warms up
    ],
)
def test_the_rate_is_that_of_the_last_intervals(intervals_s: list[float], rate_hz: float) -> None:
    assert paced(*intervals_s).rate_hz == pytest.approx(rate_hz)


def test_an_interrupted_interval_does_not_count() -> None:
    pace = paced(*[1.0] * 16)
    pace.interrupt()
    pace.command(19.5)
    assert pace.rate_hz == pytest.approx(1.0)
