"""Peers: networks are trained once and kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the [train] extra")
pytest.importorskip("sklearn", reason="needs the [train] extra")

from controller.recordings import writer
from models.data.recipe import DEFAULT, PAPER
from models.evaluation.replay import network_inputs
from tests.benchmarks import peers
from tests.support.recordings import LABELS, played

pytestmark = pytest.mark.train


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
    is_kept = name not in ("logistic", "forest")
    assert len(said) == is_kept
    windows = network_inputs(played("nominal", seed=9, minutes=0.5).frames, peer.settings).windows
    answers = peer.gesture(windows)
    assert answers.shape == (len(windows), len(LABELS))
    np.testing.assert_allclose(answers.sum(axis=1), 1.0, atol=1e-5)
    kept = peers.train(name, [folder], tmp_path, said.append)
    assert len(said) == is_kept
    assert (kept.gesture(windows) == answers).all()
    if peer.place is not None:
        places = peer.place(windows[:20, -1])
        assert places.shape == (20, 2)
        assert kept.place is not None
        assert (kept.place(windows[:20, -1]) == places).all()
    assert not list(tmp_path.glob("*.training"))


def test_other_recordings_are_another_peer(folder: Path, tmp_path: Path) -> None:
    said: list[str] = []
    peers.train("mlp", [folder], tmp_path, said.append)
    more = tmp_path / "more"
    more.mkdir()
    for path in sorted(folder.iterdir())[:2]:
        (more / path.name).write_bytes(path.read_bytes())
    peers.train("mlp", [more], tmp_path, said.append)
    assert len(said) == 2


def test_the_papers_peer_sees_a_fixed_rest_and_makes_a_share_of_the_papers_steps() -> None:
    recipe = peers._recipe("paper")
    settings = recipe.settings(10.0, 10)
    assert settings.start_s == 2.0
    assert settings.settle_s > 1e6
    assert (PAPER.gesture.epochs, PAPER.location.epochs) == (500, 2000)
    assert recipe.gesture.steps == 1 * 1500 // 150 // peers.PAPER_SHARE
