"""The whole way of people's recordings: arrays, recordings, folds, a report; on a look-alike."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support import ROOT
from tests.support.pytest_types import Capture, Patch

pytest.importorskip("torch", reason="needs the [train] extra")
pytest.importorskip("sklearn", reason="needs the [train] extra")

import tests.support.synthetic_people as look_alike
from controller.__main__ import main as controller
from models.__main__ import main as models
from models.data import load
from models.data.recipe import DEFAULT
from models.studies import cross_validation
from models.studies.cross_validation import Request

pytestmark = pytest.mark.train

BESIDE = ROOT / "docs" / "people"


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four people's recordings, imported as docs/people.md says."""
    folder = tmp_path_factory.mktemp("people")
    look_alike.write(folder / "frames.npz")
    out = folder / "recordings"
    told = str(BESIDE / "capfingerid.toml")
    asked = ["recordings", "import", str(folder / "frames.npz"), told, "--out", str(out)]
    assert controller(asked) == 0
    shutil.copy(BESIDE / "gestures.toml", out)
    return out


def asked(recordings: Path, out: Path, **other: Any) -> Request:
    plain = {"folds": 2, "steps": 12, "window": 10}
    return Request((recordings,), out, **(plain | other))


def test_unseen_people_s_tasks_are_told(recordings: Path, tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "people.json"
    line = f"folds {recordings} --folds 2 --steps 60 --window 10 --out {out}"
    assert models(line.split()) == 0
    found = json.loads(out.read_text())
    ours, trees = found["models"]
    assert trees["name"] == "trajectory trees"
    assert found["people"] == ["00", "01", "02", "03"]
    assert found["held"] == ["00, 01", "02, 03"]
    # The same windows for both: each is in one cell of each table.
    windows = [sum(map(sum, one["confusion"])) for one in found["models"]]
    assert windows == [found["windows"]] * 2
    assert ours["windows"]["value"] > 0.6 > found["majority"] + 0.2
    assert found["chosen"] == []
    told = capsys.readouterr().out
    assert "ours more than trajectory trees" in told
    assert not (tmp_path / "people.json.folds").exists()


def test_an_interrupted_run_goes_on(recordings: Path, tmp_path: Path, monkeypatch: Patch) -> None:
    whole = cross_validation.cross(asked(recordings, tmp_path / "whole.json"), print)
    trained = cross_validation._Study._train
    calls: list[int] = []

    def stop(study: Any, number: int, *rest: Any) -> Any:
        calls.append(number)
        if len(calls) == 2:  # in the second fold
            raise KeyboardInterrupt
        return trained(study, number, *rest)

    monkeypatch.setattr(cross_validation._Study, "_train", stop)
    out = tmp_path / "again.json"
    with pytest.raises(KeyboardInterrupt):
        cross_validation.cross(asked(recordings, out), print)
    again = cross_validation.cross(asked(recordings, out), print)
    assert calls == [0, 1, 1]  # fold 0 is not done again
    for one, other in zip(whole.models, again.models, strict=True):
        assert one.confusion == other.confusion
    calls.clear()
    with pytest.raises(KeyboardInterrupt):
        cross_validation.cross(asked(recordings, out), print)
    with pytest.raises(ValueError, match="other data or options"):
        cross_validation.cross(asked(recordings, out, seed=1), print)


def test_without_a_declaration_each_fold_finds_its_own(
    recordings: Path, tmp_path: Path, capsys: Capture
) -> None:
    bare = tmp_path / "bare"
    shutil.copytree(recordings, bare, ignore=shutil.ignore_patterns("gestures.toml"))
    line = f"folds {bare} --folds 2 --steps 12 --out {tmp_path / 'out.json'}"
    assert models(line.split()) == 0
    found = json.loads((tmp_path / "out.json").read_text())
    assert len(found["chosen"]) == 2
    assert all("points" in words or "no symmetry helps" in words for words in found["chosen"])
    assert "left" in capsys.readouterr().err
    # The look-alike's labels are whole stretches, without null beside them: they are not moved.
    assert all(sum(row) == 0 for model in found["models"] for row in model["confusion"][:1])
    assert models([*line.split(), "--declared"]) == 0
    assert json.loads((tmp_path / "out.json").read_text())["chosen"] == []


def test_the_scale_of_a_fold_is_that_of_its_own_people(recordings: Path) -> None:
    data = load.read([recordings], DEFAULT, "auto", print)
    ends = data.examples.ends[data.user[data.examples.session[data.examples.ends]] < 8]
    stronger = replace(data.examples, images=1.0 + 3.0 * (data.examples.images - 1.0))
    one, other = (cross_validation.scaled(each, ends) for each in (data.examples, stronger))
    np.testing.assert_allclose(one.images, other.images, atol=1e-4)


@pytest.mark.parametrize("folds", [1, 5])
def test_there_are_no_more_folds_than_people(recordings: Path, tmp_path: Path, folds: int) -> None:
    with pytest.raises(ValueError, match="at most one for each"):
        cross_validation.cross(asked(recordings, tmp_path / "out.json", folds=folds), print)
