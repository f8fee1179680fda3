"""Weights that a training takes from another bundle: same shape, another grid, another rate."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import ROOT

pytest.importorskip("torch", reason="needs the [train] extra")

import torch
from torch import Tensor

from controller.bundles import bundle
from models.data.recipe import DEFAULT, PAPER
from models.training import transfer
from models.training.networks import Network, gesture_net, location_net

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
    start = transfer.start(found, LABELS, net, None, (40, 5, 5), (5, 5))
    windows = torch.from_numpy(found.golden.windows)
    transfer.begin(net, start.gesture, windows)
    answers = torch.softmax(logits(net, windows), 1).numpy()
    np.testing.assert_allclose(answers, found.golden.probabilities, atol=1e-4)
    assert start.lines == ("CNN-3D starts from the bundle's conv1, conv2, dense1, dense2, out",)


def test_normalising_layers_pass_on_what_they_get_while_it_trains_too() -> None:
    found, net = shipped(), gestures(40, 5, 5)
    start = transfer.start(found, LABELS, net, None, (40, 5, 5), (5, 5))
    windows = torch.from_numpy(found.golden.windows)
    transfer.begin(net, start.gesture, windows)
    steady = logits(net, windows)
    training = net.train()(windows).detach()
    np.testing.assert_allclose(training.numpy(), steady.numpy(), atol=0.02)


def test_other_labels_leave_the_output_random() -> None:
    others = ("null", "press", "swipe")
    start = transfer.start(
        shipped(), others, gestures(40, 5, 5, classes=3), None, (40, 5, 5), (5, 5)
    )
    assert "out.weight" not in start.gesture
    assert "dense2.weight" in start.gesture


def test_kernels_are_taken_for_another_grid_and_the_dense_layer_is_resampled() -> None:
    old = {
        "conv1.weight": torch.arange(9.0).reshape(1, 1, 3, 3),
        "conv1.bias": torch.ones(1),
        "dense1.weight": torch.ones(1, 6),  # maps of 2 × 3 taxels
        "dense1.bias": torch.zeros(1),
    }
    new = {**old, "dense1.weight": torch.zeros(1, 20)}  # maps of 4 × 5 taxels
    taken, words = transfer.take(new, (4, 5), old, (2, 3))
    assert torch.equal(taken["conv1.weight"], old["conv1.weight"])
    assert words == "conv1, dense1 (resampled)"
    # The same signal everywhere has the same sum: 6 weights of 1, 20 weights of 0.3.
    np.testing.assert_allclose(taken["dense1.weight"].numpy(), 0.3, rtol=1e-6)


def test_the_dense_layer_is_resampled_even_if_two_grids_have_as_many_taxels() -> None:
    rising = {"dense1.weight": torch.tensor([[0.0, 0, 0, 1, 1, 1]]), "dense1.bias": torch.zeros(1)}
    taken, _ = transfer.take(rising, (3, 2), rising, (2, 3))
    top, _, bottom = taken["dense1.weight"].reshape(3, 2)
    assert top.tolist() == [0, 0]
    assert bottom.tolist() == [1, 1]


def test_kernels_through_time_are_resampled_for_another_rate() -> None:
    kernel = torch.zeros(1, 1, 8, 3, 3)
    kernel[:, :, 4:] = 1.0  # what is new counts, what is old does not
    old = {"conv1.weight": kernel, "conv1.bias": torch.zeros(1)}
    new = {"conv1.weight": torch.zeros(1, 1, 4, 3, 3), "conv1.bias": torch.zeros(1)}
    taken, words = transfer.take(new, (), old, ())
    assert words == "conv1 (resampled)"
    assert taken["conv1.weight"][0, 0, :, 1, 1].tolist() == [0.0, 0.0, 2.0, 2.0]


def test_a_location_network_of_another_grid_points_into_it() -> None:
    recipe = replace(DEFAULT.location)
    net = location_net((4, 6), recipe)
    start = transfer.start(shipped(), LABELS, None, net, (40, 4, 6), (4, 6))
    transfer.begin(net, start.location, torch.ones(1, 4, 6))
    left, right = torch.ones(1, 4, 6), torch.ones(1, 4, 6)
    left[0, 1:3, :2] = right[0, 1:3, -2:] = 1.1
    assert logits(net, left)[0, 0] < 2.0 < 3.0 < logits(net, right)[0, 0]


def test_layers_behind_one_that_does_not_fit_are_random() -> None:
    old = {
        "conv1.weight": torch.zeros(2, 1, 3, 3), "conv1.bias": torch.zeros(2),
        "conv2.weight": torch.zeros(4, 2, 3, 3), "conv2.bias": torch.zeros(4),
        "out.weight": torch.zeros(2, 4), "out.bias": torch.zeros(2),
    }  # fmt: skip
    new = {**old, "conv2.weight": torch.zeros(5, 2, 3, 3)}
    assert list(transfer.take(new, (1, 1), old, (1, 1))[0]) == ["conv1.weight", "conv1.bias"]


def test_one_sentence_where_nothing_fits() -> None:
    net = gesture_net((40, 5, 5), 5, PAPER.gesture)  # kernels of 3 images, 16 maps
    with pytest.raises(ValueError, match=r"^nothing of the bundle named with --from fits: .* --fr"):
        transfer.start(shipped(), LABELS, net, None, (40, 5, 5), (5, 5))
