"""Forests of the benchmarks: kept as plain arrays, and asked without scikit-learn."""

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the [train] extra")
pytest.importorskip("sklearn", reason="needs the [train] extra")

from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor

from tests.benchmarks.baselines.forest import Forest

pytestmark = pytest.mark.train


@pytest.mark.parametrize("kind", ["classes", "numbers"])
def test_a_forest_of_arrays_answers_as_the_one_that_was_trained(kind: str) -> None:
    rng = np.random.default_rng(0)
    # Few different values, so that many rows are exactly at a threshold.
    rows = np.round(rng.normal(size=(600, 6)), 1).astype(np.float32)
    if kind == "classes":
        label = (rows[:, 0] > 0).astype(int) + (rows[:, 1] * rows[:, 2] > 0.2)
        trained = RandomForestClassifier(12, random_state=0).fit(rows, label)
        expected = trained.predict_proba(rows)
    else:
        trained = RandomForestRegressor(12, random_state=0).fit(rows, rows[:, :2] ** 2)
        expected = trained.predict(rows)
    forest = Forest.of(trained)
    np.testing.assert_allclose(forest(rows), expected, atol=1e-6)
    again = Forest.from_arrays(forest.arrays())
    assert (again(rows[:50]) == forest(rows[:50])).all()
    assert forest(rows[:0]).shape == (0, expected.shape[1])
