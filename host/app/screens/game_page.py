"""Base class of pages with a game: text and items in a column, the game's board beside them."""

from collections.abc import Iterable, Sequence
from typing import Final

import pygame

from host.app.screen import Line, Orb, OrbScreen
from tetris.engine.events import Event
from tetris.engine.game import Game
from tetris.kit.menu import Menu
from tetris.kit.stage import PLAY_HZ, Stage
from tetris.window.effects import sounds_of
from tetris.window.view import Figure, GameView

_LEAST, _MOST = 0.36, 0.5  # of the area's width, for the column
_BOARD: Final = 0.97  # of the area's height, a board's width with what stands beside it
_EDGE: Final = 30  # left of letters and above them, design units like all below


class GamePage(OrbScreen):
    """A page whose game is drawn in the rest of its area.

    Attributes:
        game: The game that is drawn.
    """

    def __init__(self, stage: Stage, orb: Orb, game: Game) -> None:
        """Show a game in the stage; `lines` and `page` say what stands beside it."""
        self.game = game
        self._game_view = GameView(stage.area, look=stage.look, card=bool(self.figures()))
        super().__init__(stage, orb)

    @property
    def frames_hz(self) -> int:
        """As often as a game that is played."""
        return PLAY_HZ

    def lines(self, time_s: float) -> Sequence[Line]:
        """Return the paragraphs of the column, the uppermost first."""
        raise NotImplementedError

    def figures(self) -> Sequence[Figure]:
        """Return the numbers beside the board."""
        return ()

    def show(self, events: Iterable[Event]) -> None:
        """Let what happened in the game be seen and heard."""
        happened = list(events)
        self._game_view.show(happened)
        for sound in sounds_of(happened):
            self._stage.sounds.play(*sound)

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the column and the game."""
        area, unit = self._stage.area, self._stage.unit
        surface.fill(self._stage.look.palette.background)
        wide = min(max(area.width - _BOARD * area.height, _LEAST * area.width), _MOST * area.width)
        column = pygame.Rect(0, 0, round(wide), area.height)
        beside = pygame.Rect(column.right, 0, area.width - column.right, area.height)
        view = self._game_view
        view.place(beside, self._stage.look)
        view.draw(surface, self.game, time_s, figures=self.figures())
        edge = round(_EDGE * unit)
        column.top = max(edge, view.layout.board.top)
        menu = Menu("", self.menu.items)
        high = self._view.height(menu, unit) + len(menu.items)  # a pixel each for rounding
        items = pygame.Rect(0, 0, column.width, high)
        items.bottom = min(area.bottom - edge // 2, view.layout.board.bottom)
        inner = pygame.Rect(edge, column.top, column.width - edge, items.top - column.top)
        self.draw_lines(surface, inner, self.lines(time_s))
        self._view.draw(surface, items, menu, self.selected, unit)
