"""Layout of the game and the orb's panel in a window of any size."""

from dataclasses import dataclass
from typing import Final

import pygame

_BESIDE: Final = 350 / 600  # width of the panel beside the game, as a share of its height
_MOST: Final = 0.36  # of the window's width that it takes
_TALL: Final = 1.05  # height of a window, as a share of its width, with the panel below the game
_BELOW: Final = 0.42  # of the window's height that it takes there
_GAP: Final = 0.012  # round the panel, as a share of the window's shorter side


@dataclass(frozen=True, slots=True)
class Dock:
    """Rectangles of the game and of the orb's panel, pixels."""

    game: pygame.Rect
    panel: pygame.Rect

    @classmethod
    def of(cls, size: tuple[int, int]) -> "Dock":
        """Return the rectangles in a window of (width, height) pixels."""
        width, height = size
        gap = max(2, round(_GAP * min(size)))
        if height >= _TALL * width:
            top = round(height * (1 - _BELOW))
            panel = pygame.Rect(gap, top, max(1, width - 2 * gap), max(1, height - top - gap))
            return cls(pygame.Rect(0, 0, width, top), panel)
        wide = round(min(_MOST * width, _BESIDE * (height - 2 * gap)))
        panel = pygame.Rect(gap, gap, max(1, wide), max(1, height - 2 * gap))
        left = min(panel.right + gap, width - 1)
        return cls(pygame.Rect(left, 0, max(1, width - left), height), panel)

    def side(self, size: tuple[int, int]) -> pygame.Rect:
        """Return the part of a window of `size` that is not the game's."""
        left, bottom = self.game.left, self.game.bottom
        if left:
            return pygame.Rect(0, 0, left, size[1])
        return pygame.Rect(0, bottom, size[0], size[1] - bottom)
