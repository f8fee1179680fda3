"""Training what touches in each frame, on simulated contacts that move."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the [train] extra")

from controller.bundles import bundle
from controller.recognition.contact import OUTPUTS
from controller.simulator.orb import NOMINAL
from controller.simulator.session import LABELS
from models.data import moving_contacts
from models.training.request import Request
from models.training.state_task import train_state

pytestmark = pytest.mark.train

USUAL = bundle.default_path()


def test_a_bundle_learns_it_and_keeps_its_other_networks(tmp_path: Path) -> None:
    said: list[str] = []
    request = Request((), tmp_path / "aim.orb", "state", epochs=2, command="models train")
    result = train_state(request, USUAL, said.append, orbs=1, parts=4)
    assert "state: epoch 2 of 2" in said[-1]
    made, before = bundle.read(request.out), bundle.read(USUAL)
    assert made.contacts is not None
    assert made.embedding_onnx == before.embedding_onnx
    assert made.card["state"].endswith(result)
    assert result.startswith("8640 simulated frames; median errors of others: place ")
    assert len(made.contacts.out) == OUTPUTS + len(made.labels)  # it says the gestures, too


def test_the_truth_beside_each_frame_is_of_what_touches_in_it() -> None:
    settings = bundle.read(USUAL).preprocess
    made = moving_contacts.simulate(NOMINAL, settings, seed=5, orbs=2, gestures=True)
    assert made.inputs.shape[:2] == made.truth.shape[:2] == made.fingers.shape == (2, 2880)
    there = made.fingers > 0
    assert 0.3 < there.mean() < 1.0
    assert (made.truth[there][:, 2] > 0.3).all()
    assert (made.truth[made.fingers == 1][:, 3] == 0.0).all()
    strength = made.inputs[..., 75].astype(float)  # its logarithm
    assert np.corrcoef(strength[there], made.truth[there][:, 2])[0, 1] > 0.5
    assert (made.label[0] == moving_contacts.UNKNOWN_LABEL).all()  # these contacts mean nothing
    assert set(np.unique(made.label[1])) == set(range(len(LABELS)))
    assert there[made.label > 0].mean() > 0.7  # a label lasts longer than its touch
