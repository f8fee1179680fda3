"""The pump: to its pressure, and never beyond its limits in pressure and time."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.sensors.hardware.pump import Pump, kilopascals
from controller.sensors.hardware.wiring import PumpWiring

WIRING = PumpWiring(target_kpa=2.2, limit_kpa=2.4, longest_s=20.0, rest_s=20.0)


def run(seconds: float, rise_kpa_s: float, leak: float = 0.0, start: float = 0.0) -> list[float]:
    """An orb of this pump, ten times a second; what it had."""
    pump, kpa, had = Pump(WIRING), start, []
    for k in range(round(seconds * 10)):
        kpa += 0.1 * (rise_kpa_s if pump.step(k / 10, kpa) else 0.0) - 0.1 * leak * kpa
        had.append(kpa)
    return had


def test_it_inflates_an_orb_and_keeps_its_pressure() -> None:
    had = run(120.0, 0.3, leak=0.002)
    assert had[0] < 0.1
    assert all(2.1 < kpa < 2.3 for kpa in had[120:])


def test_it_rests_between_long_runs() -> None:
    pump = Pump(WIRING)
    ran = [pump.step(k / 10, 0.01 * k / 10) for k in range(1200)]  # rises slowly
    assert sum(ran[:200]) == pytest.approx(200, abs=1)
    assert not any(ran[201:400])
    assert ran[405]


def test_it_gives_up_where_the_pressure_does_not_rise() -> None:
    pump, ran = Pump(WIRING), 0
    for k in range(6000):
        ran += pump.step(k / 10, 0.5)
    assert ran <= 3 * 201
    assert "look for a leak" in pump.problem


def test_too_much_pressure_stops_it_at_once_and_for_good_when_it_lasts() -> None:
    pump = Pump(WIRING)
    assert pump.step(0.0, 1.0)
    assert not pump.step(0.1, 2.5)
    assert pump.problem == ""  # once may be noise
    assert pump.step(0.2, 1.0)
    for k in range(5):
        assert not pump.step(1.0 + k, 2.5)
    assert "more than its limit of 2.4" in pump.problem
    assert not pump.step(10.0, 1.0)


@pytest.mark.parametrize("kpa", [-5.0, float("nan")])
def test_a_sensor_that_cannot_be_right_stops_it(kpa: float) -> None:
    pump = Pump(WIRING)
    for k in range(6):
        assert not pump.step(k / 10, kpa)
    assert pump.problem


def _never_too_long(steps: list[tuple[float, float]], step: Callable[[float, float], bool]) -> None:
    now, since = 0.0, None
    for wait_s, kpa in steps:
        now += wait_s
        if step(now, kpa):
            since = now if since is None else since
            assert kpa < WIRING.limit_kpa
            assert now - since <= WIRING.longest_s + 0.2
        else:
            since = None


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0.01, 0.2), st.floats(-1.0, 5.0)), max_size=120))
def test_no_pressure_makes_it_run_too_long_or_against_its_limit(
    steps: list[tuple[float, float]],
) -> None:
    _never_too_long(steps, Pump(WIRING).step)


def test_volts_become_kilopascals_by_the_sensors_line() -> None:
    assert kilopascals(WIRING, WIRING.zero_v) == 0.0
    assert kilopascals(WIRING, WIRING.zero_v + 2 * WIRING.v_per_kpa) == pytest.approx(2.0)
