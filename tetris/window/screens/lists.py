"""Lists of best games and replays, and the figures of a game that has ended."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Final

from tetris.engine.modes import MODES, Ranking
from tetris.history.high_scores import Entry
from tetris.history.replay_file import ReplayError, load
from tetris.kit.language import Words
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.stage import Stage
from tetris.window.game_session import Saves, Session
from tetris.window.screens.menu_screen import AttractMode, MenuScreen
from tetris.window.screens.pages import back_item
from tetris.window.view import clock

_COLUMNS: Final[Mapping[Ranking, tuple[str, ...]]] = {
    "score": ("place", "score", "lines", "pieces_per_s", "date"),
    "time": ("place", "time", "score", "pieces_per_s", "date"),
    "lines": ("place", "lines", "score", "pieces_per_s", "date"),
}


def best_screen(stage: Stage, saves: Saves, attract: AttractMode, first: str) -> MenuScreen:
    """Return the best games, a mode at a time, beginning with the mode `first`."""
    names = list(MODES)
    place = names.index(first)

    def turn(step: int) -> None:
        nonlocal place
        place = (place + step) % len(names)

    def build() -> Menu:
        words, name = stage.look.words, names[place]
        entries = saves.records.best(name)
        title = words(f"modes.{name}.title")
        items = [Item(words("best.mode"), value=title, step=turn), back_item(stage)]
        none = [Row((words("best.none"),))]
        table = _table(entries, MODES[name].ranking, words) if entries else none
        games, won = saves.records.games(name)
        played = words("best.games", games=games, won=won) if won < games else ""
        return Menu(words("best.title"), items, table, notice=saves.records.trouble or played)

    return MenuScreen(stage, build, attract=attract)


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
    stage: Stage, saves: Saves, attract: AttractMode, watch: Callable[[Path], None]
) -> MenuScreen:
    """Return the replays, the newest first; choosing one shows it."""
    words = stage.look.words

    @cache
    def about(path: Path) -> str:
        _, when, ranking = _named(path, words)
        try:
            replay = load(path)
        except ReplayError:
            return when
        score, lines = replay.outcome.score, replay.outcome.lines
        figure = f"{score:,}" if ranking == "score" else words("replays.lines", lines=lines)
        return " · ".join((figure, clock(replay.length_s)[:-3], when[5:]))

    def item(path: Path) -> Item:
        title, when, _ = _named(path, words)
        hint = f"{when}  {words('replays.watch_hint')}"
        return Item(title, partial(watch, path), late=partial(about, path), hint=hint)

    paths = saves.replays()
    items = (*map(item, paths), back_item(stage))

    def build() -> Menu:
        notice = stage.notice or ("" if paths else words("replays.none"))
        return Menu(words("replays.title"), items, notice=notice)

    return MenuScreen(stage, build, attract=attract)


def _named(path: Path, words: Words) -> tuple[str, str, Ranking]:
    """Return a replay's title, when it ended, and what its mode is ranked by: its file's name."""
    day, time, name = [*path.stem.split("_", 2), "", ""][:3]
    if name not in MODES:
        return path.stem, "", "score"
    when = f"{day} {time[:5].replace('-', ':')}"
    return words(f"modes.{name}.title"), when, MODES[name].ranking


def result_rows(session: Session, words: Words) -> list[Row]:
    """Return the player's figures, what the mode is about first."""
    game, statistics = session.game, session.statistics
    percent = round(100 * statistics.finesse)
    values = {
        "score": f"{game.score:,}",
        "time_s": clock(game.time_s),
        "lines": f"{game.lines:,}",
        "level": f"{game.level}",
        "pieces": f"{game.pieces_placed:,}",
        "pieces_per_s": f"{game.pieces_per_s:.2f}",
        "commands_per_piece": f"{statistics.commands_per_piece:.2f}",
        "finesse": words("over.finesse_value", percent=percent, faults=statistics.faults),
        "grand": f"{statistics.grand_clears}",
    }
    rows = [Row((words(f"over.{name}"), value)) for name, value in values.items()]
    if session.mode.ranking == "time":
        rows[0], rows[1] = rows[1], rows[0]
    return rows
