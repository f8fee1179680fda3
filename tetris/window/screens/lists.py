"""Lists to read and to choose from: the best games of a mode, and the replays."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from tetris.modes import MODES
from tetris.window.attract import Attract
from tetris.window.language import Words
from tetris.window.menu import Item, Menu
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.screens.pages import back_item
from tetris.window.shelf import Shelf
from tetris.window.stage import Stage


def best_screen(stage: Stage, shelf: Shelf, attract: Attract) -> MenuScreen:
    """Return the best games, a mode at a time."""

    def build() -> Menu:
        words = stage.look.words
        return Menu(words("best.title"), [back_item(stage)])

    return MenuScreen(stage, build, attract=attract)


def replays_screen(
    stage: Stage, shelf: Shelf, attract: Attract, watch: Callable[[Path], None]
) -> MenuScreen:
    """Return the replays, the newest first; choosing one shows it."""
    paths = shelf.replays()

    def build() -> Menu:
        words = stage.look.words
        items = [
            Item(
                _title(path, words),
                partial(watch, path),
                value=_when(path),
                hint=words("replays.watch_hint"),
            )
            for path in paths
        ]
        notice = stage.notice or ("" if paths else words("replays.none"))
        return Menu(words("replays.title"), [*items, back_item(stage)], notice=notice)

    return MenuScreen(stage, build, attract=attract)


def _title(path: Path, words: Words) -> str:
    """Return the mode that a replay's file name speaks of; a foreign name stays as it is."""
    mode = path.stem.split("_", 2)[-1]
    return words(f"modes.{mode}.title") if mode in MODES else path.stem


def _when(path: Path) -> str:
    """Return day and time as the file name says them, "" for a foreign name."""
    parts = path.stem.split("_", 2)
    if len(parts) < 3 or parts[2] not in MODES:
        return ""
    return f"{parts[0]}  {parts[1][:5].replace('-', ':')}"
