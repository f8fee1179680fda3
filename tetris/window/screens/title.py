"""The first page: what to play, and the way to everything else."""

from collections.abc import Callable
from dataclasses import replace

from tetris.engine.modes import MODES, Mode
from tetris.window.bot_player import AttractMode
from tetris.window.menu import Item, Menu
from tetris.window.screen_stack import ScreenStack
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.settings import stepped


def title_screen(
    stage: ScreenStack,
    attract: AttractMode,
    *,
    play: Callable[[], None],
    best: Callable[[], None],
    replays: Callable[[], None],
    settings: Callable[[], None],
) -> MenuScreen:
    """Return the page; each argument shows another one."""

    def build() -> Menu:
        words, mode = stage.look.words, chosen_mode(stage)
        items = [
            Item(words("menu.play"), play, hint=words("title.play")),
            Item(
                words("menu.mode"),
                value=words(f"modes.{mode.name}.title"),
                step=lambda step: _turn_mode(stage, step),
                hint=words(f"modes.{mode.name}.text"),
            ),
        ]
        if mode.levels:
            level = Item(
                words("menu.level"),
                value=str(stage.settings.level),
                step=lambda step: stage.change(stepped(stage.settings, "level", step)),
                hint=words(f"modes.{mode.name}.text"),
            )
            items.append(level)
        items += [
            Item(words("menu.best"), best, hint=words("title.best")),
            Item(words("menu.replays"), replays, hint=words("title.replays")),
            Item(words("menu.settings"), settings, hint=words("title.settings")),
            Item(words("menu.quit"), stage.quit),
        ]
        return Menu("", items, notice=stage.notice)

    # A step back on the first page leaves nothing: a game is closed by choosing so.
    return MenuScreen(stage, build, attract=attract, logo=True, back=lambda: None)


def chosen_mode(stage: ScreenStack) -> Mode:
    """Return the mode of the settings; the first one for a name that is unknown here."""
    return MODES.get(stage.settings.mode) or next(iter(MODES.values()))


def _turn_mode(stage: ScreenStack, step: int) -> None:
    names = list(MODES)
    present = names.index(chosen_mode(stage).name)
    name = names[(present + step) % len(names)]
    stage.change(replace(stage.settings, mode=name))
