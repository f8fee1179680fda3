"""The two networks: CNN-3D classifies gestures, CNN-2D locates a press.

Structure by the paper, section 4.1 and figure 6: two convolutions and two dense hidden
layers, relu, *same* padding; softmax and tanh at the end. Kernel sizes and widths are only
drawn there.

Our CNN-3D takes longer steps: its first convolution goes by two taxels and two images, its
second by two steps of the first. A window of 10 images of 5×5 taxels so comes down to 2×3×3
places before the dense layers, not 10×5×5, at a thirtieth of the paper's multiplications. In
time nothing is padded and the last step ends at the newest image, so an engine that keeps what
earlier windows had in common has one place in time to convolve for a new image. The second
convolution of CNN-2D goes by two taxels.
"""

from collections import OrderedDict
from collections.abc import Sequence
from copy import deepcopy
from typing import Final

import torch
from torch import Tensor, nn
from torch.nn.modules.batchnorm import _BatchNorm
from torch.nn.utils.fusion import fuse_conv_bn_eval, fuse_linear_bn_eval

from models.data.recipe import NetworkRecipe

GAIN: Final = 10.0  # z - 1 is about 0.1 under a touch
KERNEL: Final = 3  # taxels, each way
IMAGES: Final = 10  # steps through time that a longer window is brought down to, about
SMALL_GRID: Final = 36  # taxels: the matrices of a larger grid hold too many zeros


class Network(nn.Sequential):
    """A chain of named layers. CNN-3D ends in logits: its softmax belongs to the exported file."""

    def folded(self) -> "Network":
        """Return an equivalent network, its normalisation folded into the layers before it.

        It has no dropout.
        """
        made: OrderedDict[str, nn.Module] = OrderedDict()
        last = ""
        for name, layer in deepcopy(self).eval().named_children():
            if isinstance(layer, nn.Dropout):
                continue
            if not isinstance(layer, _BatchNorm):
                made[name], last = layer, name
            elif isinstance(before := made[last], nn.Linear):
                made[last] = fuse_linear_bn_eval(before, layer)
            else:
                assert isinstance(before, nn.Conv2d | nn.Conv3d)
                made[last] = fuse_conv_bn_eval(before, layer)
        return Network(made)

    def weights(self) -> int:
        """Return the number of weights."""
        return sum(parameter.numel() for parameter in self.parameters())

    def narrowed(self, classes: int) -> "Network":
        """Return a network of the first classes alone, with the same logits for them."""
        narrow = deepcopy(self)
        out = narrow.out
        assert isinstance(out, nn.Linear)
        out.weight = nn.Parameter(out.weight.detach()[:classes].clone())
        out.bias = nn.Parameter(out.bias.detach()[:classes].clone())
        out.out_features = classes
        return narrow


