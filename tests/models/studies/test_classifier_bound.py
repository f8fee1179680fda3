"""Bounds on what was held out: never too much, and nothing that was learned from."""

import math

import numpy as np
import pytest

from models.studies.information.windows import Windows, cut
from tests.support import gaussian_cases
from tests.support.gaussian_cases import as_windows
from tests.support.recordings import played

pytestmark = pytest.mark.train
pytest.importorskip("torch", reason="needs the [train] extra")

from models.studies.information import classifier_bound  # noqa: E402


@pytest.mark.parametrize(("classes", "dimensions"), [(3, 2)])
def test_a_classifier_says_nearly_as_much_as_there_is(classes: int, dimensions: int) -> None:
    x, y = gaussian_cases.Mixture.of(classes, dimensions).draw(2000, np.random.default_rng(1))
    truth = gaussian_cases.TRUTHS[classes, dimensions]
    windows = as_windows(x, y)
    answers = classifier_bound.held_out(windows, epochs=8)
    found = classifier_bound.window_bound(windows, answers.log_p)
    assert truth - 0.12 < found.value < truth + 0.05
    assert found.low < found.value < found.high


@pytest.mark.parametrize("sessions", [1, 2, 3, 5])
def test_every_window_is_tested_and_none_of_its_fold_is_learned(sessions: int) -> None:
    rng = np.random.default_rng(4)
    windows = as_windows(rng.normal(size=(400, 2)), rng.integers(0, 2, 400), sessions)
    folds = classifier_bound.folds(windows)
    assert np.sum([fold.test for fold in folds], axis=0).tolist() == [1] * 400
    for fold in folds:
        assert not (fold.train & fold.check).any()
        assert not ((fold.train | fold.check) & fold.test).any()
        if sessions > 1:
            learned = set(windows.session[fold.train]) | set(windows.session[fold.check])
            assert learned.isdisjoint(windows.session[fold.test])
        else:  # nothing that shares frames with what is tested
            gap = np.abs(windows.frame[fold.test][:, None] - windows.frame[fold.train][None]).min()
            assert gap > windows.x.shape[1]


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
    nowhere = np.full((4000, 2), np.nan, dtype=np.float32)
    windows = Windows(np.zeros((4000, 1, 1), np.float32), y, event % 2, np.arange(4000), event,
                      nowhere, ("null", "a", "b"), 10.0, (1, 1))  # fmt: skip
    answers = classifier_bound.rescaled(windows, given)
    window = math.log(2) + 0.75 * math.log(0.75) + 0.25 * math.log(0.25)
    found = classifier_bound.window_bound(windows, answers.log_p)
    assert found.value == pytest.approx(window, abs=0.02)
    assert classifier_bound.gesture_bound(windows, answers).value > 0.5


def test_an_orbs_windows_say_something_about_gestures_on_another_day() -> None:
    windows = cut([played(seed=seed) for seed in range(3)])
    few = windows.every(4)
    answers = classifier_bound.held_out(few, epochs=6, variation=classifier_bound.Variation.of(few))
    assert 0.2 < classifier_bound.window_bound(few, answers.log_p).value < math.log(5)
    y, sure = classifier_bound.gestures(few, answers.log_p)
    assert len(y) == len(np.unique(few.event[few.y > 0]))
    assert sure.sum(axis=1) == pytest.approx(1.0)
