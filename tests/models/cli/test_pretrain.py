"""`models pretrain`: a bundle that trainings of other sensors start from."""

from pathlib import Path

import pytest

from controller.bundles import bundle
from models.__main__ import main
from tests.support.pytest_types import Capture

pytest.importorskip("torch", reason="needs the [train] extra")

pytestmark = pytest.mark.train

QUICK = ["--skins", "4", "--epochs", "1", "--seed", "5"]


def test_a_pretrained_network_is_a_start_for_another_grid(tmp_path: Path, capsys: Capture) -> None:
    start, data = tmp_path / "start.orb", tmp_path / "data"
    assert main(["pretrain", "--out", str(start), *QUICK]) == 0
    shown = capsys.readouterr().err
    assert "of CPU time" in shown.splitlines()[0]
    assert "4/4 sub-" in shown  # each skin
    first = next(line for line in shown.splitlines() if line.startswith("CNN-2D epoch 1/4"))
    assert first.endswith(" s left")
    made = bundle.read(start)
    assert (made.rows, made.columns, made.locates) == (6, 6, True)
    assert made.card["command"] == "models pretrain --skins 4 --seed 5 --epochs 1 --out start.orb"
    card = (tmp_path / "start.md").read_text()
    assert "Seed 5, 4 skins. CPU time" in card
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"start.orb", "start.md", "start.html", "start.json"}
    sensor = ["--minutes", "1", "--workers", "1", "--rows", "4", "--columns", "8", "--rate", "10"]
    assert main(["simulate", "--out", str(data), "--users", "2", "--sessions", "1", *sensor]) == 0
    own = [str(data), "--from", str(start), "--epochs", "1", "--no-advice"]
    assert main(["train", *own, "--out", str(tmp_path / "own.orb")]) == 0
    taken = (
        "CNN-3D starts from the bundle's conv1, conv2 (resampled), dense1 (resampled), dense2, out"
    )
    assert taken in (tmp_path / "own.md").read_text()


def test_a_seed_for_tests_is_refused(tmp_path: Path, capsys: Capture) -> None:
    assert main(["pretrain", "--out", str(tmp_path / "s.orb"), "--seed", "900000"]) == 2
    assert "for tests only" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
