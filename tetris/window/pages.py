"""Pages that menus lead to: settings, keys and pad buttons; best games, replays, results."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from tetris.engine.modes import MODES, Ranking, pace_of
from tetris.history.high_scores import Entry
from tetris.history.replay_file import ReplayError, load
from tetris.kit import bindings, language
from tetris.kit.bindings import Code, Names
from tetris.kit.language import Words
from tetris.kit.menu import Item, Menu, MenuStep, Row
from tetris.kit.settings import CHOICES, LIMITS, SECTIONS, Settings, stepped
from tetris.kit.stage import Stage
from tetris.window.game_session import Saves, Session
from tetris.window.menu_screen import AttractMode, MenuScreen
from tetris.window.view import clock, per_second

_WORDING: Final = {  # of numbers
    **dict.fromkeys(("das_ms", "arr_ms", "guard_ms"), "settings.ms"),
    **dict.fromkeys(("scale", *SECTIONS["sound"]), "settings.percent"),
    "soft_drop": "settings.times",
}
_FIXED_KEYS: Final = {"settings.fullscreen": ("F11",), "help.title": ("F1",)}
_COLUMNS: Final[Mapping[Ranking, tuple[str, ...]]] = {
    "score": ("place", "score", "lines", "pieces_per_s", "date"),
    "time": ("place", "time", "score", "pieces_per_s", "date"),
    "lines": ("place", "lines", "score", "pieces_per_s", "date"),
    "pace": ("place", "pace", "lines", "pieces_per_s", "date"),
}
WAIT_S: Final = 5.0  # for a key that never comes, as where there is no keyboard


def open_settings(stage: Stage, attract: AttractMode | None = None) -> None:
    """Show the page from which all settings are reached."""

    def show(title: str, names: Sequence[str]) -> Item:
        page = partial(_page, stage, title, names)
        screen = partial(MenuScreen, stage, page, attract=attract)
        return Item(stage.look.words(title), lambda: stage.push(screen()))

    def bind(kind: str, hint: str = "") -> Item:
        screen = partial(BindingScreen, stage, kind, attract)
        return Item(stage.look.words(f"settings.{kind}"), lambda: stage.push(screen()), hint=hint)

    def build() -> Menu:
        count = stage.pads.count
        pads = stage.look.words("bindings.pads" if count else "bindings.no_pad", count=count)
        items = (
            *control_item(stage),
            show("settings.handling", SECTIONS["handling"]),
            bind("keys"),
            bind("pads", pads),
            show("settings.screen", SECTIONS["screen"][:-1]),
            show("settings.sound", SECTIONS["sound"]),
            _item(stage, "language"),
            back_item(stage),
        )
        return Menu(stage.look.words("settings.title"), items, notice=stage.notice)

    stage.push(MenuScreen(stage, build, attract=attract))


def control_item(stage: Stage) -> list[Item]:
    """Return the choice of how an orb plays, where there is one."""
    if stage.mode_setting != "orb_mode":
        return []
    item, slow = _item(stage, "control"), stage.settings.control == "buttons"
    return [replace(item, hint=stage.look.words("settings.control_slow")) if slow else item]


def back_item(stage: Stage) -> Item:
    """The way back, for hands that have no key for it."""
    return Item(stage.look.words("menu.back"), stage.pop)


def _page(stage: Stage, title: str, names: Sequence[str]) -> Menu:
    words = stage.look.words

    def reset() -> None:
        usual = Settings()
        stage.change(replace(stage.settings, **{name: getattr(usual, name) for name in names}))

    afresh = Item(words("settings.reset"), reset, hint=words("settings.reset_hint"))
    return Menu(
        words(title),
        (*(_item(stage, name) for name in names), afresh, back_item(stage)),
        notice=stage.notice,
    )


def _item(stage: Stage, name: str) -> Item:
    words, value = stage.look.words, getattr(stage.settings, name)

    def step(direction: int) -> None:
        stage.change(stepped(stage.settings, name, direction))

    if name == "language":
        own = language.load(value or language.of_system())("language")
        written = own if value else words("settings.language_auto", name=own)
    elif name.startswith("figure"):
        written = words("bindings.none" if value == "none" else f"over.{value}")
    elif name in CHOICES:
        written = words(f"settings.{name}_{value}")
    elif isinstance(value, bool):
        written = words("menu.on" if value else "menu.off")
    elif name == "arr_ms" and value == 0:
        written = words("settings.at_once")
    else:
        written = words(_WORDING[name], value=value)
    share = value / LIMITS[name][1] if name in SECTIONS["sound"] else None
    hint = words(f"settings.{name}_hint")
    return Item(words(f"settings.{name}"), value=written, step=step, share=share, hint=hint)


class BindingScreen(MenuScreen):
    """Binds the keys ("keys") or the buttons of pads ("pads")."""

    def __init__(self, stage: Stage, kind: str, attract: AttractMode | None = None) -> None:
        self._kind = kind
        self._waiting = ""  # the action that gets the next key
        self._until_s: float | None = None
        super().__init__(stage, self._page, attract=attract)

    def press(self, code: Code, time_s: float) -> None:
        """Bind the key, when one is waited for; else move about."""
        if not self._waiting:
            super().press(code, time_s)
            return
        name = code if isinstance(code, str) else bindings.key_name(code)
        if isinstance(code, str) is (self._kind == "pads") and name:
            self._set(bindings.bound(self._names, self._waiting, name))
            self._stage.sounds.play("menu_take", "clicks")
        self._stop()

    def nav(self, nav: MenuStep, time_s: float) -> None:
        """Move about; a step of another controller ends the waiting."""
        if self._waiting:
            self._stop()
        else:
            super().nav(nav, time_s)

    def tick(self, time_s: float) -> None:
        """Let time pass; the wait for a key has a limit."""
        super().tick(time_s)
        if self._waiting and self._until_s is None:
            self._until_s = time_s + WAIT_S
        if self._until_s is not None and time_s >= self._until_s:
            self._stop()

    @property
    def _names(self) -> Names:
        names: Names = getattr(self._stage.settings, self._kind)
        return names

    def _set(self, names: Names) -> None:
        chosen: dict[str, Any] = {self._kind: names}
        self._stage.change(replace(self._stage.settings, **chosen))

    def _stop(self) -> None:
        self._waiting, self._until_s = "", None
        self.rebuild()

    def _page(self) -> Menu:
        words = self._stage.look.words
        usual = getattr(Settings(), self._kind)
        fixed = _FIXED_KEYS if self._kind == "keys" else {}
        items = [
            *map(self._item, bindings.ACTIONS),
            *(Item(words(key), caps=caps, hint=words("help.mouse")) for key, caps in fixed.items()),
            Item(
                words("settings.reset"),
                lambda: self._set(usual),
                hint=words("settings.reset_hint"),
            ),
            back_item(self._stage),
        ]
        notice = words("bindings.wait", seconds=round(WAIT_S)) if self._waiting else ""
        return Menu(words(f"settings.{self._kind}"), items, notice=notice or self._stage.notice)

    def _item(self, action: str) -> Item:
        words, pad = self._stage.look.words, "_pad" if self._kind == "pads" else ""

        def change(step: int = 1) -> None:
            if step < 0:
                self._set(bindings.unbound(self._names, action))
            else:
                self._waiting = action

        waits = action == self._waiting
        names = () if waits else self._names.get(action, ())
        return Item(
            words(f"actions.{action}"),
            change,
            value=words(f"bindings.press{pad}" if waits else "bindings.none"),
            caps=tuple(bindings.caption(name, words) for name in names),
            step=change,
            hint=words(f"bindings.hint{pad}"),
        )


# -- lists -------------------------------------------------------------------------------------


def best_screen(stage: Stage, saves: Saves, attract: AttractMode, first: str) -> MenuScreen:
    """Return the best games, a mode and start level at a time, beginning with the mode `first`."""
    names = list(MODES)
    place, level = names.index(first), stage.settings.level

    def turn(step: int) -> None:
        nonlocal place
        place = (place + step) % len(names)

    def turn_level(step: int) -> None:
        nonlocal level
        level = stepped(Settings(level=level), "level", step).level

    def build() -> Menu:
        words, name = stage.look.words, names[place]
        start = level if MODES[name].levels else 1
        entries = saves.records.best(name, start)
        title = words(f"modes.{name}.title")
        items = [Item(words("best.mode"), value=title, step=turn)]
        if MODES[name].levels:
            items.append(Item(words("menu.level"), value=str(start), step=turn_level))
        items.append(back_item(stage))
        none = [Row((words("best.none"),))]
        table = _table(entries, MODES[name].ranking, words) if entries else none
        games, won = saves.records.games(name, start)
        played = words("best.games", games=games, won=won) if won < games else ""
        return Menu(
            words("best.title"), items, table, notice=stage.told(saves.records.trouble) or played
        )

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
            "pace": per_second(entry.pace_hz),
            "pieces_per_s": f"{entry.pieces_per_s:.2f}",
            "date": entry.date.split(" ")[0],
        }
        rows.append(Row(tuple(words.number(cells[key]) for key in keys), marked=place == 1))
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
        score, said = replay.outcome.score, words("replays.lines", lines=replay.outcome.lines)
        said = words.number(score, ",") if ranking == "score" else said
        return " · ".join((said, clock(replay.length_s)[:-3], when[5:]))

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
    game = session.game
    values = {
        "score": f"{game.score:,}",
        "time_s": clock(game.time_s),
        "lines": f"{game.lines:,}",
        "level": f"{game.level}",
        "pieces": f"{game.pieces_placed:,}",
        "pieces_per_s": f"{game.pieces_per_s:.2f}",
        "commands_per_piece": f"{session.commands_per_piece:.2f}",
        "grand": f"{session.grand_clears}",
    }
    if game.row_us:
        del values["level"]
        values = {"pace": per_second(pace_of(game.row_us))} | values
    rows = [Row((words(f"over.{name}"), words.number(value))) for name, value in values.items()]
    if session.mode.ranking == "time":
        rows[0], rows[1] = rows[1], rows[0]
    return rows
