"""People's recordings of another sensor: arrays, recordings, folds, a table; on a look-alike."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support import ROOT
from tests.support.pytest_types import Capture

pytest.importorskip("torch", reason="needs the [train] extra")
pytest.importorskip("sklearn", reason="needs the [train] extra")

import tests.support.synthetic_people as look_alike
from controller.__main__ import main as controller
from controller.shared.config import parse_toml
from models.__main__ import main as models
from models.cli import sweep as cli
from models.data import load
from models.data.recipe import DEFAULT
from models.studies.sweep import plan, training
from models.studies.sweep.run import Sweep

pytestmark = pytest.mark.train

BESIDE = ROOT / "docs" / "people"


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with four people's recordings, imported as docs/people.md says."""
    folder = tmp_path_factory.mktemp("people")
    look_alike.write(folder / "frames.npz")
    told = str(BESIDE / "capfingerid.toml")
    asked = ["recordings", "import", str(folder / "frames.npz"), told]
    assert controller([*asked, "--out", str(folder / "recordings")]) == 0
    return folder


def swept(people: Path, name: str, steps: int) -> Any:
    text = (ROOT / "models/studies/sweep/folds.toml").read_text(encoding="utf-8")
    for old, new in (
        ("folds = 5", "folds = 2"),
        ('"people"', f'"people"\ngesture.steps = {steps}'),
    ):
        assert old in text
        text = text.replace(old, new)
    (people / f"{name}.toml").write_text(text)
    assert models(["sweep", str(people / f"{name}.toml"), "--workers", "1"]) == 0
    return json.loads((people / f"{name}.sweep" / "results.json").read_text())


def test_unseen_people_s_tasks_are_told_beside_a_baseline(people: Path, capsys: Capture) -> None:
    shutil.copy(BESIDE / "gestures.toml", people / "recordings")
    jobs = swept(people, "told", 60)["jobs"]
    (people / "recordings" / "gestures.toml").unlink()
    assert [job["at"]["model"] for job in jobs] == ["network"] * 2 + ["trees"] * 2
    of = [[one["user"].split()[-1] for one in job["result"]["held"]] for job in jobs]
    assert [sorted(set(users)) for users in of] == [["00", "01"], ["02", "03"]] * 2
    windows = [sum(one["frames"][1] for one in job["result"]["held"]) for job in jobs]
    assert windows[:2] == windows[2:]  # the same windows for both
    right = [sum(one["frames"][0] for one in job["result"]["held"]) for job in jobs]
    assert min(np.divide(right[:2], windows[:2])) > 0.6
    assert "| trees | 2 |" in capsys.readouterr().out


def test_folds_are_a_sweep_with_the_plan_that_ships(
    people: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Sweep] = []

    def finish(sweep: Sweep) -> int:
        made.append(sweep)
        return 0

    monkeypatch.setattr(cli, "finish", finish)
    folder = str(people / "recordings")
    assert models(["folds", folder, "--folds", "2", "--out", str(people / "folds")]) == 0
    (sweep,) = made
    jobs = [(job["at"]["model"], job["test"]["fold"]) for job in sweep.plan.jobs(sweep.digest)]
    assert jobs == [("network", 0), ("network", 1), ("trees", 0), ("trees", 1)]
    assert (sweep.plan.test.by, sweep.places) == ("user", (folder,))
    assert sweep.plan.train["recipe"] == "people"  # the screen counts, the orb measures picofarads
    orb = "--users 2 --sessions 1 --minutes 0.5 --workers 1 --rate 10"
    assert models(["simulate", "--out", str(people / "orb"), *orb.split()]) == 0
    assert models(["folds", str(people / "orb"), "--out", str(people / "of_orb")]) == 0
    assert made[-1].plan.train["recipe"] == "default"


