"""Layers of the networks: matrix products while they learn, strides in time, folding."""

from typing import Any

import pytest

pytest.importorskip("torch", reason="needs the [train] extra")

import torch

from models.data.recipe import NetworkRecipe
from models.training.networks import GridConvolution, gesture_net, location_net

pytestmark = pytest.mark.train


@pytest.mark.parametrize(("rows", "columns", "step"), [(5, 5, 2), (3, 3, 1), (4, 6, 2), (1, 2, 1)])
def test_a_product_answers_as_the_convolution_does(rows: int, columns: int, step: int) -> None:
    torch.manual_seed(1)
    layer = GridConvolution(2, 3, 4, [rows, columns], step, pace=2)
    images = torch.randn(6, 2, 10, rows, columns)  # (batch, maps, images, rows, columns)
    expected = layer.eval()(images)
    torch.testing.assert_close(layer.train()(images), expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(("window", "rows", "columns"), [(10, 5, 5), (12, 4, 6), (9, 12, 12)])
def test_a_network_learns_as_with_convolutions(window: int, rows: int, columns: int) -> None:
    torch.manual_seed(2)
    net = gesture_net((window, rows, columns), 5, NetworkRecipe()).eval()  # norms differ by design
    windows = 1.0 + 0.1 * torch.randn(8, window, rows, columns)
    slopes = []
    for learning in (False, True):
        net.train(learning)
        net.zero_grad()
        net(windows).square().sum().backward()
        slopes.append([parameter.grad for parameter in net.parameters()])
    torch.testing.assert_close(slopes[1], slopes[0], rtol=1e-3, atol=1e-4)


def test_what_it_is_spread_over_is_not_kept_with_the_weights() -> None:
    net = gesture_net((10, 5, 5), 5, NetworkRecipe())
    assert not [name for name in net.state_dict() if "reach" in name]


@pytest.mark.parametrize("window", range(2, 14))
def test_the_last_step_in_time_ends_at_the_newest_image(window: int) -> None:
    net: Any = gesture_net((window, 5, 5), 5, NetworkRecipe())
    steps = (window - net.conv1.kernel_size[0]) / 2
    assert steps.is_integer()
    assert ((steps + 1 - net.conv2.kernel_size[0]) / 2).is_integer()
    assert net(torch.ones(1, window, 5, 5)).shape == (1, 5)


def test_normalisation_is_worked_into_the_weights() -> None:
    torch.manual_seed(0)
    net = gesture_net((10, 5, 5), 5, NetworkRecipe(normalised=True))
    windows = 1.0 + 0.1 * torch.randn(50, 10, 5, 5)
    for _ in range(20):
        net(windows)  # it gets to know what is usual
    with torch.no_grad():
        for name, parameter in net.named_parameters():
            if "norm" in name:
                parameter.uniform_(*((0.5, 2.0) if name.endswith("weight") else (-0.5, 0.5)))
        plain = net.eval().folded()
        assert not [name for name in plain.state_dict() if "norm" in name]
        torch.testing.assert_close(plain(windows), net(windows), rtol=1e-4, atol=1e-5)
        where = location_net((5, 5), NetworkRecipe(normalised=True)).eval()
        images = windows[:, 0]
        torch.testing.assert_close(where.folded()(images), where(images), rtol=1e-4, atol=1e-5)
