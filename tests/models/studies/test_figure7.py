"""Figure 7 is measured on what nobody learned from."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from models.studies.figure7 import report
from tests.support.pytest_types import Patch


def part(gesture: bool) -> dict[str, Any]:
    whole = "events" if gesture else "presses"
    ends = {"random": [0.9], "day": [0.8], "people": [0.7], f"day {whole}": [0.6]}
    sizes = {**ends, f"people {whole}": [0.5], "examples": [100.0]}
    return {"recipe": "", "kept": 1, "epochs": {**ends, "epoch": [1.0]}, "sizes": sizes}


def test_the_papers_protocol_and_ours_stand_in_one_row() -> None:
    late = dict.fromkeys(("begin_s", "true_begin_s", "end_s", "true_end_s"), -0.05)
    found = {
        "parts": {"nominal paper CNN-3D": part(True), "nominal default CNN-2D": part(False)},
        "labels": {"nominal": {**late, "wrong": 0.1, "wrong_after": 0.01}},
    }
    text = report.text(found)
    row = "| nominal | CNN-3D | the paper’s | 90.0 % | 80.0 % | 70.0 % | 10.0 points | 60.0 % |"
    assert row in text
    assert "| nominal | CNN-2D | ours | 0.900 | 0.800 | 0.700 | −0.100 |" in text
    assert "| nominal | −0.05 s | −0.05 s | −0.05 s | −0.05 s | 10.0 % | 1.0 % |" in text


@pytest.mark.train
def test_presses_on_the_taxels_are_labelled_with_the_taxel_that_was_aimed_at() -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    from models.studies.figure7.experiments import presses

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
    from controller.simulator.orb import PRESETS
    from models.data.recipe import RECIPES
    from models.studies.figure7 import experiments, study

    monkeypatch.setattr(experiments, "JUDGED_MIN", 1.0)
    monkeypatch.setattr(study, "RECIPES", {"paper": RECIPES["paper"]})
    monkeypatch.setattr(study, "PRESETS", {"nominal": PRESETS["nominal"]})
    monkeypatch.setattr(study, "SHARES", (0.5,))
    monkeypatch.setattr(experiments, "USERS", 2)
    monkeypatch.setattr(experiments, "USER_MINUTES", 1.0)
    settings, path = experiments.Settings(2.0, 1, 2), tmp_path / report.MEASURED
    said: list[str] = []
    first = study.measure(settings, path, said.append)
    assert len(said) == 6  # three networks, on half of the lesson and on all of it
    again = study.measure(settings, path, said.append)
    assert (len(said), again) == (6, first)
    sizes = first["parts"]["nominal paper CNN-3D"]["sizes"]
    assert sizes["examples"][0] == pytest.approx(sizes["examples"][1] / 2, rel=0.1)
    for network in ("CNN-3D", "users", "CNN-2D"):
        first["parts"][f"nominal default {network}"] = first["parts"][f"nominal paper {network}"]
    (picture,) = report.draw(first, tmp_path)
    assert picture.stat().st_size > 20_000
