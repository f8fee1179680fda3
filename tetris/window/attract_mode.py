"""Attract mode: a game of the bot beside the menus, which shows at once what a setting changes."""

from typing import Final

import pygame

from tetris.engine.game import Config, Game
from tetris.window.bot_player import BotPlayer
from tetris.window.theme_choice import ThemeChoice
from tetris.window.view import GameView

_ACTION_S: Final = 0.22  # the bot's pace
_LONGEST_S: Final = 0.1  # time that one frame may bring; it stands still while it is not seen
_SEED: Final = 7


class AttractMode:
    """The bot's game and its picture."""

    def __init__(self) -> None:
        self._game = Game(_SEED, Config(start_level=1))
        self._bot = BotPlayer(_ACTION_S)
        self._view: GameView | None = None
        self._area = pygame.Rect(0, 0, 0, 0)
        self._look: ThemeChoice | None = None
        self._time_s = self._seen_s = 0.0

    def tick(self, time_s: float) -> None:
        """Let time pass."""
        self._time_s += min(_LONGEST_S, max(0.0, time_s - self._seen_s))
        self._seen_s = time_s
        events = self._game.update(self._time_s, self._bot.actions(self._game, self._time_s))
        self._bot.watch(events)
        if self._view:
            self._view.show(events)

    def draw(self, surface: pygame.Surface, area: pygame.Rect, look: ThemeChoice) -> None:
        """Draw the game into an area."""
        if self._view is None or self._look is not look or self._area != area:
            self._view = GameView(area, look=look)
            self._look, self._area = look, area.copy()
        self._view.draw(surface, self._game, self._time_s)
