"""Scores of a fresh network: calibration and honesty against numbers that are known beforehand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.evaluation import scores
from tests.support.model_commands import examples


@given(hot=st.floats(0.4, 3.0), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_the_temperature_of_overheated_logits_is_found_again(hot: float, seed: int) -> None:
    # Labels drawn from these very probabilities, logits then multiplied: dividing brings them back.
    rng = np.random.default_rng(seed)
    logits = 2.0 * rng.standard_normal((20_000, 4))
    chance = scores.softmax(logits).cumsum(axis=1)
    label = (rng.random((20_000, 1)) > chance[:, :-1]).sum(axis=1)
    assert scores.temperature(hot * logits, label) == pytest.approx(hot, rel=0.06)
    found = scores.calibration(hot * logits, label, hot)
    assert found.error_after < 0.02
    assert found.error_after <= found.error + 0.01
    assert sum(count for _, _, count in found.bins) == 20_000


def test_calibration_is_the_distance_of_confidence_from_accuracy() -> None:
    # Always 75 % sure, right in half of the cases.
    logits = np.log(np.tile([0.75, 0.25], (100, 1)))
    label = np.repeat([0, 1], 50)
    found = scores.calibration(logits, label, 1.0)
    assert found.error == pytest.approx(0.25)
    ((confidence, accuracy, windows),) = found.bins
    assert (round(confidence, 9), accuracy, windows) == (0.75, 0.5, 100)


def test_an_event_is_named_by_its_mean_probability_and_null_has_no_vote() -> None:
    found = examples([0, 1, 1, 1, 0, 2, -1, 2, 2], [0] * 7 + [0, 1])
    sure = np.eye(3)
    probabilities = np.array(
        [sure[0], [0.9, 0.1, 0.0], [0.2, 0.8, 0.0], [0.1, 0.2, 0.7], sure[0], sure[1], sure[2],
         sure[2]]
    )  # fmt: skip
    ends = np.array([0, 1, 2, 3, 4, 5, 7, 8])  # frame 6 is unclear and parts nothing
    label, named = scores.events(found, ends, probabilities)
    assert label.tolist() == [1, 2, 2]  # the last one is of another session
    assert named.tolist() == [1, 1, 2]


def test_honest_and_random_scores_stand_side_by_side_with_their_gap() -> None:
    found = examples([0, 1, 0, 1, 0, 1, 0, 1], [0, 0, 0, 0, 1, 1, 1, 1])
    check, random = np.array([4, 5, 6, 7]), np.array([0, 1])
    named = np.array([0, 1, 0, 0])
    honesty = scores.score_windows(found, (check, named), (random, np.array([0, 1])))
    assert (honesty.unseen, honesty.random, honesty.gap) == (0.75, 1.0, 0.25)