def gesture_net(shape: tuple[int, int, int], classes: int, recipe: NetworkRecipe) -> Network:
    """Return CNN-3D: z windows (batch, window, rows, columns) -> logits (batch, classes)."""
    window, *grid = shape
    maps = recipe.channels
    convolutions: list[nn.Module]
    if recipe.strides:
        pace = max(2, window // IMAGES)
        first = _span(window, 2 * pace, pace)
        steps = (window - first) // pace + 1
        second = _span(steps, 3, 2)
        steps = (steps - second) // 2 + 1
        halved = [-(-side // 2) for side in grid]
        convolutions = [
            GridConvolution(1, maps[0], first, grid, stride=2, pace=pace),
            GridConvolution(maps[0], maps[1], second, halved, stride=1, pace=2),
        ]
        taxels = halved[0] * halved[1]
    else:
        steps, taxels = window, grid[0] * grid[1]
        convolutions = [
            nn.Conv3d(1, maps[0], KERNEL, padding=1),
            nn.Conv3d(maps[0], maps[1], KERNEL, padding=1),
        ]
    return _network(convolutions, nn.BatchNorm3d, steps * taxels, classes, recipe)


def location_net(shape: tuple[int, int], recipe: NetworkRecipe) -> Network:
    """Return CNN-2D: inputs (batch, *shape) -> (x, y) in them, in grid units (batch, 2)."""
    step = 2 if recipe.strides else 1
    maps = recipe.channels
    convolutions = [
        nn.Conv2d(1, maps[0], KERNEL, padding=1),
        nn.Conv2d(maps[0], maps[1], KERNEL, padding=1, stride=step),
    ]
    taxels = -(-shape[0] // step) * -(-shape[1] // step)
    net = _network(convolutions, nn.BatchNorm2d, taxels, 2, recipe)
    net.add_module("position", GridPosition(*shape))
    return net


def _network(
    convolutions: Sequence[nn.Module],
    norm: type[nn.BatchNorm2d] | type[nn.BatchNorm3d],
    places: int,
    outputs: int,
    recipe: NetworkRecipe,
) -> Network:
    """Return a network of these convolutions and the recipe's dense layers.

    `places` are those of a map after the last convolution, which `norm` normalises.
    """
    layers: OrderedDict[str, nn.Module] = OrderedDict(scale=Scale())

    def add(name: str, number: int, layer: nn.Module, norm: nn.Module) -> None:
        layers[f"{name}{number}"] = layer
        if recipe.normalised:
            layers[f"{name}{number}_norm"] = norm
        layers[f"{name}{number}_relu"] = nn.ReLU()
        if recipe.dropped and name == "dense":
            layers[f"{name}{number}_dropout"] = nn.Dropout(recipe.dropped)

    for number, layer in enumerate(convolutions, 1):
        add("conv", number, layer, norm(recipe.channels[number - 1]))
    layers["flatten"] = nn.Flatten()
    width = recipe.channels[-1] * places
    for number, hidden in enumerate(recipe.hidden, 1):
        add("dense", number, nn.Linear(width, hidden), nn.BatchNorm1d(hidden))
        width = hidden
    layers["out"] = nn.Linear(width, outputs)
    return Network(layers)


def _span(steps: int, usual: int, pace: int) -> int:
    """Return a kernel's length, so that strides of `pace` end at the newest of so many steps."""
    return steps if steps < usual else usual - (usual - steps) % pace


class Scale(nn.Module):
    """Input layer: z (batch, ...) -> (z - 1) x `GAIN` with one map (batch, 1, ...)."""

    def forward(self, z: Tensor) -> Tensor:
        """Return the scaled input, (batch, 1, ...)."""
        return (z.unsqueeze(1) - 1.0) * GAIN


class GridPosition(nn.Module):
    """Output layer of CNN-2D: tanh over the grid and half a pitch around it, grid units."""

    def __init__(self, rows: int, columns: int) -> None:
        super().__init__()
        self.centre = nn.Buffer(torch.tensor([(columns - 1) / 2, (rows - 1) / 2]))
        self.reach = nn.Buffer(self.centre + 0.5)  # the grid's edge stays in reach of tanh

    def forward(self, x: Tensor) -> Tensor:
        """Return positions (batch, 2)."""
        return self.centre + self.reach * torch.tanh(x)


class GridConvolution(nn.Conv3d):
    """A convolution over time and a grid of taxels; on a small grid it trains as a matrix product.

    On a larger one it trains as a convolution over the grid alone, of the images that it spans.

    On so few taxels a convolution's own program spends more time on finding its numbers than on
    multiplying them. Each place of the grid reaches nearly all others anyway, so the kernel is
    spread over one matrix from all taxels to all taxels, zeros where it does not reach, and the
    images of a window that it spans are neighbours in memory. The result is a convolution's, to
    rounding.
    """

    def __init__(
        self, inputs: int, maps: int, span: int, grid: list[int], stride: int, pace: int
    ) -> None:
        """Build it with a kernel of (span, 3, 3) for a grid of (rows, columns).

        Its steps are `pace` through time, without padding, and `stride` over the taxels, *same*
        padding.
        """
        kernel = (span, KERNEL, KERNEL)
        super().__init__(inputs, maps, kernel, stride=(pace, stride, stride), padding=(0, 1, 1))
        small = grid[0] * grid[1] <= SMALL_GRID
        self.reach = nn.Buffer(_reach(grid, stride), persistent=False) if small else None

    def forward(self, x: Tensor) -> Tensor:
        """Convolve (batch, maps, images, rows, columns)."""
        if not self.training:
            return super().forward(x)
        if self.reach is None:
            return self._flat(x)
        # Maps stand last in memory, so that the images of a window are neighbours.
        batch, _, images, rows, columns = x.shape
        maps, inputs, span = self.weight.shape[:3]
        _, taxels, places = self.reach.shape
        step, width = int(self.stride[0]), taxels * inputs
        made = (images - span) // step + 1
        kernel = self.weight.reshape(-1, KERNEL * KERNEL) @ self.reach.flatten(1)
        kernel = kernel.view(maps, inputs, span, taxels, places).permute(2, 3, 1, 4, 0)
        flat = x.permute(0, 2, 3, 4, 1).contiguous()
        spans = flat.as_strided((batch, made, span * width), (images * width, step * width, 1))
        assert self.bias is not None
        product = torch.addmm(
            self.bias.repeat(places),
            spans.reshape(batch * made, -1),
            kernel.reshape(span * width, places * maps),
        )
        stride = int(self.stride[1])
        grid = -(-rows // stride), -(-columns // stride)
        return product.view(batch, made, *grid, maps).permute(0, 4, 1, 2, 3)

    def _flat(self, x: Tensor) -> Tensor:
        """Convolve as `forward` does, in two dimensions: gradients take half the time."""
        batch, inputs, _, rows, columns = x.shape
        maps, _, span = self.weight.shape[:3]
        spans = x.unfold(2, span, int(self.stride[0]))
        made = spans.shape[2]
        flat = spans.permute(0, 2, 1, 5, 3, 4).reshape(batch * made, inputs * span, rows, columns)
        product = nn.functional.conv2d(
            flat.contiguous(memory_format=torch.channels_last),
            self.weight.reshape(maps, inputs * span, KERNEL, KERNEL),
            self.bias,
            stride=(int(self.stride[1]), int(self.stride[2])),
            padding=KERNEL // 2,
        )
        return product.reshape(batch, made, maps, *product.shape[2:]).transpose(1, 2)


def _reach(grid: list[int], stride: int) -> Tensor:
    """Return which place of a kernel lies between which taxels, (kernel, taxels in, taxels out)."""
    places = torch.eye(grid[0] * grid[1]).reshape(-1, 1, *grid)
    patches = nn.functional.unfold(places, KERNEL, padding=KERNEL // 2, stride=stride)
    return patches.permute(1, 0, 2).contiguous()
