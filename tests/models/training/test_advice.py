"""Advice: enough or more, what is confused, what is safest. Pure arithmetic, with known answers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("torch", reason="needs the [train] extra")

from models.training import advice

pytestmark = pytest.mark.train


@given(error=st.floats(0.02, 0.9), slope=st.floats(-1.5, -0.2), examples=st.integers(30, 500))
def test_a_power_law_is_read_back_from_its_curve(error: float, slope: float, examples: int) -> None:
    curve = [(share * examples, error * share**slope) for share in (0.25, 0.5, 1.0)]
    assert advice.slope_of(curve, held=10_000) == pytest.approx(slope, abs=1e-6)


def test_as_many_more_are_asked_for_as_halve_the_errors() -> None:
    # Errors of 8 % that fall with the square root of the examples: four times as many would
    # halve them; but nobody is asked for more than has been recorded already.
    assert advice.needed(100, 0.08, -0.5) == 100
    assert advice.needed(100, 0.08, -1.0) == 100  # in proportion: twice as many halve them
    assert advice.needed(100, 0.015, -1.0) == 50  # to one in a hundred: half as many again


def test_enough_is_enough() -> None:
    assert advice.needed(100, 0.005, -1.0) == 0  # one in two hundred
    assert advice.needed(100, 0.3, 0.0) == 0  # more would change nothing
    assert advice.needed(7, 0.0, 0.0) == advice.FEW - 7  # nobody can know yet


def test_two_gestures_that_are_taken_for_each_other_are_named() -> None:
    labels = ("null", "press", "pinch", "twist")
    table = ((0, 0, 0, 0), (0, 47, 3, 0), (0, 1, 49, 0), (0, 0, 0, 50))
    (line,) = advice.confused(labels, table)
    assert line.startswith("press and pinch are taken for each other in 4 of 100 events")
    assert "merge them" in line
    assert not advice.confused(labels, ((0, 0, 0, 0), (0, 50, 0, 0), (0, 0, 50, 0), (0, 0, 0, 50)))


def test_what_cannot_be_taken_back_goes_to_the_most_reliable_gesture() -> None:
    labels = ("null", "press", "pinch")
    table = ((0, 0, 0), (0, 50, 0), (0, 5, 95))
    # Five pinches are taken for a press: of a hundred pinches 95 are, of 55 presses 50.
    (line,) = advice.safest(labels, table, {"press": "drop", "pinch": "left"})
    assert line.startswith("drop cannot be taken back: give it to pinch (95.0% sure)")
    assert line.endswith("rather than to press (90.9%)")
    assert not advice.safest(labels, table, {"press": "left", "pinch": "drop"})
