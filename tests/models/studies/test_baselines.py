"""Peers: trained once, kept as plain arrays, and asked without the program that trained them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the [train] extra")
pytest.importorskip("sklearn", reason="needs the [train] extra")

from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor

from controller.recordings import writer
from models.data.recipe import DEFAULT, PAPER
from models.evaluation.replay import network_inputs
from tests.benchmarks.baselines import peers
from tests.benchmarks.baselines.forest import Forest
from tests.support.recordings import LABELS, played

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


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = tmp_path_factory.mktemp("peers")
    for seed in range(4):
        own = played("nominal", seed=seed, minutes=1.0)
        free = replace(own, origin=replace(own.origin, seed=seed))
        writer.write_beside(where / f"{seed}.npz", writer.pack(free))
    return where


@pytest.fixture(autouse=True)
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """One epoch of everything."""
    peers._data.cache_clear()
    for name, recipe in (("DEFAULT", DEFAULT), ("PAPER", PAPER)):
        gesture, location = replace(recipe.gesture, epochs=1), replace(recipe.location, epochs=1)
        monkeypatch.setattr(peers, name, replace(recipe, gesture=gesture, location=location))
    monkeypatch.setattr(peers, "PAPER_WINDOWS", 1500)
    monkeypatch.setattr(peers, "PAPER_IMAGES", 300)
    monkeypatch.setattr(peers, "TREES", 5)


@pytest.mark.parametrize("name", peers.NAMES)
def test_a_peer_is_trained_once_and_answers_the_same_when_it_is_taken_out_again(
    name: str, folder: Path, tmp_path: Path
) -> None:
    said: list[str] = []
    peer = peers.train(name, [folder], tmp_path, said.append)
    assert len(said) == 1
    windows = network_inputs(played("nominal", seed=9, minutes=0.5).frames, peer.settings).windows
    answers = peer.gesture(windows)
    assert answers.shape == (len(windows), len(LABELS))
    np.testing.assert_allclose(answers.sum(axis=1), 1.0, atol=1e-5)
    kept = peers.train(name, [folder], tmp_path, said.append)
    assert len(said) == 1
    assert (kept.gesture(windows) == answers).all()
    if peer.place is not None:
        places = peer.place(windows[:20, -1])
        assert places.shape == (20, 2)
        assert kept.place is not None
        assert (kept.place(windows[:20, -1]) == places).all()
    assert (peer.honesty is not None) == (name in ("same_data", "paper"))
    assert not list(tmp_path.glob("*.training"))
