"""Convolutions of a small grid as matrix products: what they cost while a network learns.

On so few taxels a convolution's own program spends more time on finding its numbers than on
multiplying them. Each place of the grid feels nearly all others anyway, so the kernel is spread
over one matrix from all taxels to all taxels, zeros where it does not reach, and the images of a
window that it spans are neighbours in memory already. The answers are a convolution's, to rounding.
"""

from typing import Final

import torch
from torch import Tensor, nn

KERNEL: Final = 3  # taxels, each way
MOST: Final = 36  # taxels: larger matrices hold too many zeros


def reach(rows: int, columns: int, stride: int) -> Tensor:
    """Return which place of a kernel lies between which taxels, (kernel, taxels in, taxels out).

    A kernel of 3×3 with *same* padding, in steps of `stride` taxels; ones and zeros.
    """
    places = torch.eye(rows * columns).reshape(-1, 1, rows, columns)
    patches = nn.functional.unfold(places, KERNEL, padding=KERNEL // 2, stride=stride)
    return patches.permute(1, 0, 2).contiguous()


def convolve(x: Tensor, layer: nn.Conv3d, reached: Tensor) -> Tensor:
    """Return what a convolution makes of images whose taxels stand in a row.

    Args:
        x: (batch, images, maps × taxels).
        layer: Its kernel spans all maps, and steps through time without padding.
        reached: From `reach`.

    Returns:
        (batch, images, maps × taxels), as many as it makes.
    """
    batch, images, width = x.shape
    maps, inputs, span = layer.weight.shape[:3]
    _, taxels, places = reached.shape
    step = int(layer.stride[0])
    made = (images - span) // step + 1
    kernel = layer.weight.reshape(-1, KERNEL * KERNEL) @ reached.flatten(1)
    kernel = kernel.view(maps, inputs, span, taxels, places).permute(2, 1, 3, 0, 4)
    x = x.contiguous()
    spans = x.as_strided((batch, made, span * width), (images * width, step * width, 1))
    assert layer.bias is not None
    bias = layer.bias.repeat_interleave(places)
    flat = kernel.reshape(span * width, maps * places)
    return torch.addmm(bias, spans.reshape(batch * made, -1), flat).view(batch, made, -1)
