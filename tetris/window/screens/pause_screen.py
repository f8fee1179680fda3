"""The menu over a game that pauses."""

from collections.abc import Callable

from tetris.window.menu import Item, Menu
from tetris.window.screen_stack import ScreenStack
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.screens.play_screen import PlayScreen


def pause_screen(
    stage: ScreenStack,
    game: PlayScreen,
    *,
    reason: str,
    restart: Callable[[], None],
    settings: Callable[[], None],
    leave: Callable[[], None],
) -> MenuScreen:
    """Return the menu; the reason says why the game pauses, "" when the player wanted it."""

    def resume() -> None:
        stage.pop()
        game.resume()

    def build() -> Menu:
        words = stage.look.words
        items = (
            Item(words("menu.resume"), resume),
            Item(words("menu.restart"), restart),
            Item(words("menu.settings"), settings),
            Item(words("menu.leave"), leave),
        )
        return Menu(words("pause.title"), items, notice=reason or stage.notice)

    return MenuScreen(stage, build, behind=game, back=resume)
