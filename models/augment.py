"""Symmetry and noise: more examples from each one, without a single new recording.

Symmetries are declared per gesture, never assumed: a dome looks the same from all sides, and
its mirror image turns a clockwise twist into a counterclockwise one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import torch
from torch import Tensor

PAPER_MIRRORS: Final = {"twist_cw": "twist_ccw", "twist_ccw": "twist_cw"}


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How much examples are varied.

    Attributes:
        rotations: Quarter turns are allowed for every gesture (square grids only).
        mirrors: Label -> label of its mirror image; None forbids mirroring.
        gain: Deviation of the signal's strength, relative.
        offset: Deviation of a constant error of each taxel (rest that is not quite true).
        noise: Deviation of white noise of each reading.
        dropout: Probability that an example has dead taxels.
    """

    rotations: bool = True
    mirrors: Mapping[str, str] | None = field(default_factory=lambda: dict(PAPER_MIRRORS))
    gain: float = 0.15
    offset: float = 0.004
    noise: float = 0.003
    dropout: float = 0.15

    def windows(
        self, windows: Tensor, labels: Tensor, names: Sequence[str], generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Vary windows (batch, window, rows, columns) and their labels (batch,)."""
        if self.mirrors is not None:
            flip = torch.rand(1, generator=generator).item() < 0.5
            if flip:
                swap = torch.tensor([names.index(self.mirrors.get(name, name)) for name in names])
                windows, labels = windows.flip(-1), swap[labels]
        if self.rotations:
            turns = int(torch.randint(0, 4, (1,), generator=generator).item())
            windows = torch.rot90(windows, turns, (-2, -1))
        return self._disturb(windows, generator), labels

    def images(
        self, images: Tensor, touches: Tensor, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Vary press images (batch, rows, columns) and their touches (batch, 2), grid units."""
        columns, rows = images.shape[-1], images.shape[-2]
        if self.mirrors is not None and torch.rand(1, generator=generator).item() < 0.5:
            images = images.flip(-1)
            touches = torch.stack([columns - 1 - touches[:, 0], touches[:, 1]], dim=1)
        if self.rotations:
            turns = int(torch.randint(0, 4, (1,), generator=generator).item())
            images = torch.rot90(images, turns, (-2, -1))
            for _ in range(turns):  # a quarter turn counterclockwise about the centre
                touches = torch.stack([rows - 1 - touches[:, 1], touches[:, 0]], dim=1)
        return self._disturb(images.unsqueeze(1), generator).squeeze(1), touches

    def _disturb(self, windows: Tensor, generator: torch.Generator) -> Tensor:
        """Vary strength, rest and noise, and kill taxels, each example on its own."""
        batch, _, rows, columns = windows.shape

        def normal(*shape: int) -> Tensor:
            return torch.randn(*shape, generator=generator)

        signal = (windows - 1.0) * torch.exp(self.gain * normal(batch, 1, 1, 1))
        signal = signal + self.offset * normal(batch, 1, rows, columns)
        signal = signal + self.noise * normal(*windows.shape)
        ill = torch.rand(batch, 1, 1, 1, generator=generator) < self.dropout
        dead = ill & (torch.rand(batch, 1, rows, columns, generator=generator) < 0.06)
        return 1.0 + signal * ~dead
