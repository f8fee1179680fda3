"""Examples of own predictors: judged beside the network that ships, played, made of own tables."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import orbtouch
from tests.support import short_example
from tests.support.examples import example


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a minute at 10 Hz for each minute at 40 Hz."""
    for own in (short_example.simulate, short_example.load_network):
        monkeypatch.setattr(orbtouch, own.__name__, own, raising=False)


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(("name", "needs"), [("gru", "torch"), ("template", "numpy")])
def test_an_own_predictor_is_judged_beside_the_network_that_ships(name: str, needs: str) -> None:
    pytest.importorskip(needs)
    assert_judged(example(name))


def assert_judged(made: ModuleType) -> None:
    assert made.mine.sessions == made.shipped.sessions == 3
    assert made.mine.events == made.shipped.events > 10
    assert float(made.shipped.recall) > float(made.mine.recall) > 0.1


@pytest.mark.slow
@pytest.mark.usefixtures("short")
def test_a_forest_is_judged_and_recognises_live(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It sees a replay of a person it has learned, with which the orb ends, in place of a game."""
    pytest.importorskip("sklearn")
    answers = []
    orbtouch.simulate(minutes=1, user=0)[0.0:5.0].save(tmp_path / "known.npz")

    def watched(predict: Callable[[np.ndarray], np.ndarray], words: Any, **given: Any) -> None:
        def heard(windows: np.ndarray) -> np.ndarray:
            found = predict(windows)
            answers.append(int(found.argmax()))
            return found

        with orbtouch.live(heard, replay=tmp_path / "known.npz", **given) as orb:
            list(orb)

    monkeypatch.setattr(orbtouch, "play", watched, raising=False)
    monkeypatch.setattr(sys, "argv", ["forest.py"])
    assert_judged(example("forest"))
    assert 0 in answers
    assert len({*answers}) > 1


@pytest.mark.train
@pytest.mark.usefixtures("short")
def test_own_tables_become_a_network_that_is_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    made = example("own_csv").made
    assert (tmp_path / "own.orb").is_file()
    assert made.network.classes[0] == "null"
    assert len(made.curve["gesture"]) == 4
    assert 0.2 < float(made.scores["gesture"]) <= 1.0
