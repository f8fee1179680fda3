"""Bounds on what was held out: never too much, and nothing that was learned from."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from models.studies.information import gaussians
from models.studies.information.windows import Taken
from tests.support.recordings import played

pytestmark = pytest.mark.train
pytest.importorskip("torch", reason="needs the [train] extra")

from models.studies.information import classifier_bound, infonce  # noqa: E402
from models.studies.information.windows import take  # noqa: E402


def dealt(x: NDArray[np.float64], y: NDArray[np.int64], sessions: int = 4) -> Taken:
    index = np.arange(len(x))
    nowhere = np.full((len(x), 2), np.nan, dtype=np.float32)
    labels = tuple(str(i) for i in range(int(y.max()) + 1))
    return Taken(x[:, None].astype(np.float32), y, index % sessions, index // sessions, index,
                 nowhere, labels, 10.0, (1, x.shape[1]))  # fmt: skip


@pytest.mark.parametrize(("classes", "dimensions"), [(3, 2)])
def test_a_classifier_says_nearly_as_much_as_there_is(classes: int, dimensions: int) -> None:
    x, y = gaussians.Mixture.of(classes, dimensions).draw(2000, np.random.default_rng(1))
    truth = gaussians.truths()[gaussians.name(classes, dimensions)]
    taken = dealt(x, y)
    found = classifier_bound.windows(taken, classifier_bound.told(taken, epochs=8).scaled)
    assert truth - 0.12 < found.value < truth + 0.05
    assert found.low < found.value < found.high


def test_a_contrast_says_no_more_than_there_is() -> None:
    x, y, truth = gaussians.correlated(2, 0.8, 3000, np.random.default_rng(2))
    folds = classifier_bound.folds(dealt(x, np.zeros(3000, dtype=int)))
    part = infonce.info_nce(x, y, folds, epochs=12)
    assert np.isfinite(part).all()
    assert 0.5 * truth < part.mean() < truth + 0.05


def test_noise_says_nothing_and_a_bound_may_say_less_than_nothing() -> None:
    rng = np.random.default_rng(3)
    taken = dealt(rng.normal(size=(800, 5)), rng.integers(0, 3, 800))
    assert (
        classifier_bound.windows(taken, classifier_bound.told(taken, epochs=4).scaled).value < 0.02
    )


@pytest.mark.parametrize("sessions", [1, 2, 3, 5])
def test_every_window_is_tested_and_none_of_its_fold_is_learned(sessions: int) -> None:
    rng = np.random.default_rng(4)
    taken = dealt(rng.normal(size=(400, 2)), rng.integers(0, 2, 400), sessions)
    folds = classifier_bound.folds(taken)
    assert np.sum([fold.test for fold in folds], axis=0).tolist() == [1] * 400
    for fold in folds:
        assert not (fold.train & fold.check).any()
        assert not ((fold.train | fold.check) & fold.test).any()
        if sessions > 1:
            learned = set(taken.session[fold.train]) | set(taken.session[fold.check])
            assert learned.isdisjoint(taken.session[fold.test])
        else:  # nothing that shares frames with what is tested
            gap = np.abs(taken.frame[fold.test][:, None] - taken.frame[fold.train][None]).min()
            assert gap > taken.x.shape[1]


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
    taken = Taken(np.zeros((4000, 1, 1), np.float32), y, event % 2, np.arange(4000), event, nowhere,
                  ("null", "a", "b"), 10.0, (1, 1))  # fmt: skip
    told = classifier_bound.rescaled(taken, given)
    window = math.log(2) + 0.75 * math.log(0.75) + 0.25 * math.log(0.25)
    assert classifier_bound.windows(taken, told.scaled).value == pytest.approx(window, abs=0.02)
    assert classifier_bound.gestures(taken, told).value > 0.5


def test_an_orbs_windows_say_something_about_gestures_on_another_day() -> None:
    taken = take([played(seed=seed) for seed in range(3)])
    few = taken.every(4)
    told = classifier_bound.told(few, epochs=6, shape=classifier_bound.Shape.of(few))
    assert 0.2 < classifier_bound.windows(few, told.scaled).value < math.log(5)
    y, sure = classifier_bound.of_gestures(few, told.scaled)
    assert len(y) == len(np.unique(few.event[few.y > 0]))
    assert sure.sum(axis=1) == pytest.approx(1.0)
