"""First page, and the lists that it leads to: the best games of a mode, and the replays."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from tetris.engine.modes import MODES, Mode, Ranking
from tetris.history.high_scores import Entry
from tetris.window.game_session import Saves
from tetris.window.language import Words
from tetris.window.menu import Item, Menu, Row
from tetris.window.screen_stack import ScreenStack
from tetris.window.screens.menu_screen import AttractMode, MenuScreen
from tetris.window.screens.pages import back_item
from tetris.window.settings import stepped
from tetris.window.view import clock

_COLUMNS: Final[Mapping[Ranking, tuple[str, ...]]] = {
    "score": ("place", "score", "lines", "pieces_per_s", "date"),
    "time": ("place", "time", "score", "pieces_per_s", "date"),
    "lines": ("place", "lines", "score", "pieces_per_s", "date"),
}


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


def best_screen(stage: ScreenStack, shelf: Saves, attract: AttractMode) -> MenuScreen:
    """Return the best games, a mode at a time."""
    names = list(MODES)
    place = names.index(chosen_mode(stage).name)

    def turn(step: int) -> None:
        nonlocal place
        place = (place + step) % len(names)

    def build() -> Menu:
        words, name = stage.look.words, names[place]
        entries = shelf.best(name)
        title = words(f"modes.{name}.title")
        items = [Item(words("best.mode"), value=title, step=turn), back_item(stage)]
        table = _table(entries, MODES[name].ranking, words) if entries else [_none(words)]
        return Menu(words("best.title"), items, table, notice=shelf.trouble)

    return MenuScreen(stage, build, attract=attract)


def _none(words: Words) -> Row:
    return Row((words("best.none"),))


def _table(entries: Sequence[Entry], ranking: Ranking, words: Words) -> list[Row]:
    """Return a best list with its headings; the first game stands out."""
    keys = _COLUMNS[ranking]
    rows = [Row(tuple(words(f"best.{key}") for key in keys), quiet=True)]
    for place, entry in enumerate(entries, 1):
        cells = {
            "place": f"{place}",
            "score": f"{entry.score:,}",
            "time": clock(entry.time_s),
            "lines": f"{entry.lines:,}",
            "pieces_per_s": f"{entry.pieces_per_s:.2f}",
            "date": entry.date.split(" ")[0],
        }
        rows.append(Row(tuple(cells[key] for key in keys), marked=place == 1))
    return rows


def replays_screen(
    stage: ScreenStack, shelf: Saves, attract: AttractMode, watch: Callable[[Path], None]
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
