"""The paper repeated: measured on what nobody learned from, kept, shown in tables and drawings."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from models.studies.paper import tables
from tests.benchmarks import stored
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture, Patch


def found(name: str) -> Any:
    """Results that docs/paper.md shows."""
    study = stored.load(name)
    assert study is not None
    return study.results


def test_the_noisy_preset_reproduces_the_papers_statistics() -> None:
    mean = found("information")["parts"]["paper-snr|section6"]
    assert mean["h_z"] == pytest.approx(2.71, rel=0.1)
    assert mean["information"] == pytest.approx(0.13, rel=0.1)


def test_no_estimate_of_the_label_exceeds_what_there_is() -> None:
    for of in tables.part(found("information"), "bound").values():
        assert of["window"][0] < of["h_y"]
        assert of["gesture"][0] < of["h_gesture"] + 1e-6


def part(gesture: bool) -> dict[str, Any]:
    whole = "events" if gesture else "presses"
    ends = {"random": [0.9], "day": [0.8], "people": [0.7], f"day {whole}": [0.6]}
    sizes = {**ends, f"people {whole}": [0.5], "examples": [100.0]}
    return {"kept": 1, "epochs": {**ends, "epoch": [1.0]}, "sizes": sizes}


def test_the_papers_protocol_and_ours_stand_in_one_row() -> None:
    parts = {
        "nominal|figure7 paper CNN-3D": part(True),
        "nominal|figure7 default CNN-2D": part(False),
    }
    text = tables.text({"parts": parts})
    row = "| nominal | CNN-3D | the paper’s | 90.0 % | 80.0 % | 70.0 % | 10.0 points | 60.0 % |"
    assert row in text
    assert "| nominal | CNN-2D | ours | 0.900 | 0.800 | 0.700 | −0.100 |" in text


@pytest.mark.train
def test_presses_on_the_taxels_are_labelled_with_the_taxel_that_was_aimed_at() -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    from models.studies.paper.figure7 import presses

    aimed = presses("nominal", 7, 0, 0, 1.0, on_sites=True)
    free = presses("nominal", 7, 0, 0, 1.0, on_sites=False)
    known, other = (s.touch[np.isfinite(s.touch[:, 0])] for s in (aimed, free))
    assert len(known) > 50
    assert (known == np.rint(known)).all()
    assert (np.abs(other - np.rint(other)) > 0.25).mean() > 0.3
    assert (np.isfinite(aimed.touch[:, 0]) == (aimed.label == 1)).all()


@pytest.mark.train
def test_what_was_measured_is_kept_and_drawn_again(tmp_path: Path, monkeypatch: Patch) -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    pytest.importorskip("matplotlib", reason="needs the [train] extra")
    from controller.bundles import bundle
    from models.data.recipe import RECIPES
    from models.studies.paper import drawings, figure7, study

    monkeypatch.setattr(figure7, "JUDGED_MIN", 1.0)
    monkeypatch.setattr(figure7, "SHARES", (0.5,))
    monkeypatch.setattr(figure7, "USERS", 2)
    monkeypatch.setattr(figure7, "USER_MINUTES", 1.0)
    monkeypatch.setattr(study, "RECIPES", {"paper": RECIPES["paper"]})
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    settings, kept = figure7.Settings(2.0, 1, 2), tmp_path / study.MEASURED
    said: list[str] = []

    def measured() -> Any:
        ships = bundle.default_path()
        return study.measure({"nominal": ()}, ["figure7"], ships, settings, kept, said.append)

    first = measured()
    assert len(said) == 3  # a network each
    assert (measured()["parts"], len(said)) == (first["parts"], 3)
    sizes = first["parts"]["nominal|figure7 paper CNN-3D"]["sizes"]
    assert sizes["examples"][0] == pytest.approx(sizes["examples"][1] / 2, rel=0.1)
    for network in figure7.NETWORKS:
        own = first["parts"][f"nominal|figure7 paper {network}"]
        first["parts"][f"nominal|figure7 default {network}"] = own
    (picture,) = drawings.draw(first, tmp_path)
    assert picture.stat().st_size > 20_000


@pytest.mark.train
def test_figures_7_and_9_are_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the [train] extra")
    from models.studies.paper import drawings

    drawn = [*drawings.draw(found("figure7"), tmp_path)]
    drawn += drawings.draw(found("information"), tmp_path)
    names = ["figure7-nominal.svg", "figure7-paper-snr.svg", "figure9.svg"]
    assert [path.name for path in drawn] == names


@pytest.mark.train
def test_wrong_usage_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    options = ("models/orbtouch.orb", "nothing-here")
    assert "nothing-here" in refused(capsys, "paper", "--out", tmp_path, *options)


@pytest.mark.train
def test_a_folder_of_something_else_is_refused(tmp_path: Path, capsys: Capture) -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    (tmp_path / "paper.json").write_text("{}")
    assert "holds no results" in refused(capsys, "paper", "--out", tmp_path)
