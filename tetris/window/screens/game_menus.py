"""Menus over a game: while it pauses, and after its end."""

from collections.abc import Callable
from typing import Final

from tetris.engine.game import Finish
from tetris.history.stats import Summary
from tetris.window.game_session import SavedGame
from tetris.window.language import Words
from tetris.window.menu import Item, Menu, Row
from tetris.window.screen_stack import ScreenStack
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.screens.play_screen import PlayScreen
from tetris.window.view import clock

_QUIET_S: Final = 0.6
_TITLES: Final = {Finish.GOAL: "over.won", Finish.TIME: "over.time"}


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


def over_screen(
    stage: ScreenStack,
    game: PlayScreen,
    kept: SavedGame,
    *,
    again: Callable[[], None],
    watch: Callable[[], None],
    leave: Callable[[], None],
) -> MenuScreen:
    """Return the menu over a game that has ended."""
    session = game.session
    summary, result = session.summary, session.game.result

    def build() -> Menu:
        words = stage.look.words
        title = _TITLES.get(result, "over.lost") if isinstance(result, Finish) else "over.lost"
        table = [_place(kept.place, words)] if kept.place else []
        table += _rows(summary, words, by_time=session.mode.ranking == "time")
        items = (
            Item(words("menu.again"), again),
            Item(words("menu.watch"), watch),
            Item(words("menu.leave"), leave),
        )
        return Menu(words(title), items, table, notice=kept.notice)

    return MenuScreen(stage, build, behind=game, back=leave, quiet_s=_QUIET_S)


def _place(place: int, words: Words) -> Row:
    best = words("over.best") if place == 1 else words("over.place", place=place)
    return Row((best,), marked=True)


def _rows(summary: Summary, words: Words, *, by_time: bool) -> list[Row]:
    """Return the player's figures, what the mode is about first."""
    grand = sum(
        count for name, count in summary.clears.items() if name == "tetris" or "t-spin" in name
    )
    finesse = words(
        "over.finesse_value", percent=round(100 * summary.finesse), faults=summary.faults
    )
    rows = [
        Row((words("over.score"), f"{summary.score:,}")),
        Row((words("over.time_s"), clock(summary.time_s))),
        Row((words("over.lines"), f"{summary.lines:,}")),
        Row((words("over.level"), f"{summary.level}")),
        Row((words("over.pieces"), f"{summary.pieces:,}")),
        Row((words("over.pieces_per_s"), f"{summary.pieces_per_s:.2f}")),
        Row((words("over.commands_per_piece"), f"{summary.commands_per_piece:.2f}")),
        Row((words("over.finesse"), finesse)),
        Row((words("over.grand"), f"{grand}")),
    ]
    if by_time:
        rows[0], rows[1] = rows[1], rows[0]
    return rows
