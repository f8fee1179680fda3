"""Convolutions as matrix products: faster while a network learns, and the same in all else."""

import pytest

pytest.importorskip("torch", reason="needs the [train] extra")

import torch
from torch import nn

from models.training import matmul_convolution
from models.training.networks import GestureNet

pytestmark = pytest.mark.train


@pytest.mark.parametrize(
    ("rows", "columns", "stride"), [(5, 5, 2), (3, 3, 1), (4, 6, 2), (1, 2, 1)]
)
def test_a_product_answers_as_the_convolution_does(rows: int, columns: int, stride: int) -> None:
    torch.manual_seed(1)
    layer = nn.Conv3d(2, 3, (4, 3, 3), stride=(2, stride, stride), padding=(0, 1, 1))
    images = torch.randn(6, 2, 10, rows, columns)  # (batch, maps, images, rows, columns)
    expected = layer(images)
    apart = images.transpose(1, 2).flatten(2)
    given = matmul_convolution.convolve(
        apart, layer, matmul_convolution.reach(rows, columns, stride)
    )
    torch.testing.assert_close(given, expected.transpose(1, 2).flatten(2), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(("window", "rows", "columns"), [(10, 5, 5), (12, 4, 6), (9, 12, 12)])
def test_a_network_learns_the_same_as_with_convolutions(
    window: int, rows: int, columns: int
) -> None:
    torch.manual_seed(2)
    net = GestureNet(window, rows, columns, 5).eval()  # without norms: they differ by design
    windows = 1.0 + 0.1 * torch.randn(8, window, rows, columns)
    slopes = []
    for learning in (False, True):
        net.train(learning)
        net.zero_grad()
        net(windows).square().sum().backward()
        slopes.append([parameter.grad for parameter in net.parameters()])
    torch.testing.assert_close(slopes[1], slopes[0], rtol=1e-3, atol=1e-4)


def test_what_it_is_spread_over_is_not_kept_with_the_weights() -> None:
    assert not [name for name in GestureNet(10, 5, 5, 5).state_dict() if "reach" in name]
