"""A player at the window, on a simulated clock."""

from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from tetris.engine.game import Action
from tetris.kit.display import open_window
from tetris.window.app import App, Start
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import READY_S, PlayScreen

FRAME_S = 1 / 60


class Player:
    """Somebody at the window."""

    def __init__(self, app: App) -> None:
        self.app = app
        self.now_s = 0.0
        self.open = True
        self.wait(FRAME_S)

    def wait(self, seconds: float, *events: pygame.event.Event) -> None:
        until_s, due = self.now_s + seconds, list(events)
        while self.now_s < until_s:
            self.now_s += FRAME_S
            self.open = self.app.step(self.now_s, due)
            due = []

    def key(self, *keys: int) -> None:
        for key in keys:
            self.wait(FRAME_S, pygame.event.Event(pygame.KEYDOWN, key=key))
            self.wait(FRAME_S, pygame.event.Event(pygame.KEYUP, key=key))

    def click(self, at: tuple[int, int]) -> None:
        self.wait(FRAME_S, pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=1, pos=at))

    def orb(self, *actions: Action) -> None:
        for action in actions:
            self.app.act(action)
            self.wait(FRAME_S)

    @property
    def screen(self) -> object:
        return self.app.stage.screen

    @property
    def menu(self) -> MenuScreen:
        assert isinstance(self.screen, MenuScreen)
        return self.screen

    @property
    def game(self) -> PlayScreen:
        assert isinstance(self.screen, PlayScreen)
        return self.screen

    def choose(self, *way: str) -> None:
        """Take items, each on the page to which the one before led."""
        for label in way:
            labels = [item.label for item in self.menu.menu.items]
            while self.menu.selected != labels.index(label):
                self.key(pygame.K_DOWN)
            self.key(pygame.K_RETURN)

    def play(self) -> PlayScreen:
        """Begin a game, and wait until its first piece moves."""
        self.choose("Play", "Start")
        self.wait(READY_S + 0.1)
        return self.game

    def lose(self) -> None:
        while isinstance(self.screen, PlayScreen):
            self.key(pygame.K_SPACE)
            self.wait(0.02)
        self.wait(0.7)


def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[pygame.Surface]:
    """Open a window that nobody sees, and close it again."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("SDL_AUDIODRIVER", "dummy")
    monkeypatch.setenv("LC_ALL", "C")
    yield open_window((1120, 720), "test")
    pygame.quit()


def open_app(
    surface: pygame.Surface,
    start: Start | None = None,
    *,
    config: Path | None = None,
    data: Path | None = None,
) -> Player:
    return Player(App(surface, start or Start(), config=config, data=data, sound=False))
