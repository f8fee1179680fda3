"""The pump: to its pressure, and never beyond its limits in pressure and time."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.sensors.hardware.driver import Pump, kilopascals
from controller.sensors.hardware.wiring import PumpWiring

WIRING = PumpWiring(target_kpa=2.2, limit_kpa=2.4, longest_s=20.0, rest_s=20.0)


def test_it_inflates_an_orb_and_keeps_its_pressure() -> None:
    pump, kpa, had = Pump(WIRING), 0.0, []
    for k in range(1200):
        kpa += 0.03 * pump.step(k / 10, kpa) - 0.0002 * kpa
        had.append(kpa)
    assert had[0] < 0.1
    assert all(2.1 < kpa < 2.3 for kpa in had[120:])


def test_it_rests_between_long_runs() -> None:
    pump = Pump(WIRING)
    ran = [pump.step(k / 10, 0.01 * k / 10) for k in range(1200)]  # rises slowly
    assert sum(ran[:200]) == pytest.approx(200, abs=1)
    assert not any(ran[201:400])
    assert ran[405]


def test_it_gives_up_where_the_pressure_does_not_rise() -> None:
    pump = Pump(WIRING)
    assert sum(pump.step(k / 10, 0.5) for k in range(6000)) <= 3 * 201
    assert "look for a leak" in pump.problem


def test_too_much_pressure_stops_it_at_once_and_for_good_when_it_lasts() -> None:
    pump = Pump(WIRING)
    assert [pump.step(0.1 * k, kpa) for k, kpa in enumerate((1.0, 2.5, 1.0))] == [True, False, True]
    assert pump.problem == ""  # once may be noise
    assert not any(pump.step(1.0 + k, 2.5) for k in range(5))
    assert "more than its limit of 2.4" in pump.problem
    assert not pump.step(10.0, 1.0)


@pytest.mark.parametrize("kpa", [-5.0, float("nan")])
def test_a_sensor_that_cannot_be_right_stops_it(kpa: float) -> None:
    pump = Pump(WIRING)
    assert not any(pump.step(k / 10, kpa) for k in range(6))
    assert pump.problem


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0.01, 0.2), st.floats(-1.0, 5.0)), max_size=120))
def test_no_pressure_makes_it_run_too_long_or_too_high(steps: list[tuple[float, float]]) -> None:
    pump, now, since = Pump(WIRING), 0.0, None
    for wait_s, kpa in steps:
        now += wait_s
        if not pump.step(now, kpa):
            since = None
            continue
        since = now if since is None else since
        assert kpa < WIRING.limit_kpa
        assert now - since <= WIRING.longest_s + 0.2


def test_volts_become_kilopascals_by_the_sensors_line() -> None:
    assert kilopascals(WIRING, WIRING.zero_v) == 0.0
    assert kilopascals(WIRING, WIRING.zero_v + 2 * WIRING.v_per_kpa) == pytest.approx(2.0)
