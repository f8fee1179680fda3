"""Advice: enough or more, what is confused, what is safest. Pure arithmetic, with known answers."""

import pytest

pytest.importorskip("torch", reason="needs the [train] extra")

from models.training import advice

pytestmark = pytest.mark.train


def test_two_gestures_that_are_taken_for_each_other_are_named() -> None:
    labels = ("null", "press", "pinch", "twist")
    table = ((0, 0, 0, 0), (0, 47, 3, 0), (0, 1, 49, 0), (0, 0, 0, 50))
    (line,) = advice.confused(labels, table)
    assert line.startswith("press and pinch are taken for each other in 4 of 100 events")
    assert "merge them" in line
    assert not advice.confused(labels, ((0, 0, 0, 0), (0, 50, 0, 0), (0, 0, 50, 0), (0, 0, 0, 50)))
