"""Tables and drawings of a study."""

import json
from pathlib import Path
from typing import Any

import pytest

from models.__main__ import main
from models.studies.information import tables
from models.studies.information.tables import MEASURED as KEPT
from models.studies.information.tables import load
from tests.benchmarks import stored
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture, Patch


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    """What was measured for docs/paper.md."""
    study, games = stored.load("information"), stored.load("games")
    assert study is not None
    assert games is not None
    every: dict[str, Any] = tables.with_nan({**study.results, "games": games.results["games"]})
    return every


def test_the_noisy_preset_reproduces_the_papers_statistics(found: dict[str, Any]) -> None:
    mean = found["parts"]["paper-snr|histogram"]
    assert mean["h_z"] == pytest.approx(2.71, rel=0.1)
    assert mean["information"] == pytest.approx(0.13, rel=0.1)


def test_no_estimate_of_the_label_exceeds_what_there_is(found: dict[str, Any]) -> None:
    for key, part in found["parts"].items():
        if key.endswith("|classifier"):
            for row in part["rows"].values():
                assert row["window"][0] < part["h_y"]
                assert row["gesture"][0] < part["h_gesture"] + 1e-6


@pytest.mark.train
def test_images_of_presses_tell_their_places_where_enough_are_known(monkeypatch: Patch) -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    from models.studies.information import study

    sessions = study.RecordingSet("nominal", preset="nominal", quick=True)
    told = study.places(sessions)
    assert told is not None
    value, low, high = told["information"]
    assert 2.0 < low < value < high < 3.5  # nats: as much as 7 to 33 places without confusion
    monkeypatch.setattr(study, "LEAST", told["presses"] + 1)
    assert study.places(sessions) is None


@pytest.mark.train
@pytest.mark.parametrize("rate_hz", [10.0, 40.0])
def test_sessions_are_judged_by_the_bundle_that_ships_for_their_rate(rate_hz: float) -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    from models.data.simulate import DataSet
    from models.studies.information import study
    from models.studies.information.windows import cut

    windows = cut([DataSet(seed=study.SEED, minutes=0.5, rate_hz=rate_hz).session(0, 0)])
    answers = study.shipped(windows)
    assert answers is not None
    assert answers.log_p.shape == (len(windows.y), 5)


@pytest.mark.train
def test_the_report_is_drawings_and_tables(found: dict[str, Any], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the [train] extra")
    from models.studies.information import report

    *drawings, written = report.write(tmp_path, found)
    assert {path.name for path in drawings} == {
        "figure9.svg", "capacity.svg", "information-window.svg"
    }  # fmt: skip
    assert "| played games |" in written.read_text(encoding="utf-8")


@pytest.mark.train
def test_games_alone_make_a_report(tmp_path: Path, capsys: Capture) -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    game = {"seconds": 60.0, "events": [[1000, 1500, "left"], [3000, 3600, "drop"]],
            "commands": [[1200, "left"], [3300, "drop"]]}  # fmt: skip
    (tmp_path / "game.json").write_text(json.dumps(game))
    out = tmp_path / "out"
    out.mkdir()
    asked = ["information", "--only", "none", "--games", str(tmp_path / "game.json")]
    assert main([*asked, "--out", str(out)]) == 0
    assert "| played games | games |" in capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {
        "capacity.svg", "information.json", "information.md",
    }  # fmt: skip
    assert main([*asked, "--out", str(out)]) == 0  # again: what is there is gone on with


@pytest.mark.train
@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--only", "everything"], "there is no part 'everything'"),
        (["nothing-here"], "nothing-here"),
        (["--out", "nowhere"], "nowhere is no directory; make it first"),
        (["--only", "none", "--games", "none.json"], "cannot read none.json"),
    ],
)
def test_wrong_usage_is_one_sentence(
    options: list[str], sentence: str, tmp_path: Path, monkeypatch: Patch, capsys: Capture
) -> None:
    pytest.importorskip("torch", reason="needs the [train] extra")
    monkeypatch.chdir(tmp_path)
    assert sentence in refused(capsys, "information", *options)


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / KEPT).write_text("{}")
    with pytest.raises(ValueError, match="no results"):
        load(tmp_path / KEPT)
