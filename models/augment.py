"""Symmetry and noise: more examples from each one, without a single new recording.

Symmetries are declared by each gesture, never assumed, and an example is turned or mirrored only
as its own gesture declares: a swipe to the left stays one, while a press beside it is turned. Null
is varied as far as all of them allow, because its windows hold their beginnings and ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor

from controller.vocabulary import NO_MIRROR, SELF, Vocabulary

QUARTERS: Final = {"none": (0,), "half": (0, 2), "all": (0, 1, 2, 3)}
DEAD_TAXELS: Final = 0.06  # of an example that has some


@dataclass(frozen=True, slots=True)
class Symmetry:
    """What may be done to an example of each class.

    Attributes:
        turns: Quarter turns counterclockwise that leave it the same gesture, for each class.
        mirror: Number of the class that its mirror image is, for each; -1 where that is none.
    """

    turns: tuple[tuple[int, ...], ...]
    mirror: tuple[int, ...]

    @classmethod
    def of(cls, vocabulary: Vocabulary, rows: int, columns: int) -> "Symmetry":
        """Return what the gestures declare, as far as the grid allows: quarters need a square."""
        labels = vocabulary.labels
        grid = QUARTERS["all" if rows == columns else "half"]
        turns = [tuple(k for k in QUARTERS[e.rotations] if k in grid) for e in vocabulary.entries]
        mirror = [
            -1 if e.mirror == NO_MIRROR else labels.index(e.label if e.mirror == SELF else e.mirror)
            for e in vocabulary.entries
        ]
        every = tuple(k for k in grid if all(k in own for own in turns))
        return cls((every, *turns), (0 if min(mirror) >= 0 else -1, *mirror))

    def of_class(self, number: int) -> "Symmetry":
        """Return what may be done to one class, as if it were the only one."""
        own = self.mirror[number] == number
        return Symmetry((self.turns[number],), (0 if own else -1,))

    def sentences(self, labels: Sequence[str]) -> list[str]:
        """Return what will be done, a sentence for each kind."""
        lines = []
        for words, turns in (
            ("turned by quarters", QUARTERS["all"]),
            ("turned by halves", QUARTERS["half"]),
            ("never turned", QUARTERS["none"]),
        ):
            if names := [labels[i] for i, own in enumerate(self.turns) if own == turns]:
                lines.append(f"{words}: {', '.join(names)}")
        same = [labels[i] for i, image in enumerate(self.mirror) if image == i]
        other = [f"{labels[i]} into {labels[j]}" for i, j in enumerate(self.mirror) if 0 <= j != i]
        never = [labels[i] for i, image in enumerate(self.mirror) if image < 0]
        for words, names in (("mirrored", same + other), ("never mirrored", never)):
            if names:
                lines.append(f"{words}: {', '.join(names)}")
        return lines


PLAIN: Final = Symmetry(((0,),), (-1,))


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How much examples are varied.

    Attributes:
        symmetric: They are turned and mirrored as their gestures declare.
        gain: Deviation of the signal's strength, relative.
        offset: Deviation of a constant error of each taxel (rest that is not quite true).
        noise: Deviation of white noise of each reading.
        dropout: Probability that an example has dead taxels.
        electrode: Probability that an example has a dead row or column.
    """

    symmetric: bool = True
    gain: float = 0.15
    offset: float = 0.004
    noise: float = 0.003
    dropout: float = 0.15
    electrode: float = 0.2

    def windows(
        self, windows: Tensor, labels: Tensor, symmetry: Symmetry, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Vary windows (batch, window, rows, columns) and their labels (batch,)."""
        if self.symmetric:
            device = windows.device
            if _draw(2, generator):
                image = torch.tensor(symmetry.mirror, device=device)[labels]
                may = image >= 0
                windows = torch.where(may[:, None, None, None], windows.flip(-1), windows)
                labels = torch.where(may, image, labels)
            if turns := _draw(4, generator):
                allowed = torch.tensor([turns in own for own in symmetry.turns], device=device)
                may = allowed[labels][:, None, None, None]
                if bool(may.any()):
                    windows = torch.where(may, torch.rot90(windows, turns, (-2, -1)), windows)
        return self._disturb(windows, generator), labels

    def images(
        self, images: Tensor, touches: Tensor, symmetry: Symmetry, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Vary press images (batch, rows, columns) and their touches (batch, 2), grid units.

        Args:
            images: z.
            touches: Where they are touched.
            symmetry: Of the one class that they are of.
            generator: Draws.
        """
        columns, rows = images.shape[-1], images.shape[-2]
        if self.symmetric:
            if _draw(2, generator) and symmetry.mirror[0] == 0:
                images = images.flip(-1)
                touches = torch.stack([columns - 1 - touches[:, 0], touches[:, 1]], dim=1)
            turns = _draw(4, generator)
            turns = turns if turns in symmetry.turns[0] else 0
            images = torch.rot90(images, turns, (-2, -1))
            for height in (rows, columns, rows)[:turns]:  # quarter turns counterclockwise
                touches = torch.stack([height - 1 - touches[:, 1], touches[:, 0]], dim=1)
        return self._disturb(images.unsqueeze(1), generator).squeeze(1), touches

    def _disturb(self, windows: Tensor, generator: torch.Generator) -> Tensor:
        """Vary strength, rest and noise, and kill taxels, each example on its own."""
        batch, _, rows, columns = windows.shape
        device = windows.device

        def normal(*shape: int) -> Tensor:
            return torch.randn(*shape, generator=generator, device=device)

        def chance(*shape: int) -> Tensor:
            return torch.rand(*shape, generator=generator, device=device)

        signal = windows - 1.0
        if self.gain:
            signal = signal * torch.exp(self.gain * normal(batch, 1, 1, 1))
        if self.offset:
            signal = signal + self.offset * normal(batch, 1, rows, columns)
        if self.noise:
            signal = signal + self.noise * normal(*windows.shape)
        if self.dropout:
            ill = chance(batch, 1, 1, 1) < self.dropout
            signal = signal * ~(ill & (chance(batch, 1, rows, columns) < DEAD_TAXELS))
        if self.electrode:
            ill = chance(batch, 1, 1, 1) < self.electrode
            which = torch.floor(chance(batch, 1, 1, 1) * (rows + columns))
            row = torch.arange(rows, device=device)[:, None]
            column = torch.arange(columns, device=device)[None, :]
            signal = signal * ~(ill & ((which == row) | (which == rows + column)))
        return 1.0 + signal


def _draw(choices: int, generator: torch.Generator) -> int:
    """Draw a number from 0 on."""
    drawn = torch.randint(0, choices, (1,), generator=generator, device=generator.device)
    return int(drawn.item())
