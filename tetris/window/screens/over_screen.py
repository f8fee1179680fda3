"""The menu after a game: how it went, its place among the best, and what to do next."""

from collections.abc import Callable
from typing import Final

from tetris.window.figures import clock
from tetris.window.menu import Item, Menu, Row
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.screens.play_screen import PlayScreen
from tetris.window.shelf import Kept
from tetris.window.stage import Stage

_QUIET_S: Final = 0.6


def over_screen(
    stage: Stage,
    game: PlayScreen,
    kept: Kept,
    *,
    again: Callable[[], None],
    watch: Callable[[], None],
    leave: Callable[[], None],
) -> MenuScreen:
    """Return the menu over a game that has ended."""

    def build() -> Menu:
        words, played = stage.look.words, game.session.game
        table = [
            Row((words("over.score"), f"{played.score:,}")),
            Row((words("over.time_s"), clock(played.time_s))),
        ]
        items = (
            Item(words("menu.again"), again),
            Item(words("menu.watch"), watch),
            Item(words("menu.leave"), leave),
        )
        return Menu(words("over.lost"), items, table, notice=kept.notice)

    return MenuScreen(stage, build, behind=game, back=leave, quiet_s=_QUIET_S)
