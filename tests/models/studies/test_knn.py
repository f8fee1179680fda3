"""Information from distances, where the answer is known, and where time would give it away."""

import numpy as np
import pytest

from models.studies.information.knn import Exclusion, ksg, ross
from tests.support import gaussian_cases
from tests.support.gaussian_cases import close


@pytest.mark.parametrize(("classes", "dimensions"), [(2, 1), (3, 2), (5, 5), (5, 10)])
def test_rosss_estimate_of_a_mixture_is_close(classes: int, dimensions: int) -> None:
    x, y = gaussian_cases.Mixture.of(classes, dimensions).draw(4000, np.random.default_rng(1))
    assert close(float(ross(x, y).mean()), gaussian_cases.TRUTHS[classes, dimensions], dimensions)


@pytest.mark.parametrize("dimensions", [1, 2])
def test_kraskovs_estimate_finds_a_known_correlation(dimensions: int) -> None:
    rng = np.random.default_rng(2)
    x, noise = rng.normal(size=(2, 3000, dimensions))
    truth = -0.5 * dimensions * np.log(1.0 - 0.6**2)
    assert close(float(ksg(x, 0.6 * x + 0.8 * noise).mean()), truth, dimensions)
    assert ksg(x, noise).mean() == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize(("classes", "dimensions"), gaussian_cases.TRUTHS)
def test_ten_thousand_draws_agree_with_ten_million(classes: int, dimensions: int) -> None:
    found, error = gaussian_cases.Mixture.of(classes, dimensions).sampled(10_000)
    assert abs(found - gaussian_cases.TRUTHS[classes, dimensions]) < 4 * error


@pytest.mark.train
def test_rosss_estimate_is_scikit_learns_in_one_dimension() -> None:
    selection = pytest.importorskip("sklearn.feature_selection", reason="needs [train]")
    x, y = gaussian_cases.Mixture.of(3, 1).draw(800, np.random.default_rng(5))
    scaled = x / x.std(axis=0)  # so does scikit-learn, which adds a little noise
    (theirs,) = selection.mutual_info_classif(x, y, n_neighbors=3, random_state=0)
    assert ross(scaled, y).mean() == pytest.approx(theirs, abs=0.01)


def test_frames_of_one_touch_know_one_another_and_no_other_touch_does() -> None:
    # Touches look like nothing but themselves: their classes are coins. Neighbours in time give
    # the coin away, neighbours of other touches do not.
    rng = np.random.default_rng(6)
    touch = np.repeat(np.arange(100), 10)
    x = rng.normal(size=(100, 3))[touch] + 0.01 * rng.normal(size=(1000, 3))
    y = rng.integers(0, 2, 100)[touch]
    exclusion = Exclusion(touch, np.arange(1000), np.zeros(1000, dtype=int))
    assert ross(x, y).mean() > 0.6
    assert np.nanmean(ross(x, y, exclusion)) < 0.1


def test_what_is_close_in_time_is_left_out_within_a_session_only() -> None:
    session, time = np.array([0, 0, 0, 1]), np.array([0, 2, 9, 2])
    exclusion = Exclusion(np.arange(4), time, session, window=3)
    assert exclusion.mask(np.arange(2)).tolist() == [
        [True, True, False, False],
        [True, True, False, False],
    ]


def test_a_point_without_neighbours_of_its_class_says_nothing() -> None:
    x, y = np.arange(6.0)[:, None], np.array([0, 0, 0, 0, 1, 1])
    part = ross(x, y)
    assert np.isfinite(part[:4]).all()
    assert np.isnan(part[4:]).all()
