"""Bots in the window: one action at a time, in a game or beside the menus (attract mode)."""

from typing import Final

import pygame

from tetris.bots import greedy
from tetris.bots.greedy import Planner
from tetris.engine.events import Action, Event, Spawned, ToppedOut
from tetris.engine.game import Config, Game, Phase
from tetris.engine.pieces import Piece
from tetris.window.theme_choice import ThemeChoice
from tetris.window.view import GameView

_REST_S: Final = 4.0  # how long its lost game stays on the screen
_ACTION_S: Final = 0.22  # the bot's pace
_LONGEST_S: Final = 0.1  # time that one frame may bring; it stands still while it is not seen
_SEED: Final = 7


class BotPlayer:
    """Plays a game one action at a time, looking at the board before each."""

    def __init__(self, action_s: float, plan: Planner = greedy.plan) -> None:
        """Act every `action_s` seconds, as one of `tetris.bots.registry.BOTS` plans."""
        self._action_s = action_s
        self._plan = plan
        self._next_s = 0.0
        self._target: Piece | None = None

    def actions(self, game: Game, time_s: float) -> list[Action]:
        """Return what to do now: one action or none."""
        if time_s < self._next_s or game.phase is Phase.PAUSED:
            return []
        if game.phase is Phase.OVER:
            self._next_s = time_s + self._action_s
            return [Action.RESTART]
        if not game.in_play:
            return []
        plan = self._plan(game, target=self._target)
        self._target = plan.landing
        self._next_s = time_s + self._action_s
        return [plan.actions[0]]

    def watch(self, events: list[Event]) -> None:
        """Forget the target when a new piece has come."""
        if any(isinstance(event, Spawned) for event in events):
            self._target = None
        if any(isinstance(event, ToppedOut) for event in events):
            self._next_s += _REST_S


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
