"""Bounds on the information of a bundle's answers: never too much, by touches, on other days."""

import math

import numpy as np
import pytest

from controller.bundles import bundle
from models.data.simulate import DataSet
from models.studies.paper import section6
from models.studies.paper.section6 import Answers
from tests.support.recordings import of, origin


def test_a_gesture_is_told_by_all_of_its_windows() -> None:
    # Each window is right with 3 : 1; the ten of a gesture together leave little doubt, and the
    # temperature of gestures says so.
    rng = np.random.default_rng(5)
    event = np.repeat(np.arange(400), 10)
    y = rng.integers(1, 3, 400)[event]
    right = rng.random(4000) < 0.75
    given = np.full((4000, 3), 1e-9)
    given[np.arange(4000), np.where(right, y, 3 - y)] = 0.75
    given[np.arange(4000), np.where(right, 3 - y, y)] = 0.25
    found = section6.bounds(Answers(np.log(given), y, event % 2, event))
    window = math.log(2) + 0.75 * math.log(0.75) + 0.25 * math.log(0.25)
    assert found["window"][0] == pytest.approx(window, abs=0.02)
    assert found["gestures"] == 400
    assert 0.5 < found["gesture"][0] <= found["h_gesture"] + 1e-6


@pytest.mark.parametrize("rate_hz", [10.0, 40.0])
def test_the_bundle_that_ships_says_something_about_another_day(rate_hz: float) -> None:
    loaded = bundle.read(bundle.default_path(rate_hz))
    days = [DataSet(minutes=0.5, rate_hz=rate_hz).session(0, day) for day in range(2)]
    answers = section6.answers(loaded, days)
    assert set(answers.session) == {0, 1}
    for event in np.unique(answers.event):
        own = answers.event == event
        assert len(set(answers.y[own])) == len(set(answers.session[own])) == 1
    found = section6.bounds(answers)
    assert 0.2 < found["window"][0] < found["h_y"] < math.log(5)


def test_recordings_of_another_sensor_are_refused() -> None:
    loaded = bundle.read(bundle.default_path())
    small = of(np.ones((50, 2, 2)), origin(2, 2), label=np.zeros(50))
    with pytest.raises(ValueError, match="2×2"):
        section6.answers(loaded, [small])
