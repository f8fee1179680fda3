"""Recipe of the user network: like CNN-3D, but varied only as one person varies.

Symmetries are left out: which hand somebody uses, and from where it comes, *is* the person. What
differs from day to day in one person is added instead: how the dome lies under the hand, how firm
and how fast the hand is today, how far the dome is inflated. So the network cannot learn one day's
values by heart.
"""

from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor
from torch.nn import functional

from models.data.recipe import Course

COURSE: Final = Course(
    epochs=0,
    steps=2_400,
    limits=(5, 40),
    batch=128,
    rate=8e-3,
    l2=(1e-4, 1e-4),
    channels=(16, 32),
    hidden=(96, 48),
    patience=0.0,
    keep_best=False,  # nothing is held out from a network that learns from every session
    normalised=True,
)


@dataclass(frozen=True, slots=True)
class Mood:
    """How much an example is varied; deviations of normal distributions.

    Attributes:
        turned: Of the dome under the hand, radians.
        moved: Likewise, grid units along each axis.
        wider: Of the hand's or the dome's size, relative.
        tempo: Of how fast it is made, relative.
        firm: Of the signal's strength, relative.
        offset: Of a constant error of each taxel (rest that is not quite true).
        noise: Of each reading.
    """

    turned: float = 0.14
    moved: float = 0.15
    wider: float = 0.03
    tempo: float = 0.06
    firm: float = 0.08
    offset: float = 0.004
    noise: float = 0.003

    def vary(self, windows: Tensor, images: int, generator: torch.Generator) -> Tensor:
        """Vary windows (batch, images or more, rows, columns); return them of so many images."""
        signal = self._played(windows - 1.0, images, generator)
        if self.turned or self.moved or self.wider:
            signal = self._placed(signal, generator)
        batch, _, rows, columns = signal.shape

        def normal(*shape: int) -> Tensor:
            return torch.randn(*shape, generator=generator, device=signal.device)

        signal = signal * torch.exp(self.firm * normal(batch, 1, 1, 1))
        signal = signal + self.offset * normal(batch, 1, rows, columns)
        return signal + self.noise * normal(*signal.shape) + 1.0

    def _played(self, signal: Tensor, images: int, generator: torch.Generator) -> Tensor:
        """Return the newest images, as if they had been made faster or slower."""
        batch, length = signal.shape[:2]
        if not self.tempo or length == images:
            return signal[:, -images:]
        slower = torch.randn(batch, 1, generator=generator, device=signal.device)
        back = torch.arange(images - 1, -1, -1, device=signal.device)
        place = (length - 1 - back * torch.exp(self.tempo * slower)).clamp(0.0, length - 1.0)
        before = place.floor().long().clamp(max=length - 2)
        share = (place - before)[:, :, None, None]
        own = torch.arange(batch, device=signal.device)[:, None]
        return signal[own, before] * (1.0 - share) + signal[own, before + 1] * share

    def _placed(self, signal: Tensor, generator: torch.Generator) -> Tensor:
        """Return images as if the dome lay a little otherwise."""
        batch, _, rows, columns = signal.shape
        drawn = torch.randn(4, batch, generator=generator, device=signal.device)
        angle, size = self.turned * drawn[0], torch.exp(self.wider * drawn[1])
        # The grid's coordinates go from -1 to 1 along each axis.
        x = 2.0 * self.moved * drawn[2] / max(1, columns - 1)
        y = 2.0 * self.moved * drawn[3] / max(1, rows - 1)
        cos, sin = size * torch.cos(angle), size * torch.sin(angle)
        way = torch.stack(
            [torch.stack([cos, -sin, x], dim=1), torch.stack([sin, cos, y], dim=1)], dim=1
        )
        grid = functional.affine_grid(way, [batch, 1, rows, columns], align_corners=True)
        return functional.grid_sample(
            signal, grid, mode="bicubic", padding_mode="border", align_corners=True
        )


MOOD: Final = Mood()
STEADY: Final = Mood(turned=0.0, moved=0.0, wider=0.0, tempo=0.0, firm=0.0, offset=0.0, noise=0.0)
