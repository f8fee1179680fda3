"""The two networks: CNN-3D says what the hand does, CNN-2D where a press is.

Structure by the paper, section 4.1 and figure 6: two convolutions and two dense hidden
layers, relu, *same* padding; softmax and tanh at the end. Kernel sizes and widths are only
drawn there; ours are small, and CNN-3D halves the time axis before its dense layers, because
their weights, not the convolutions, cost the time. The paper's does not.
"""

from typing import Final

import torch
from torch import Tensor, nn

GAIN: Final = 10.0  # z - 1 is about 0.1 under a touch


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
        halves_time: bool = True,
    ) -> None:
        super().__init__()
        step = 2 if halves_time else 1
        self.conv1 = nn.Conv3d(1, channels[0], 3, padding=1)
        self.conv2 = nn.Conv3d(channels[0], channels[1], 3, padding=1, stride=(step, 1, 1))
        self.dense1 = nn.Linear(channels[1] * -(-window // step) * rows * columns, hidden[0])
        self.dense2 = nn.Linear(hidden[0], hidden[1])
        self.out = nn.Linear(hidden[1], classes)

    def forward(self, windows: Tensor) -> Tensor:
        """Return logits; the softmax belongs to the exported network."""
        x = (windows.unsqueeze(1) - 1.0) * GAIN
        x = torch.relu(self.conv1(x))
        x = torch.relu(self.conv2(x)).flatten(1)
        x = torch.relu(self.dense1(x))
        x = torch.relu(self.dense2(x))
        return torch.as_tensor(self.out(x))


class LocationNet(nn.Module):
    """CNN-2D: z images (batch, rows, columns) -> (x, y) in grid units (batch, 2)."""

    def __init__(
        self,
        rows: int,
        columns: int,
        channels: tuple[int, int] = (16, 32),
        hidden: tuple[int, int] = (64, 32),
    ) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(1, channels[0], 3, padding=1)
        self.conv2 = nn.Conv2d(channels[0], channels[1], 3, padding=1)
        self.dense1 = nn.Linear(channels[1] * rows * columns, hidden[0])
        self.dense2 = nn.Linear(hidden[0], hidden[1])
        self.out = nn.Linear(hidden[1], 2)
        # tanh covers the grid and half a pitch around it, so that its edge stays in reach.
        centre = torch.tensor([(columns - 1) / 2, (rows - 1) / 2])
        self.centre = nn.Buffer(centre)
        self.reach = nn.Buffer(centre + 0.5)

    def forward(self, images: Tensor) -> Tensor:
        """Return where the press is."""
        x = (images.unsqueeze(1) - 1.0) * GAIN
        x = torch.relu(self.conv1(x))
        x = torch.relu(self.conv2(x)).flatten(1)
        x = torch.relu(self.dense1(x))
        x = torch.relu(self.dense2(x))
        return torch.as_tensor(self.centre + self.reach * torch.tanh(self.out(x)))
