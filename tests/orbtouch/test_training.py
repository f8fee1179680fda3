"""Training through the interface."""

import logging
from pathlib import Path

import pytest

import orbtouch
from tests.support.pytest_types import Capture

pytest.importorskip("torch", reason="needs the [train] extra")

from models.training import checkpoint

pytestmark = pytest.mark.train


def test_an_interrupted_training_of_other_data_does_not_block_the_next(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, capsys: Capture
) -> None:
    (tmp_path / "data").mkdir()
    for user in range(4):
        session = orbtouch.simulate(minutes=0.5, user=user, rate_hz=10.0)
        session.save(tmp_path / "data" / f"{user}.npz")
    caplog.set_level(logging.INFO, "orbtouch")
    checkpoint.claim(tmp_path / "own.orb.training", "another training")
    made = orbtouch.train(tmp_path / "data", tmp_path / "own.orb", epochs=1, split="user")
    assert "it begins anew" in caplog.text
    assert "CNN-3D epoch 1/1" in caplog.text
    assert capsys.readouterr() == ("", "")
    assert made.network.classes == session.classes
    assert [one.number for one in made.curve["gesture"]] == [1]
    assert set(made.scores) == {"gesture", "location"}
    assert not (tmp_path / "own.orb.training").exists()
