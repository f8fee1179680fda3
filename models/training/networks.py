"""The two networks: CNN-3D says what the hand does, CNN-2D where a press is.

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

from typing import Final, Self

import torch
from torch import Tensor, nn

from models.training import matmul_convolution

GAIN: Final = 10.0  # z - 1 is about 0.1 under a touch
CONVOLUTIONS: Final = 2  # layers before the dense ones


class GestureNet(nn.Module):
    """CNN-3D: windows of z images (batch, window, rows, columns) -> logits (batch, classes)."""

    def __init__(
        self,
        window: int,
        rows: int,
        columns: int,
        classes: int,
        channels: tuple[int, int] = (12, 24),
        hidden: tuple[int, int] = (64, 32),
        *,
        strides: bool = True,
        normalised: bool = False,
    ) -> None:
        """Build it, with weights to begin with.

        Args:
            window: Images.
            rows: Of taxels.
            columns: Of taxels.
            classes: Labels, null among them.
            channels: Maps of the convolutions.
            hidden: Widths of the dense layers.
            strides: It takes longer steps; else it is the paper's.
            normalised: Layers are normalised over each batch while it learns; `folded` afterwards.
        """
        super().__init__()
        taxels = (rows, columns)
        if strides:
            first = _kernel(window, 4)
            steps = (window - first) // 2 + 1
            second = _kernel(steps, 3)
            steps = (steps - second) // 2 + 1
            taxels = (-(-rows // 2), -(-columns // 2))
            self.conv1 = nn.Conv3d(1, channels[0], (first, 3, 3), stride=2, padding=(0, 1, 1))
            self.conv2 = nn.Conv3d(*channels, (second, 3, 3), stride=(2, 1, 1), padding=(0, 1, 1))
        else:
            steps = window
            self.conv1 = nn.Conv3d(1, channels[0], 3, padding=1)
            self.conv2 = nn.Conv3d(*channels, 3, padding=1)
        self.dense1 = nn.Linear(channels[1] * steps * taxels[0] * taxels[1], hidden[0])
        self.dense2 = nn.Linear(hidden[0], hidden[1])
        self.out = nn.Linear(hidden[1], classes)
        self.norms = nn.ModuleList()
        if normalised:
            self.norms.extend(nn.BatchNorm3d(maps) for maps in channels)
            self.norms.extend(nn.BatchNorm1d(width) for width in hidden)
        # On a small grid it learns by products, which answer the same.
        self._small = strides and rows * columns <= matmul_convolution.MOST
        if self._small:
            self.reach1 = nn.Buffer(matmul_convolution.reach(rows, columns, 2), persistent=False)
            self.reach2 = nn.Buffer(matmul_convolution.reach(*taxels, 1), persistent=False)
        self._made_of = (window, rows, columns, classes, channels, hidden)
        self._strides = strides

    def forward(self, windows: Tensor) -> Tensor:
        """Return logits; the softmax belongs to the exported network."""
        if self.training and self._small:
            return torch.as_tensor(self.out(_hidden(self, self._products(windows))))
        return torch.as_tensor(self.out(_trunk(self, windows)))

    def folded(self) -> Self:
        """Return a network that answers the same, normalisation worked into its weights."""
        plain = type(self)(*self._made_of, strides=self._strides)
        own = {k: t for k, t in self.state_dict().items() if not k.startswith("norms.")}
        plain.load_state_dict(own)
        _fold(self.norms, (plain.conv1, plain.conv2, plain.dense1, plain.dense2))
        return plain

    def narrowed(self, classes: int) -> Self:
        """Return a network that tells the first classes apart, as this one does among them."""
        window, rows, columns, _, channels, hidden = self._made_of
        narrow = type(self)(window, rows, columns, classes, channels, hidden, strides=self._strides)
        own = self.state_dict()
        own |= {name: own[name][:classes] for name in ("out.weight", "out.bias")}
        narrow.load_state_dict(own)
        return narrow

    def _products(self, windows: Tensor) -> Tensor:
        """Return what the convolutions make of windows, the sooner for small ones."""
        x = ((windows - 1.0) * GAIN).flatten(2)
        for number, (layer, reached) in enumerate(
            ((self.conv1, self.reach1), (self.conv2, self.reach2))
        ):
            x = matmul_convolution.convolve(x, layer, reached)
            apart = x.view(-1, layer.out_channels, 1, 1, reached.shape[2])
            x = torch.relu(self.norms[number](apart) if self.norms else apart).view(x.shape)
        # Maps first, as the convolutions have it: (batch, maps, images, taxels).
        apart = x.view(len(x), -1, self.conv2.out_channels, self.reach2.shape[2])
        return apart.transpose(1, 2).flatten(1)


class LocationNet(nn.Module):
    """CNN-2D: z images (batch, rows, columns) -> (x, y) in grid units (batch, 2)."""

    def __init__(
        self,
        rows: int,
        columns: int,
        channels: tuple[int, int] = (16, 32),
        hidden: tuple[int, int] = (64, 32),
        *,
        strides: bool = True,
        normalised: bool = False,
    ) -> None:
        """Build it, with weights to begin with.

        Args:
            rows: Of taxels.
            columns: Of taxels.
            channels: Maps of the convolutions.
            hidden: Widths of the dense layers.
            strides: The second convolution goes by two taxels; else it is the paper's.
            normalised: As in `GestureNet`.
        """
        super().__init__()
        step = 2 if strides else 1
        self.conv1 = nn.Conv2d(1, channels[0], 3, padding=1)
        self.conv2 = nn.Conv2d(*channels, 3, padding=1, stride=step)
        places = -(-rows // step) * -(-columns // step)
        self.dense1 = nn.Linear(channels[1] * places, hidden[0])
        self.dense2 = nn.Linear(hidden[0], hidden[1])
        self.out = nn.Linear(hidden[1], 2)
        # tanh covers the grid and half a pitch around it, so that its edge stays in reach.
        centre = torch.tensor([(columns - 1) / 2, (rows - 1) / 2])
        self.centre = nn.Buffer(centre)
        self.reach = nn.Buffer(centre + 0.5)
        self.norms = nn.ModuleList()
        if normalised:
            self.norms.extend(nn.BatchNorm2d(maps) for maps in channels)
            self.norms.extend(nn.BatchNorm1d(width) for width in hidden)
        self._made_of = (rows, columns, channels, hidden)
        self._strides = strides

    def forward(self, images: Tensor) -> Tensor:
        """Return where the press is."""
        x = _trunk(self, images)
        return torch.as_tensor(self.centre + self.reach * torch.tanh(self.out(x)))

    def folded(self) -> Self:
        """Return a network that answers the same, normalisation worked into its weights."""
        plain = type(self)(*self._made_of, strides=self._strides)
        own = {k: t for k, t in self.state_dict().items() if not k.startswith("norms.")}
        plain.load_state_dict(own)
        _fold(self.norms, (plain.conv1, plain.conv2, plain.dense1, plain.dense2))
        return plain


def _trunk(net: GestureNet | LocationNet, z: Tensor) -> Tensor:
    """Return what both networks have in common: all up to the last dense layer."""
    x = (z.unsqueeze(1) - 1.0) * GAIN
    for number, layer in enumerate((net.conv1, net.conv2)):
        x = layer(x)
        x = torch.relu(net.norms[number](x) if net.norms else x)
    return _hidden(net, x.flatten(1))


def _hidden(net: GestureNet | LocationNet, x: Tensor) -> Tensor:
    """Return what the dense layers but the last make of the convolutions' answers."""
    for number, layer in enumerate((net.dense1, net.dense2), CONVOLUTIONS):
        x = layer(x)
        x = torch.relu(net.norms[number](x) if net.norms else x)
    return x


def _fold(norms: nn.ModuleList, layers: tuple[nn.Conv2d | nn.Conv3d | nn.Linear, ...]) -> None:
    """Work each normalisation, where there is any, into the weights of its layer, in place."""
    with torch.no_grad():
        for layer, norm in zip(layers, norms, strict=bool(norms)):
            assert isinstance(norm, nn.BatchNorm1d | nn.BatchNorm2d | nn.BatchNorm3d)
            mean, spread = norm.running_mean, norm.running_var
            assert mean is not None
            assert spread is not None
            assert layer.bias is not None
            scale = norm.weight / torch.sqrt(spread + norm.eps)
            layer.weight.mul_(scale.reshape(-1, *(1,) * (layer.weight.ndim - 1)))
            layer.bias.sub_(mean).mul_(scale).add_(norm.bias)


def _kernel(steps: int, usual: int) -> int:
    """Return how long a kernel is, so that strides of two end at the newest of so many steps."""
    return steps if steps < usual else usual - (steps - usual) % 2
