"""Layout of game, orb and cards in a window of any size."""

from collections.abc import Mapping
from typing import Final

import pygame

from host.ui import side_cards, sprites
from host.ui.orb_state import OrbState
from host.ui.panel import Panel
from host.ui.pause_menu import PauseMenu
from host.ui.pointer_input import DomeArea
from tetris.engine.game import Game, Phase
from tetris.window import theme
from tetris.window.tiles import ThemeChoice
from tetris.window.view import GameView

DESIGN: Final = (1280, 720)  # the window's first size; any other is filled in proportion
_LEAST: Final = 0.05  # of the first size; in a smaller window the edges are cut off
_MARGIN, _LEFT, _RIGHT, _GAP, _TOUCHES = 20, 358, 222, 8, 214  # design units


class WindowLayout:
    """Rectangles of all parts in a window of one size."""

    def __init__(
        self, size: tuple[int, int], look: ThemeChoice, hints: Mapping[Phase, str]
    ) -> None:
        """Lay everything out; hints say what to do when the game pauses or is over."""
        self.size, self.look = size, look
        factor = max(_LEAST, min(size[0] / DESIGN[0], size[1] / DESIGN[1]))
        self.unit = unit = sprites.SpriteScale(factor)
        page = pygame.Rect(0, 0, round(DESIGN[0] * factor), round(DESIGN[1] * factor))
        page.center = size[0] // 2, size[1] // 2
        inner = page.inflate(-2 * unit.px(_MARGIN), 0)
        left, right = unit.px(_LEFT), unit.px(_RIGHT)
        area = pygame.Rect(inner.left + left, page.top + unit.px(6), 0, page.height - unit.px(42))
        area.width = inner.width - left - right
        self.game = GameView(area, hints=hints, look=look)
        # Everything stands on the board's lower edge and hangs from its upper one.
        top, bottom = self.game.layout.board.top, self.game.layout.board.bottom
        self.panel = Panel()
        self.orb = pygame.Rect(inner.left, top, left - unit.px(_GAP), bottom - top)
        column = pygame.Rect(0, top, right - unit.px(_GAP), bottom - top)
        column.right = inner.right
        self.touches = column.copy()
        self.touches.height = unit.px(_TOUCHES)
        self.touches.bottom = bottom
        self.history = column
        self.history.height = self.touches.top - unit.px(2 * _GAP) - top
        self.keys = pygame.Rect(page.left, bottom, page.width, page.bottom - bottom)

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
        surface.fill(theme.BACKGROUND)
        self.game.draw(surface, game, now_s, reason=reason, words=menu is None)
        self.panel.place(self.orb, pad)
        self.panel.draw(surface, orb, now_s)
        side_cards.draw_history(surface, self.history, self.unit, orb, now_s)
        side_cards.draw_touches(surface, self.touches, self.unit, orb)
        side_cards.draw_keys(surface, self.keys, self.unit)
        if menu:
            menu.draw(surface, self.game.layout.area, self.look)
