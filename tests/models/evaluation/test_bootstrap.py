"""Intervals: how often they hold, against draws whose truth is known."""

import numpy as np
import pytest

from models.evaluation import bootstrap


def test_an_interval_of_independent_events_is_the_binomial_one() -> None:
    rng = np.random.default_rng(1)
    right = rng.binomial(50, 0.9, size=200)  # 10,000 events of 200 sessions
    figure = bootstrap.share(right, np.full(200, 50))
    deviation = np.sqrt(0.9 * 0.1 / 10_000)
    assert figure.value == pytest.approx(0.9, abs=3 * deviation)
    assert figure.high - figure.low == pytest.approx(2 * 1.96 * deviation, rel=0.2)


def test_nineteen_of_twenty_intervals_hold_the_truth() -> None:
    rng = np.random.default_rng(2)
    held = 0
    for seed in range(200):
        figure = bootstrap.rate(rng.poisson(0.5, 40), np.full(40, 10.0), seed)
        held += figure.low <= 0.05 <= figure.high
    assert 175 <= held <= 199


def test_a_silence_promises_no_more_than_the_rule_of_three() -> None:
    figure = bootstrap.rate(np.zeros(20), np.full(20, 50.0))
    assert (figure.value, figure.low, figure.high) == (0.0, 0.0, 0.003)
    assert bootstrap.share([100] * 3, [100] * 3).low == pytest.approx(0.99)


def test_one_session_gives_no_interval() -> None:
    figure = bootstrap.share([9], [10])
    assert str(figure) == "0.9000"
    assert np.isnan(figure.low)


def test_a_share_of_nothing_has_no_bounds() -> None:
    figure = bootstrap.share([0], [0])
    assert np.isnan([figure.value, figure.low, figure.high]).all()


def test_medians_and_means_pool_what_the_sessions_measured() -> None:
    lists = [np.array([0.2, 0.3, 0.4]), np.array([]), np.array([0.3, 0.5])]
    assert bootstrap.median(lists).value == pytest.approx(0.3)
    assert bootstrap.mean(lists).value == pytest.approx(0.34)
    assert np.isnan(bootstrap.mean([]).value)
    assert bootstrap.f1([8, 9], [10, 10], [10, 10]).value == pytest.approx(0.85)
    assert str(bootstrap.f1([8, 9], [10, 10], [10, 10])).startswith("0.8500 (0.8")


def test_who_is_always_sure_and_right_knows_all_of_the_label() -> None:
    y = np.arange(300) % 3
    found = bootstrap.event_gain(np.zeros(300), y, np.arange(300))
    assert found.value == pytest.approx(np.log(3))
    assert found.low <= found.value
    part = np.where(np.arange(300) < 150, 0.0, np.nan)  # what was not tested does not count
    assert bootstrap.event_gain(part, y, np.arange(300)).value == pytest.approx(np.log(3))
