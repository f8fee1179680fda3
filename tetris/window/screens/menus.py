"""The first page and the lists that it leads to, and the menus over a game that pauses or ends."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from tetris.engine.game import Finish
from tetris.engine.modes import MODES, Mode, Ranking
from tetris.history.high_scores import Entry
from tetris.history.replay_file import ReplayError, load
from tetris.history.stats import Summary
from tetris.kit import bindings
from tetris.kit.language import Words
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.settings import stepped
from tetris.kit.stage import Stage
from tetris.window.game_session import SavedGame, Saves
from tetris.window.screens.menu_screen import AttractMode, MenuScreen
from tetris.window.screens.pages import back_item
from tetris.window.screens.play_screen import PlayScreen
from tetris.window.view import clock

_QUIET_S: Final = 0.6
_TITLES: Final = {Finish.GOAL: "over.won", Finish.TIME: "over.time"}
_COLUMNS: Final[Mapping[Ranking, tuple[str, ...]]] = {
    "score": ("place", "score", "lines", "pieces_per_s", "date"),
    "time": ("place", "time", "score", "pieces_per_s", "date"),
    "lines": ("place", "lines", "score", "pieces_per_s", "date"),
}
Do = Callable[[], None]


def title_screen(
    stage: Stage, attract: AttractMode, *, play: Do, best: Do, replays: Do, settings: Do
) -> MenuScreen:
    """Return the first page; each argument shows another one."""

    def turn_mode(step: int) -> None:
        names = list(MODES)
        place = names.index(chosen_mode(stage).name) + step
        chosen: dict[str, Any] = {stage.mode_setting: names[place % len(names)]}
        stage.change(replace(stage.settings, **chosen))

    def turn_level(step: int) -> None:
        stage.change(stepped(stage.settings, "level", step))

    def build() -> Menu:
        words, mode = stage.look.words, chosen_mode(stage)
        title, text = words(f"modes.{mode.name}.title"), words(f"modes.{mode.name}.text")
        items = [
            Item(words("menu.play"), play, hint=words("title.play")),
            Item(words("menu.mode"), value=title, step=turn_mode, hint=text),
        ]
        if mode.levels:
            level = str(stage.settings.level)
            items.append(Item(words("menu.level"), value=level, step=turn_level, hint=text))
        items += [
            *stage.further(),
            Item(words("menu.best"), best, hint=words("title.best")),
            Item(words("menu.replays"), replays, hint=words("title.replays")),
            Item(words("menu.settings"), settings, hint=words("title.settings")),
            Item(words("menu.quit"), stage.quit),
        ]
        return Menu("", items, notice=stage.notice)

    # A step back on the first page leaves nothing: a game is closed by choosing so.
    return MenuScreen(stage, build, attract=attract, logo=True, back=lambda: None)


def chosen_mode(stage: Stage) -> Mode:
    """Return the mode of the settings; the first one for a name that is unknown here."""
    return MODES.get(getattr(stage.settings, stage.mode_setting)) or next(iter(MODES.values()))


def best_screen(stage: Stage, saves: Saves, attract: AttractMode) -> MenuScreen:
    """Return the best games, a mode at a time."""
    names = list(MODES)
    place = names.index(chosen_mode(stage).name)

    def turn(step: int) -> None:
        nonlocal place
        place = (place + step) % len(names)

    def build() -> Menu:
        words, name = stage.look.words, names[place]
        entries = saves.best(name)
        title = words(f"modes.{name}.title")
        items = [Item(words("best.mode"), value=title, step=turn), back_item(stage)]
        none = [Row((words("best.none"),))]
        table = _table(entries, MODES[name].ranking, words) if entries else none
        games, won = saves.games(name)
        played = words("best.games", games=games, won=won) if won < games else ""
        return Menu(words("best.title"), items, table, notice=saves.trouble or played)

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


def help_screen(stage: Stage) -> MenuScreen:
    """Return the keys in use; the sentence below has the buttons of pads."""

    def item(action: str) -> Item:
        words, settings = stage.look.words, stage.settings
        caps, buttons = (
            [bindings.caption(name) for name in names.get(action, ())]
            for names in (settings.keys, settings.pads)
        )
        none = words("bindings.none")
        hint = f"{words('settings.pads')}: {', '.join(buttons) or none}"
        return Item(words(f"actions.{action}"), value=none, caps=tuple(caps), hint=hint)

    def build() -> Menu:
        words = stage.look.words
        fixed = [
            Item(words("settings.fullscreen"), caps=("F11",), hint=words("help.mouse")),
            Item(words("help.title"), caps=("F1", "?"), hint=words("help.mouse")),
        ]
        items = (*map(item, bindings.ACTIONS), *fixed, back_item(stage))
        return Menu(words("help.title"), items, notice=stage.notice)

    return MenuScreen(stage, build)


# -- over a game -------------------------------------------------------------------------------


def pause_screen(
    stage: Stage, game: PlayScreen, *, reason: str, restart: Do, settings: Do, leave: Do
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
    stage: Stage,
    game: PlayScreen,
    kept: SavedGame,
    *,
    again: Do,
    watch: Do,
    leave: Do,
) -> MenuScreen:
    """Return the menu over a game that has ended."""
    session = game.session
    summary, result = session.summary, session.game.result

    def build() -> Menu:
        words = stage.look.words
        title = _TITLES.get(result, "over.lost") if isinstance(result, Finish) else "over.lost"
        table = _rows(summary, words, by_time=session.mode.ranking == "time")
        if kept.place:
            best = words("over.best") if kept.place == 1 else words("over.place", place=kept.place)
            table.insert(0, Row((best,), marked=True))
        items = (
            Item(words("menu.again"), again),
            Item(words("menu.watch"), watch),
            Item(words("menu.leave"), leave),
        )
        return Menu(words(title), items, table, notice=kept.notice)

    return MenuScreen(stage, build, behind=game, back=leave, quiet_s=_QUIET_S)


def _rows(summary: Summary, words: Words, *, by_time: bool) -> list[Row]:
    """Return the player's figures, what the mode is about first."""
    percent = round(100 * summary.finesse)
    grand = [n for name, n in summary.clears.items() if name == "tetris" or "t-spin" in name]
    values = {
        "score": f"{summary.score:,}",
        "time_s": clock(summary.time_s),
        "lines": f"{summary.lines:,}",
        "level": f"{summary.level}",
        "pieces": f"{summary.pieces:,}",
        "pieces_per_s": f"{summary.pieces_per_s:.2f}",
        "commands_per_piece": f"{summary.commands_per_piece:.2f}",
        "finesse": words("over.finesse_value", percent=percent, faults=summary.faults),
        "grand": f"{sum(grand)}",
    }
    rows = [Row((words(f"over.{name}"), value)) for name, value in values.items()]
    if by_time:
        rows[0], rows[1] = rows[1], rows[0]
    return rows
