"""Tetris in a window of its own: the loop that owns the clock."""

import time
from typing import Final

import pygame

from tetris import bot
from tetris.engine import Config, Game, Phase
from tetris.events import Action, Event, Spawned, ToppedOut
from tetris.pieces import Piece
from tetris.window import theme
from tetris.window.display import open_window
from tetris.window.keys import Keys
from tetris.window.view import GameView

_SIZE: Final = (760, 720)  # pixels; fits a small laptop's screen
_FRAMES_HZ: Final = 60
_BOT_REST_S: Final = 4.0  # how long its lost game stays on the screen


def play(seed: int, config: Config, *, bot_action_s: float | None = None) -> Game:
    """Play until the window is closed, and return the game.

    Args:
        seed: Which game.
        config: The rules.
        bot_action_s: Seconds between two actions of the bot; None leaves the game to the
            keyboard alone.

    Raises:
        DisplayError: There is no display.
    """
    surface = open_window(_SIZE, "Tetris")
    try:
        return _loop(surface, Game(seed, config), bot_action_s)
    finally:
        pygame.quit()


def _loop(surface: pygame.Surface, game: Game, bot_action_s: float | None) -> Game:
    keys, view, clock = Keys(), GameView(surface.get_rect()), pygame.time.Clock()
    player = None if bot_action_s is None else BotPlayer(bot_action_s)
    start_s = time.monotonic()
    while True:
        now_s = time.monotonic() - start_s
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                return game
            if event.type == pygame.KEYDOWN:
                keys.press(event.key, now_s)
            elif event.type == pygame.KEYUP:
                keys.release(event.key, now_s)
            elif event.type == pygame.WINDOWFOCUSLOST:
                keys.release_all()
            elif event.type == pygame.VIDEORESIZE:
                surface = pygame.display.get_surface() or surface
                view.resize(surface.get_rect())
                surface.fill(theme.BACKGROUND)
        actions = keys.poll(now_s)
        if player:
            actions += player.actions(game, now_s)
        events = game.update(now_s, actions, soft_drop=keys.soft_drop)
        if player:
            player.watch(events)
        view.show(events)
        view.draw(surface, game, now_s)
        pygame.display.flip()
        clock.tick(_FRAMES_HZ)


class BotPlayer:
    """Plays a game one action at a time, looking at the board before each."""

    def __init__(self, action_s: float) -> None:
        """Act every `action_s` seconds."""
        self._action_s = action_s
        self._next_s = 0.0
        self._target: Piece | None = None

    def actions(self, game: Game, time_s: float) -> list[Action]:
        """Return what to do now: one action or none."""
        if time_s < self._next_s or game.phase is Phase.PAUSED:
            return []
        if game.phase is Phase.OVER:
            self._next_s = time_s + self._action_s
            return [Action.RESTART]
        plan = bot.plan(game, target=self._target)
        self._target = plan.landing
        self._next_s = time_s + self._action_s
        return [plan.actions[0]]

    def watch(self, events: list[Event]) -> None:
        """Forget the target when a new piece has come."""
        if any(isinstance(event, Spawned) for event in events):
            self._target = None
        if any(isinstance(event, ToppedOut) for event in events):
            self._next_s += _BOT_REST_S
