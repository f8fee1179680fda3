"""Weights that a training takes from another bundle: same shape, another grid, another rate."""

import numpy as np
import pytest

from tests.support import ROOT

pytest.importorskip("torch", reason="needs the [train] extra")

import torch
from torch import Tensor

from controller.bundles import bundle
from models.data.recipe import DEFAULT, PAPER
from models.training import transfer
from models.training.networks import Network, gesture_net

pytestmark = pytest.mark.train

SHIPPED = ROOT / "models" / "orbtouch.orb"
LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")


def shipped() -> bundle.Bundle:
    return bundle.read(SHIPPED)


def gestures(*shape: int, classes: int = 5) -> Network:
    """A new CNN-3D for windows (images, rows, columns)."""
    window, rows, columns = shape
    torch.manual_seed(1)
    return gesture_net((window, rows, columns), classes, DEFAULT.gesture)


def logits(net: Network, windows: Tensor) -> Tensor:
    with torch.no_grad():
        answers: Tensor = net.eval()(windows)
    return answers


def test_a_network_of_the_same_shape_starts_with_the_answers_of_the_bundle() -> None:
    found, net = shipped(), gestures(40, 5, 5)
    start = transfer.start(found, LABELS, net, None)
    windows = torch.from_numpy(found.golden.windows)
    transfer.begin(net, start.gesture, windows)
    answers = torch.softmax(logits(net, windows), 1).numpy()
    np.testing.assert_allclose(answers, found.golden.probabilities, atol=1e-4)
    assert start.lines == ("CNN-3D starts from the bundle's conv1, conv2, dense1, dense2, out",)


def test_normalising_layers_pass_on_what_they_get_while_it_trains_too() -> None:
    found, net = shipped(), gestures(40, 5, 5)
    start = transfer.start(found, LABELS, net, None)
    windows = torch.from_numpy(found.golden.windows)
    transfer.begin(net, start.gesture, windows)
    steady = logits(net, windows)
    training = net.train()(windows).detach()
    np.testing.assert_allclose(training.numpy(), steady.numpy(), atol=0.02)


def test_other_labels_leave_the_output_random() -> None:
    others = ("null", "press", "swipe")
    start = transfer.start(shipped(), others, gestures(40, 5, 5, classes=3), None)
    assert "out.weight" not in start.gesture
    assert "dense2.weight" in start.gesture


def test_layers_behind_one_that_does_not_fit_are_random() -> None:
    old = {
        "conv1.weight": torch.zeros(2, 1, 3, 3), "conv1.bias": torch.zeros(2),
        "conv2.weight": torch.zeros(4, 2, 3, 3), "conv2.bias": torch.zeros(4),
        "out.weight": torch.zeros(2, 4), "out.bias": torch.zeros(2),
    }  # fmt: skip
    new = {**old, "conv2.weight": torch.zeros(5, 2, 3, 3)}
    assert list(transfer.take(new, old)) == ["conv1.weight", "conv1.bias"]


def test_one_sentence_where_nothing_fits() -> None:
    net = gesture_net((40, 5, 5), 5, PAPER.gesture)  # kernels of 3 images, 16 maps
    with pytest.raises(ValueError, match=r"^nothing of the bundle named with --from fits: .* --fr"):
        transfer.start(shipped(), LABELS, net, None)
