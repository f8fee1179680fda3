"""Layout of the game and the orb's panel in a window of any size."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import pygame

from host.ui.orb_state import OrbState
from host.ui.panel import Panel
from host.ui.pause_menu import PauseMenu
from host.ui.pointer_input import DomeArea
from tetris.engine.game import Game, Phase
from tetris.window.tiles import ThemeChoice
from tetris.window.view import GameView

DESIGN: Final = (1280, 720)  # the window's first size
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
        left = panel.right + gap
        return cls(pygame.Rect(left, 0, max(1, width - left), height), panel)


class WindowLayout:
    """A game without the application's screens, and the orb's panel, in a window of one size."""

    def __init__(
        self, size: tuple[int, int], look: ThemeChoice, hints: Mapping[Phase, str]
    ) -> None:
        """Lay everything out; hints say what to do when the game pauses or is over."""
        self.size, self.look = size, look
        self.dock = Dock.of(size)
        self.game = GameView(self.dock.game, hints=hints, look=look)
        self.panel = Panel()

    def draw(
        self,
        surface: pygame.Surface,
        game: Game,
        orb: OrbState,
        pad: DomeArea,
        now_s: float,
        reason: str,
        menu: PauseMenu | None,
    ) -> None:
        """Draw the whole window; the reason says why the link made the game pause."""
        surface.fill(self.look.palette.background)
        self.game.draw(surface, game, now_s, reason=reason, words=menu is None)
        self.panel.place(self.dock.panel, pad, gestures=len(orb.labels[1:]))
        self.panel.draw(surface, orb, now_s, self.look)
        if menu:
            menu.draw(surface, self.game.layout.area, self.look)
