"""Draw the pictures of docs/tetris-window.md: every theme, mode and menu.

    python -m tests.benchmarks.tetris_pictures docs/pictures

Needs Pillow, which `[train]` brings, to save them in few colours.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Final

os.environ.update(SDL_VIDEODRIVER="dummy", PYGAME_HIDE_SUPPORT_PROMPT="1", LC_ALL="C")

import pygame
from PIL import Image

from tetris.bots import BOTS
from tetris.engine.modes import MODES
from tetris.kit.display import open_window
from tetris.kit.settings import Settings
from tetris.kit.theme import PALETTES
from tetris.window.app import App, Start
from tetris.window.game_session import Saves, Session
from tetris.window.menu_screen import MenuScreen

SIZE: Final = (1120, 720)
WIDTH: Final = 800  # of the pictures, which keeps them small
COLOURS: Final = 256
FRAME_S: Final = 1 / 60
_ENTER, _DOWN, _BACK = pygame.K_RETURN, pygame.K_DOWN, pygame.K_ESCAPE


class Photographer:
    """Walks through the window and takes pictures."""

    def __init__(self, target: Path, data: Path | None = None, start: Start | None = None) -> None:
        self._target = target
        self._surface = open_window(SIZE, "pictures")
        self.app = App(self._surface, start or Start(), data=data, sound=False)
        self._now_s = 0.0

    def wait(self, seconds: float) -> None:
        until_s = self._now_s + seconds
        while self._now_s < until_s:
            self._now_s += FRAME_S
            self.app.step(self._now_s, [])

    def press(self, *keys: int) -> None:
        """Press keys one after another."""
        for key in keys:
            for kind in (pygame.KEYDOWN, pygame.KEYUP):
                self._now_s += FRAME_S
                self.app.step(self._now_s, [pygame.event.Event(kind, key=key)])
        self.wait(0.1)

    def choose(self, *labels: str) -> None:
        """Take items of menus, one after another."""
        for label in labels:
            screen = self.app.stage.screen
            assert isinstance(screen, MenuScreen)
            number = [item.label for item in screen.menu.items].index(label)
            self.press(*[_DOWN] * ((number - screen.selected) % len(screen.menu.items)), _ENTER)

    def take(self, name: str) -> None:
        height = round(SIZE[1] * WIDTH / SIZE[0])
        picture = pygame.transform.smoothscale(self._surface, (WIDTH, height))
        pixels = Image.frombytes("RGB", (WIDTH, height), pygame.image.tobytes(picture, "RGB"))
        # Rare colours, such as a single block's, are kept as well as frequent ones.
        method = Image.Quantize.MAXCOVERAGE
        few = pixels.quantize(COLOURS, method, kmeans=4, dither=Image.Dither.NONE)
        few.save(self._target / f"tetris-{name}.png", optimize=True)


def play_some(data: Path) -> None:
    """Save games of the bots, so that lists have something in them."""
    saves = Saves(data)
    for mode, seeds in (("sprint", range(1, 7)), ("marathon", range(3))):
        for seed in seeds:
            session = Session.new(MODES[mode], seed, Settings())
            plan, now_s = BOTS["dellacherie"], 0.0
            session.update(now_s)
            while session.game.in_play and session.game.pieces_placed < 120:
                for action in plan(session.game).actions:
                    now_s += 0.08 + 0.01 * seed
                    session.update(now_s, [action])
            saves.keep(session)


def take_all(target: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        data = Path(name)
        play_some(data)
        take_menus(target, data)
    for theme in PALETTES:
        visit = Photographer(target, start=Start(mode="marathon", seed=11, bot="dellacherie"))
        visit.app.stage.change(Settings(theme=theme, patterns=theme == "safe", language="en"))
        visit.wait(27.15)
        visit.take(f"theme-{theme}")
    for mode, seconds in zip(MODES, (19.0, 30.2, 21.0, 16.4, 22.7, 13.1, 3.7, 17.3)):  # noqa: B905
        visit = Photographer(target, start=Start(mode=mode, seed=5, level=4, bot="beam"))
        visit.wait(seconds)
        visit.take(f"mode-{mode}")


def take_menus(target: Path, data: Path) -> None:
    """Take the menus, and a game's pause, end and replay."""
    visit = Photographer(target, data)
    visit.wait(14.0)
    visit.take("title")
    visit.choose("Play", "Best games")
    visit.press(pygame.K_RIGHT, pygame.K_RIGHT)
    visit.take("best")
    visit.press(_BACK)
    visit.choose("Replays")
    visit.take("replays")
    visit.press(_ENTER)
    visit.wait(9.0)
    visit.take("replay")
    visit.press(_BACK, _BACK, _BACK)
    visit.choose("Settings")
    visit.take("settings")
    for page in ("Handling", "Keys", "Game pad", "Screen", "Sound"):
        visit.choose(page)
        visit.take(f"settings-{page.lower().replace('game pad', 'pads')}")
        visit.press(_BACK)
    visit.press(_BACK)
    visit.choose("Play", "Start")
    visit.wait(1.2)
    for column in (3, 0, 2, 1, 3, 2, 0):
        visit.press(*[pygame.K_LEFT] * column, pygame.K_SPACE, *[pygame.K_RIGHT] * column)
    visit.press(pygame.K_p)
    visit.take("pause")
    visit.press(_ENTER)
    for _ in range(40):
        if visit.app.game and visit.app.game.in_play:
            visit.press(pygame.K_SPACE)
    visit.wait(2.0)
    visit.take("over")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the pictures go")
    take_all(parser.parse_args().folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