def test_peers_are_judged_on_each_set_by_folds_that_its_people_allow(
    people: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """Four people make four folds where five are asked for; each folder has its own results."""
    made: list[Sweep] = []

    def finish(sweep: Sweep) -> int:
        made.append(sweep)
        return len(made) - 1

    monkeypatch.setattr(cli, "finish", finish)
    shutil.copytree(people / "recordings", tmp_path / "other")
    folders = [str(people / "recordings"), str(tmp_path / "other")]
    asked = ["folds", *folders, "--peers", "--out", str(tmp_path / "out")]
    assert models(asked) == 1  # the second set has a failed training
    for sweep, folder in zip(made, folders, strict=True):
        assert sweep.folder == tmp_path / "out" / Path(folder).name
        names = [job["at"]["model"] for job in sweep.plan.jobs(sweep.digest)]
        assert names == [name for name in plan.MODELS for _ in range(4)]
    for wrong, why in (
        ([*asked, "--task", "location"], "--peers are of gestures"),
        (["folds", folders[0], folders[0], "--peers", "--out", "x"], "two folders have one name"),
    ):
        assert models(wrong) == 2
        assert why in capsys.readouterr().err


def test_one_person_makes_no_folds(people: Path, tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "alone").mkdir()
    own = min((people / "recordings").glob("*.npz"))
    shutil.copy(own, tmp_path / "alone")
    assert models(["folds", str(tmp_path / "alone"), "--out", str(tmp_path / "out")]) == 2
    assert "holds recordings of one person" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_all_peers_are_judged_on_the_same_windows(people: Path) -> None:
    table = parse_toml((ROOT / "models/studies/sweep/folds.toml").read_text(encoding="utf-8"))
    table["data"]["folders"] = [str(people / "recordings")]
    table["train"]["gesture"] = {"steps": 10}
    table["train"]["declared"] = True
    table["axes"]["model"] = list(plan.MODELS)
    sweep = cli.of_recordings(Sweep(plan.parse(table, "folds"), people), [people / "recordings"])
    jobs = [job for job in sweep.plan.jobs(sweep.digest) if job["test"]["fold"] == 0]
    held = [training.train({**job, "test": {**job["test"], "folds": 2}})["held"] for job in jobs]
    amounts = [[(one["user"], one["frames"][1], one["events"][1]) for one in own] for own in held]
    assert len(amounts) == len(plan.MODELS)
    assert all(own == amounts[0] for own in amounts)


def test_without_a_declaration_each_fold_finds_its_own(people: Path, capsys: Capture) -> None:
    jobs = swept(people, "bare", 12)["jobs"]
    for job in jobs[:2]:
        words = job["result"]["notes"][-1]
        assert words.startswith("symmetries: ")
        assert "points" in words or "no symmetry helps" in words
    assert "symmetries: " in capsys.readouterr().out


def test_no_person_decides_alone_where_people_differ_as_real_ones_do(tmp_path: Path) -> None:
    """A training that ends when one person is no better understood names 4 to 7 % fewer windows."""
    look_alike.write(tmp_path / "frames.npz", people=10, repeats=1, varied=True)
    folder, told = tmp_path / "recordings", str(BESIDE / "capfingerid.toml")
    frames = str(tmp_path / "frames.npz")
    assert controller(["recordings", "import", frames, told, "--out", str(folder)]) == 0
    table = parse_toml((ROOT / "models/studies/sweep/folds.toml").read_text(encoding="utf-8"))
    table["data"]["folders"] = [str(folder)]
    table["train"]["gesture"] = {"steps": 200}
    table["train"]["declared"] = True
    table["axes"] = {"seed": [0, 1]}
    swept = cli.of_recordings(Sweep(plan.parse(table, "folds"), tmp_path), [folder])
    counts = np.zeros((2, 2))
    for job in swept.plan.jobs(swept.digest):
        if job["test"]["fold"] < 3:
            held = training.train(job)["held"]
            counts[job["at"]["seed"]] += np.sum([one["frames"] for one in held], axis=0)
    right = counts[:, 0] / counts[:, 1]
    assert right.min() > 0.965
    assert abs(right[0] - right[1]) < 0.02


def test_the_scale_of_a_fold_is_that_of_its_own_people(people: Path) -> None:
    data = load.read([people / "recordings"], DEFAULT, "auto", print)
    own = np.flatnonzero(data.user < np.median(data.user))
    stronger = replace(data.examples, images=1.0 + 3.0 * (data.examples.images - 1.0))
    one, other = (training.scaled(each, own) for each in (data.examples, stronger))
    np.testing.assert_allclose(one.images, other.images, atol=1e-4)
