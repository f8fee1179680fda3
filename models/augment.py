"""Symmetry and noise: more examples from each one, without a single new recording.

Symmetries are declared per gesture, never assumed: a dome looks the same from all sides, and
its mirror image turns a clockwise twist into a counterclockwise one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

import torch
from torch import Tensor

from controller.simulator.repertoire import Repertoire, shipped

Rotations = Literal["none", "half", "all"]

_ROTATIONS: Final[tuple[Rotations, ...]] = ("none", "half", "all")  # fewest first
PAPER_MIRRORS: Final = {"twist_cw": "twist_ccw", "twist_ccw": "twist_cw"}


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How much examples are varied.

    Attributes:
        rotations: Turns allowed for every gesture: "all" are quarter turns (square grids only).
        mirrors: Label -> label of its mirror image; None forbids mirroring.
        gain: Deviation of the signal's strength, relative.
        offset: Deviation of a constant error of each taxel (rest that is not quite true).
        noise: Deviation of white noise of each reading.
        dropout: Probability that an example has dead taxels.
    """

    rotations: Rotations = "all"
    mirrors: Mapping[str, str] | None = field(default_factory=lambda: dict(PAPER_MIRRORS))
    gain: float = 0.15
    offset: float = 0.004
    noise: float = 0.003
    dropout: float = 0.15

    @classmethod
    def declared(
        cls, labels: Sequence[str], rows: int, columns: int, gestures: Repertoire | None = None
    ) -> "Augmentation":
        """Return the symmetries that all of these gestures declare (docs/gestures.md).

        Args:
            labels: "null" first; a label of which no gesture is known declares nothing.
            rows: Of the grid: quarter turns need a square one.
            columns: Of the grid.
            gestures: Where they declare; those that ship if not given.
        """
        known = shipped() if gestures is None else gestures
        turns = ["all" if rows == columns else "half"]
        turns += [known[label].rotations if label in known else "none" for label in labels[1:]]
        images = {label: known[label].mirror if label in known else "none" for label in labels[1:]}
        whole = all(image == "self" or image in labels for image in images.values())
        return cls(
            next(rotations for rotations in _ROTATIONS if rotations in turns),
            {label: image for label, image in images.items() if image != "self"} if whole else None,
        )

    def windows(
        self, windows: Tensor, labels: Tensor, names: Sequence[str], generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Vary windows (batch, window, rows, columns) and their labels (batch,)."""
        if self.mirrors is not None:
            flip = torch.rand(1, generator=generator).item() < 0.5
            if flip:
                swap = torch.tensor([names.index(self.mirrors.get(name, name)) for name in names])
                windows, labels = windows.flip(-1), swap[labels]
        windows = torch.rot90(windows, self._turns(generator), (-2, -1))
        return self._disturb(windows, generator), labels

    def images(
        self, images: Tensor, touches: Tensor, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Vary press images (batch, rows, columns) and their touches (batch, 2), grid units."""
        columns, rows = images.shape[-1], images.shape[-2]
        if self.mirrors is not None and torch.rand(1, generator=generator).item() < 0.5:
            images = images.flip(-1)
            touches = torch.stack([columns - 1 - touches[:, 0], touches[:, 1]], dim=1)
        turns = self._turns(generator)
        images = torch.rot90(images, turns, (-2, -1))
        for height in (rows, columns, rows)[:turns]:  # quarter turns counterclockwise
            touches = torch.stack([height - 1 - touches[:, 1], touches[:, 0]], dim=1)
        return self._disturb(images.unsqueeze(1), generator).squeeze(1), touches

    def _turns(self, generator: torch.Generator) -> int:
        """Draw a number of quarter turns."""
        if self.rotations == "none":
            return 0
        step = 1 if self.rotations == "all" else 2
        return step * int(torch.randint(0, 4 // step, (1,), generator=generator).item())

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
