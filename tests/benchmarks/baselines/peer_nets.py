"""Networks that peers are: other ways from a window to its class."""

from collections.abc import Callable
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from models.training.networks import GAIN

AT_ONCE: Final = 256  # questions asked together


class Gru(nn.Module):
    """A gated recurrent unit over the images of a window."""

    def __init__(self, window: int, taxels: int, classes: int) -> None:
        super().__init__()
        self.gru = nn.GRU(taxels, 64, batch_first=True)
        self.out = nn.Linear(64, classes)

    def forward(self, windows: Tensor) -> Tensor:
        """Return logits."""
        states, _ = self.gru((windows.flatten(2) - 1.0) * GAIN)
        return torch.as_tensor(self.out(states[:, -1]))


class Mlp(nn.Module):
    """Two dense layers on a whole window."""

    def __init__(self, window: int, taxels: int, classes: int) -> None:
        super().__init__()
        self.dense1, self.dense2 = nn.Linear(window * taxels, 128), nn.Linear(128, 64)
        self.out = nn.Linear(64, classes)

    def forward(self, windows: Tensor) -> Tensor:
        """Return logits."""
        x = torch.relu(self.dense1((windows.flatten(1) - 1.0) * GAIN))
        return torch.as_tensor(self.out(torch.relu(self.dense2(x))))


NETS: Final[dict[str, Callable[[int, int, int], nn.Module]]] = {"gru": Gru, "mlp": Mlp}


def ask(net: nn.Module, hot: float, questions: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return probabilities of a network's logits at a temperature; at 0 its answers as they are."""
    with torch.no_grad():
        parts = [
            net(torch.from_numpy(questions[i : i + AT_ONCE]))
            for i in range(0, max(1, len(questions)), AT_ONCE)
        ]
        together = torch.cat(parts)
        answers = torch.softmax(together / hot, dim=1) if hot else together
    return np.asarray(answers.numpy(), dtype=np.float32)
