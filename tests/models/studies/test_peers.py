"""Peers of CNN-3D: the same windows in, a probability of each class out."""

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the [train] extra")
pytest.importorskip("sklearn", reason="needs the [train] extra")

from models.data.recipe import NetworkRecipe
from models.studies.sweep import peers
from models.studies.sweep.peers import PEERS

pytestmark = pytest.mark.train

RECIPE = NetworkRecipe(steps=300, limits=(1, 1000), batch=32)


def touched(people: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Windows of a press left, one right, and none, by people of different strength."""
    label = np.tile([0, 1, 2], 20 * people)
    windows = 1.0 + rng.normal(0.0, 0.01, (len(label), 5, 4, 6)).astype(np.float32)
    strength = rng.uniform(0.5, 1.5, people).astype(np.float32).repeat(60)[:, None, None, None]
    windows[label == 1, 2:, 1:3, :2] += strength[label == 1]
    windows[label == 2, 2:, 1:3, 4:] += strength[label == 2]
    return windows, label


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_classifies_people_that_it_never_saw(name: str) -> None:
    rng = np.random.default_rng(0)
    peer = PEERS[name](RECIPE, 0)
    peer.fit(*touched(3, rng))
    windows, label = touched(2, rng)
    answers = peer.predict_proba(windows)
    assert answers.shape == (len(windows), 3)
    np.testing.assert_allclose(answers.sum(axis=1), 1.0, rtol=1e-5)
    assert (answers.argmax(axis=1) == label).mean() > 0.95


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_answers_the_same_with_the_same_seed(name: str) -> None:
    windows, label = touched(2, np.random.default_rng(0))
    one, other = PEERS[name](RECIPE, 7), PEERS[name](RECIPE, 7)
    for peer in (one, other):
        peer.fit(windows, label)
    np.testing.assert_array_equal(one.predict_proba(windows), other.predict_proba(windows))


def test_time_warping_takes_a_slow_course_for_the_same() -> None:
    quick = np.array([0, 1, 2, 0, 0, 0], dtype=np.float32)[None, :, None]
    slow = np.array([0, 0, 1, 1, 2, 0], dtype=np.float32)[None, :, None]
    ((same, different),) = peers.warped(quick, np.concatenate([slow, 2.0 * quick]))
    assert same == 0.0
    assert different == pytest.approx(3.0)  # 1 is taken for 0 or 2, and 2 for 4


def test_few_windows_are_compared_and_coarse_ones() -> None:
    peer = peers.NearestCourse(RECIPE, 0)
    windows = np.ones((2 * peers.REFERENCES + 1, 14, 13, 7), dtype=np.float32)
    peer.fit(windows, np.zeros(len(windows), dtype=np.int64))
    images, rows, columns = peers.COARSE
    assert len(peer.courses) <= peers.REFERENCES
    assert peer.courses.shape[1:] == (images, rows * columns)
