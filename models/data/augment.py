"""Data augmentation: symmetries of gestures, drift, noise, and dead taxels.

Symmetries are declared by each gesture, never assumed, and an example is turned or mirrored only
as its own gesture declares: a swipe to the left stays one, while a press beside it is turned. Null
is varied as far as all of them allow, because its windows hold their beginnings and ends.

A hand comes from where its owner sits, so few examples are turned: with all of them turned at
random, networks name fewer frames rightly. Left hands mirror right ones, so half are mirrored.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import torch
from torch import Tensor
from torch.nn import functional

from controller.adapt.examples import TURNS
from controller.bundles.vocabulary import NO_MIRROR, SELF, Vocabulary
from models.data.recipe import Augmentation, UserAugmentation

DEAD_TAXELS: Final = 0.06  # of an example that has some


@dataclass(frozen=True, slots=True)
class Symmetry:
    """Permitted transformations of the examples of each class."""

    # quarter turns counterclockwise that leave it the same gesture, for each class
    turns: tuple[tuple[int, ...], ...]
    # number of the class that its mirror image is, for each; -1 where that is none
    mirror: tuple[int, ...]
    # whether it is the same gesture elsewhere on the sensor, for each; (): none is
    shifts: tuple[bool, ...] = ()

    @classmethod
    def of(cls, vocabulary: Vocabulary, rows: int, columns: int) -> "Symmetry":
        """Return the declared symmetries that the grid permits: quarters need a square."""
        labels = vocabulary.labels
        grid = TURNS["all" if rows == columns else "half"]
        turns = [tuple(k for k in TURNS[e.rotations] if k in grid) for e in vocabulary.entries]
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

    def common(self, classes: Iterable[int]) -> "Symmetry":
        """Return the symmetries that some classes share, as the symmetry of one class."""
        some = list(classes)
        turns = tuple(k for k in range(4) if all(k in self.turns[i] for i in some))
        return Symmetry((turns,), (0 if all(self.mirror[i] == i for i in some) else -1,))

    def sentences(self, labels: Sequence[str]) -> list[str]:
        """Return the transformations, a sentence for each kind."""
        same = [labels[i] for i, image in enumerate(self.mirror) if image == i]
        other = [f"{labels[i]} into {labels[j]}" for i, j in enumerate(self.mirror) if 0 <= j != i]
        words = {"quarters": "all", "halves": "half"}
        kinds = {
            f"turned by {word}": [
                label for label, own in zip(labels, self.turns, strict=True) if own == TURNS[kind]
            ]
            for word, kind in words.items()
        }
        kinds["mirrored"] = same + other
        kinds["shifted"] = [label for label, may in zip(labels, self.shifts, strict=False) if may]
        return [f"{kind}: {', '.join(names)}" for kind, names in kinds.items() if names]


PLAIN: Final = Symmetry(((0,),), (-1,))


def vary_windows(
    how: Augmentation,
    windows: Tensor,
    labels: Tensor,
    symmetry: Symmetry,
    generator: torch.Generator,
) -> tuple[Tensor, Tensor]:
    """Return varied z windows (batch, window, rows, columns) and their labels (batch,)."""
    if how.symmetric:
        mirrored, turns = _symmetries(how, labels, symmetry, generator)
        image = torch.tensor(symmetry.mirror, device=labels.device)[labels]
        labels = torch.where(mirrored, image, labels)
        windows = _moved(windows, mirrored, turns)
    if how.shifted and symmetry.shifts:
        side = 2 * how.shifted + 1
        ways = torch.randint(0, side**2, (len(labels),), generator=generator, device=labels.device)
        may = torch.tensor(symmetry.shifts, device=labels.device)[labels]
        ways = torch.where(may, ways, side**2 // 2)  # the middle one stays where it is
        windows = _shifted(windows, ways, how.shifted)
    return _disturb(how, windows, generator), labels


def vary_images(
    how: Augmentation,
    images: Tensor,
    touches: Tensor,
    symmetry: Symmetry,
    generator: torch.Generator,
) -> tuple[Tensor, Tensor]:
    """Return varied z images (batch, rows, columns) of one class and touches (batch, 2)."""
    columns, rows = images.shape[-1], images.shape[-2]
    images = images.unsqueeze(1)
    if how.symmetric:
        own = torch.zeros(len(images), dtype=torch.long, device=images.device)
        mirrored, turns = _symmetries(how, own, symmetry, generator)
        images = _moved(images, mirrored, turns)
        other = torch.stack([columns - 1 - touches[:, 0], touches[:, 1]], dim=1)
        touches = torch.where(mirrored[:, None], other, touches)
        for turn, height in enumerate((rows, columns, rows)):  # quarters, counterclockwise
            other = torch.stack([height - 1 - touches[:, 1], touches[:, 0]], dim=1)
            touches = torch.where(turns[:, None] > turn, other, touches)
    return _disturb(how, images, generator).squeeze(1), touches


def vary_user_windows(
    how: UserAugmentation, windows: Tensor, images: int, generator: torch.Generator
) -> Tensor:
    """Return varied z windows (batch, images, rows, columns), of one user on another day."""
    signal = _played(how, windows - 1.0, images, generator)
    if how.turned or how.moved or how.wider:
        signal = _placed(how, signal, generator)
    batch, _, rows, columns = signal.shape

    def normal(*shape: int) -> Tensor:
        return torch.randn(*shape, generator=generator, device=signal.device)

    signal = signal * torch.exp(how.firm * normal(batch, 1, 1, 1))
    signal = signal + how.offset * normal(batch, 1, rows, columns)
    return signal + how.noise * normal(*signal.shape) + 1.0


def _symmetries(
    how: Augmentation, labels: Tensor, symmetry: Symmetry, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Draw which examples are mirrored, and by how many quarters each is turned, both (batch,)."""
    batch, device = len(labels), labels.device
    chance = torch.rand(2, batch, generator=generator, device=device)
    image = torch.tensor(symmetry.mirror, device=device)[labels]
    mirrored = (chance[0] < how.mirrored) & (image >= 0)
    labels = torch.where(mirrored, image, labels)
    turns = torch.randint(0, 4, (batch,), generator=generator, device=device)
    allowed = torch.tensor([[k in own for k in range(4)] for own in symmetry.turns])
    may = (chance[1] < how.turned) & allowed.to(device)[labels, turns]
    return mirrored, torch.where(may, turns, 0)


