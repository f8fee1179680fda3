"""Symmetry and noise: more examples from each one, without a single new recording.

Symmetries are declared by each gesture, never assumed, and an example is turned or mirrored only
as its own gesture declares: a swipe to the left stays one, while a press beside it is turned. Null
is varied as far as all of them allow, because its windows hold their beginnings and ends.

A hand comes from where its owner sits, so few examples are turned: with all of them turned at
random, networks name fewer frames rightly. Left hands mirror right ones, so half are mirrored.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import torch
from torch import Tensor, nn

from controller.bundles.vocabulary import NO_MIRROR, SELF, Vocabulary

QUARTERS: Final = {"none": (0,), "half": (0, 2), "all": (0, 1, 2, 3)}
DEAD_TAXELS: Final = 0.06  # of an example that has some


@dataclass(frozen=True, slots=True)
class Symmetry:
    """What may be done to an example of each class.

    Attributes:
        turns: Quarter turns counterclockwise that leave it the same gesture, for each class.
        mirror: Number of the class that its mirror image is, for each; -1 where that is none.
        shifts: Whether it is the same gesture elsewhere on the sensor, for each; (): none is.
    """

    turns: tuple[tuple[int, ...], ...]
    mirror: tuple[int, ...]
    shifts: tuple[bool, ...] = ()

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
        shifts = [entry.shifts for entry in vocabulary.entries]
        return cls(
            (every, *turns),
            (0 if min(mirror) >= 0 else -1, *mirror),
            (all(shifts), *shifts) if any(shifts) else (),
        )

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
        if moved := [label for label, may in zip(labels, self.shifts, strict=False) if may]:
            lines.append(f"shifted: {', '.join(moved)}")
        return lines


PLAIN: Final = Symmetry(((0,),), (-1,))


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How much examples are varied.

    Attributes:
        turned: Share of examples that are turned by quarters, as far as their gestures declare.
        mirrored: Share of examples that are mirrored, likewise.
        shifted: Greatest distance that windows are shifted in each direction, taxels, likewise.
        gain: Deviation of the signal's strength, relative.
        offset: Deviation of a constant error of each taxel (rest that is not quite true).
        noise: Deviation of white noise of each reading.
        dropout: Probability that an example has dead taxels.
        electrode: Probability that an example has a dead row or column.
    """

    turned: float = 0.2
    mirrored: float = 0.5
    shifted: int = 1
    gain: float = 0.15
    offset: float = 0.004
    noise: float = 0.003
    dropout: float = 0.15
    electrode: float = 0.2

    @property
    def symmetric(self) -> bool:
        """Whether any example is turned or mirrored."""
        return self.turned > 0.0 or self.mirrored > 0.0

    def windows(
        self, windows: Tensor, labels: Tensor, symmetry: Symmetry, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Vary windows (batch, window, rows, columns) and their labels (batch,)."""
        if self.symmetric:
            mirrored, turns = self._symmetries(labels, symmetry, generator)
            image = torch.tensor(symmetry.mirror, device=labels.device)[labels]
            labels = torch.where(mirrored, image, labels)
            windows = _moved(windows, mirrored, turns)
        if self.shifted and symmetry.shifts:
            windows = _shifted(windows, self._ways_off(labels, symmetry, generator), self.shifted)
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
        images = images.unsqueeze(1)
        if self.symmetric:
            own = torch.zeros(len(images), dtype=torch.long, device=images.device)
            mirrored, turns = self._symmetries(own, symmetry, generator)
            images = _moved(images, mirrored, turns)
            other = torch.stack([columns - 1 - touches[:, 0], touches[:, 1]], dim=1)
            touches = torch.where(mirrored[:, None], other, touches)
            for turn, height in enumerate((rows, columns, rows)):  # quarters, counterclockwise
                other = torch.stack([height - 1 - touches[:, 1], touches[:, 0]], dim=1)
                touches = torch.where(turns[:, None] > turn, other, touches)
        return self._disturb(images, generator).squeeze(1), touches

    def _symmetries(
        self, labels: Tensor, symmetry: Symmetry, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draw which examples are mirrored, and by how many quarters each is turned then."""
        batch, device = len(labels), labels.device
        chance = torch.rand(2, batch, generator=generator, device=device)
        image = torch.tensor(symmetry.mirror, device=device)[labels]
        mirrored = (chance[0] < self.mirrored) & (image >= 0)
        labels = torch.where(mirrored, image, labels)
        turns = torch.randint(0, 4, (batch,), generator=generator, device=device)
        allowed = torch.tensor([[k in own for k in range(4)] for own in symmetry.turns])
        may = (chance[1] < self.turned) & allowed.to(device)[labels, turns]
        return mirrored, torch.where(may, turns, 0)

    def _ways_off(self, labels: Tensor, symmetry: Symmetry, generator: torch.Generator) -> Tensor:
        """Draw how far each example is shifted: a number of `_places`, (batch,)."""
        side = 2 * self.shifted + 1
        ways = torch.randint(
            0, side * side, (len(labels),), generator=generator, device=labels.device
        )
        may = torch.tensor(symmetry.shifts, device=labels.device)[labels]
        return torch.where(may, ways, side * side // 2)  # the middle one stays where it is

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
            signal.mul_(torch.exp(self.gain * normal(batch, 1, 1, 1)))
        if self.offset:
            signal.add_(self.offset * normal(batch, 1, rows, columns))
        if self.noise:
            signal.add_(normal(*windows.shape), alpha=self.noise)
        if self.dropout:
            ill = chance(batch, 1, 1, 1) < self.dropout
            signal.mul_(~(ill & (chance(batch, 1, rows, columns) < DEAD_TAXELS)))
        if self.electrode:
            ill = chance(batch, 1, 1, 1) < self.electrode
            which = torch.floor(chance(batch, 1, 1, 1) * (rows + columns))
            row = torch.arange(rows, device=device)[:, None]
            column = torch.arange(columns, device=device)[None, :]
            signal.mul_(~(ill & ((which == row) | (which == rows + column))))
        return signal.add_(1.0)


def _moved(windows: Tensor, mirrored: Tensor, turns: Tensor) -> Tensor:
    """Mirror some windows (batch, window, rows, columns), then turn each by so many quarters."""
    source = _ways(windows.shape[-2], windows.shape[-1]).to(windows.device)
    taken = source[4 * mirrored.long() + turns]
    flat = windows.flatten(2)
    return flat.gather(2, taken[:, None, :].expand_as(flat)).view_as(windows)


def _shifted(windows: Tensor, ways: Tensor, far: int) -> Tensor:
    """Shift each window (batch, window, rows, columns) its own way; what comes in is untouched."""
    source = _places(windows.shape[-2], windows.shape[-1], far).to(windows.device)
    flat = nn.functional.pad(windows.flatten(2), (0, 1), value=1.0)
    taken = source[ways][:, None, :].expand(-1, windows.shape[1], -1)
    return flat.gather(2, taken).view_as(windows)


@lru_cache(maxsize=8)
def _places(rows: int, columns: int, far: int) -> Tensor:
    """Return which taxel each taxel shows, (ways, taxels); one past the last: none.

    Ways go from `far` rows and columns up and to the left to as many down and to the right.
    """
    row, column = torch.arange(rows)[:, None], torch.arange(columns)[None, :]
    ways = []
    for down in range(-far, far + 1):
        for right in range(-far, far + 1):
            y, x = row - down, column - right
            inside = (y >= 0) & (y < rows) & (x >= 0) & (x < columns)
            ways.append(torch.where(inside, y * columns + x, rows * columns).flatten())
    return torch.stack(ways)


@lru_cache(maxsize=8)
def _ways(rows: int, columns: int) -> Tensor:
    """Return which taxel each taxel shows, (8, taxels): turned by quarters, mirrored and turned."""
    taxel = torch.arange(rows * columns).reshape(rows, columns)
    ways = [
        torch.rot90(seen, k if rows == columns or k % 2 == 0 else 0, (0, 1)).flatten()
        for seen in (taxel, taxel.flip(-1))
        for k in range(4)
    ]
    return torch.stack(ways)
