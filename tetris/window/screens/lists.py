"""Lists to read and to choose from: the best games of a mode, and the replays."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from tetris.engine.modes import MODES, Ranking
from tetris.history.high_scores import Entry
from tetris.window.bot_player import AttractMode
from tetris.window.figures import clock
from tetris.window.language import Words
from tetris.window.menu import Item, Menu, Row
from tetris.window.saves import Saves
from tetris.window.screen_stack import ScreenStack
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.screens.pages import back_item
from tetris.window.screens.title import chosen_mode

_COLUMNS: Final[Mapping[Ranking, tuple[str, ...]]] = {
    "score": ("place", "score", "lines", "pieces_per_s", "date"),
    "time": ("place", "time", "score", "pieces_per_s", "date"),
    "lines": ("place", "lines", "score", "pieces_per_s", "date"),
}


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