def _disturb(how: Augmentation, windows: Tensor, generator: torch.Generator) -> Tensor:
    """Vary strength, rest and noise of z windows (batch, window, rows, columns); kill taxels."""
    batch, _, rows, columns = windows.shape
    device = windows.device

    def normal(*shape: int) -> Tensor:
        return torch.randn(*shape, generator=generator, device=device)

    def chance(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator, device=device)

    signal = windows - 1.0
    if how.gain:
        signal.mul_(torch.exp(how.gain * normal(batch, 1, 1, 1)))
    if how.offset:
        signal.add_(how.offset * normal(batch, 1, rows, columns))
    if how.noise:
        signal.add_(normal(*windows.shape), alpha=how.noise)
    if how.dropout:
        ill = chance(batch, 1, 1, 1) < how.dropout
        signal.mul_(~(ill & (chance(batch, 1, rows, columns) < DEAD_TAXELS)))
    if how.electrode:
        ill = chance(batch, 1, 1, 1) < how.electrode
        which = torch.floor(chance(batch, 1, 1, 1) * (rows + columns))
        row = torch.arange(rows, device=device)[:, None]
        column = torch.arange(columns, device=device)[None, :]
        signal.mul_(~(ill & ((which == row) | (which == rows + column))))
    return signal.add_(1.0)


def _played(
    how: UserAugmentation, signal: Tensor, images: int, generator: torch.Generator
) -> Tensor:
    """Return the newest images of windows (batch, images or more, rows, columns), sped up."""
    batch, length = signal.shape[:2]
    if not how.tempo or length == images:
        return signal[:, -images:]
    slower = torch.randn(batch, 1, generator=generator, device=signal.device)
    back = torch.arange(images - 1, -1, -1, device=signal.device)
    place = (length - 1 - back * torch.exp(how.tempo * slower)).clamp(0.0, length - 1.0)
    before = place.floor().long().clamp(max=length - 2)
    share = (place - before)[:, :, None, None]
    own = torch.arange(batch, device=signal.device)[:, None]
    return signal[own, before] * (1.0 - share) + signal[own, before + 1] * share


def _placed(how: UserAugmentation, signal: Tensor, generator: torch.Generator) -> Tensor:
    """Return windows (batch, images, rows, columns) as if the dome lay a little otherwise."""
    batch, _, rows, columns = signal.shape
    drawn = torch.randn(4, batch, generator=generator, device=signal.device)
    angle, size = how.turned * drawn[0], torch.exp(how.wider * drawn[1])
    # The grid's coordinates go from -1 to 1 along each axis.
    x = 2.0 * how.moved * drawn[2] / max(1, columns - 1)
    y = 2.0 * how.moved * drawn[3] / max(1, rows - 1)
    cos, sin = size * torch.cos(angle), size * torch.sin(angle)
    way = torch.stack([cos, -sin, x, sin, cos, y], dim=1).view(batch, 2, 3)
    grid = functional.affine_grid(way, [batch, 1, rows, columns], align_corners=True)
    return functional.grid_sample(
        signal, grid, mode="bicubic", padding_mode="border", align_corners=True
    )


def _moved(windows: Tensor, mirrored: Tensor, turns: Tensor) -> Tensor:
    """Mirror some windows (batch, window, rows, columns), then turn each by so many quarters."""
    source = _ways(windows.shape[-2], windows.shape[-1]).to(windows.device)
    taken = source[4 * mirrored.long() + turns]
    flat = windows.flatten(2)
    return flat.gather(2, taken[:, None, :].expand_as(flat)).view_as(windows)


def _shifted(windows: Tensor, ways: Tensor, far: int) -> Tensor:
    """Shift each window (batch, window, rows, columns) its own way; what comes in is untouched."""
    source = _places(windows.shape[-2], windows.shape[-1], far).to(windows.device)
    flat = functional.pad(windows.flatten(2), (0, 1), value=1.0)
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
