"""Places of touches, judged for people that no model saw."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.pytest_types import Capture

pytest.importorskip("torch", reason="needs the [train] extra")
pytest.importorskip("sklearn", reason="needs the [train] extra")

from models.__main__ import main as models
from models.studies import location_folds

pytestmark = pytest.mark.train


def test_places_of_unseen_people_are_judged_in_millimetres(tmp_path: Path, capsys: Capture) -> None:
    data, out = tmp_path / "data", tmp_path / "places.json"
    small = "--users 2 --sessions 1 --minutes 2 --workers 1 --gestures press --pitch 12"
    assert models(["simulate", "--out", str(data), *small.split()]) == 0
    line = f"folds {data} --task location --folds 2 --steps 25 --out {out}"
    assert models(line.split()) == 0
    found = json.loads(out.read_text())
    mean = {one["name"]: one["mean"]["value"] for one in found["models"]}
    assert list(mean) == ["CNN-2D", "ridge", "dense network", "centroid"]
    # Always naming the middle of a grid of 48 mm is about 15 mm off.
    assert mean["CNN-2D"] < 8.0
    assert mean["centroid"] < 5.0
    assert [len(one["by_person"]) for one in found["models"]] == [2] * 4
    assert "taxels are 12 mm apart" in capsys.readouterr().out


def test_recordings_of_one_person_are_refused(tmp_path: Path, capsys: Capture) -> None:
    data = tmp_path / "data"
    small = "--users 1 --sessions 1 --minutes 1 --workers 1"
    assert models(["simulate", "--out", str(data), *small.split()]) == 0
    out = tmp_path / "out.json"
    assert models(["folds", str(data), "--task", "location", "--out", str(out)]) == 2
    assert "1 person has touches whose place is known, too few" in capsys.readouterr().err


def test_a_linear_sensor_is_located_exactly_by_the_linear_models() -> None:
    """A spot of one shape: its centroid is its place, and so is a sum over the taxels."""
    rng = np.random.default_rng(0)
    place = rng.uniform(2.0, 5.0, (300, 2))
    row, column = np.mgrid[:8, :8]
    square = (column - place[:, :1, None]) ** 2 + (row - place[:, 1:, None]) ** 2
    images = (1.0 - 0.1 * np.exp(-square / 2.0)).astype(np.float32)  # falls under touch
    for peer in ("ridge", "centroid"):
        seen, learn = location_folds.PEERS[peer]
        found = learn(seen(images[:200]), place[:200], seen(images[200:]))
        assert np.abs(found - place[200:]).max() < 0.15
