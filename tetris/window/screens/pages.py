"""Pages of settings: what can be chosen, and the keys and pad buttons that are bound."""

from collections.abc import Sequence
from functools import partial
from typing import Final

from tetris.kit import bindings, language
from tetris.kit.bindings import Names
from tetris.kit.keys import Code
from tetris.kit.menu import Item, Menu, MenuStep
from tetris.kit.settings import CHOICES, LIMITS, Settings, changed, stepped
from tetris.kit.stage import Stage
from tetris.kit.theme import PALETTES
from tetris.window.screens.menu_screen import AttractMode, MenuScreen

_UNITS: Final = {
    "das_ms": "settings.ms",
    "arr_ms": "settings.ms",
    "guard_ms": "settings.ms",
    "soft_drop": "settings.times",
}
_HANDLING: Final = ("das_ms", "arr_ms", "soft_drop", "initial", "guard_ms", "drop_guard")
_SOUND: Final = ("effects", "clicks", "tones")
_SCREEN: Final = ("theme", "patterns", "motion", "ghost", "grid", "scale", "fullscreen")
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
        items = (
            show("settings.handling", _HANDLING),
            bind("keys"),
            bind("pads", _pads(stage)),
            show("settings.screen", _SCREEN),
            show("settings.sound", _SOUND),
            language_item(stage),
            back_item(stage),
        )
        return Menu(stage.look.words("settings.title"), items, notice=stage.notice)

    stage.push(MenuScreen(stage, build, attract=attract))


def _theme_item(stage: Stage) -> Item:
    words, names = stage.look.words, list(PALETTES)
    place = names.index(stage.settings.theme) if stage.settings.theme in names else 0

    def turn(step: int) -> None:
        stage.change(changed(stage.settings, theme=names[(place + step) % len(names)]))

    present, hint = words(f"themes.{names[place]}"), words("settings.theme_hint")
    return Item(words("settings.theme"), value=present, step=turn, hint=hint)


def language_item(stage: Stage) -> Item:
    """The language, each named in itself."""
    names = ["", *language.names()]
    chosen = stage.settings.language
    present = names.index(chosen) if chosen in names else 0

    def turn(step: int) -> None:
        stage.change(changed(stage.settings, language=names[(present + step) % len(names)]))

    name = names[present]
    own = language.load(name or language.of_system())("language")
    value = own if name else stage.look.words("settings.language_auto", name=own)
    return Item(stage.look.words("settings.language"), value=value, step=turn)


def back_item(stage: Stage) -> Item:
    """The way back, for hands that have no key for it."""
    return Item(stage.look.words("menu.back"), stage.pop)


def _page(stage: Stage, title: str, names: Sequence[str]) -> Menu:
    words = stage.look.words

    def reset() -> None:
        usual = Settings()
        stage.change(changed(stage.settings, **{name: getattr(usual, name) for name in names}))

    items = [_theme_item(stage) if name == "theme" else _item(stage, name) for name in names]
    afresh = Item(words("settings.reset"), reset, hint=words("settings.reset_hint"))
    return Menu(words(title), (*items, afresh, back_item(stage)), notice=stage.notice)


def _item(stage: Stage, name: str) -> Item:
    words, value = stage.look.words, getattr(stage.settings, name)

    def step(direction: int) -> None:
        stage.change(stepped(stage.settings, name, direction))

    share = None
    if name in CHOICES:
        written = words(f"settings.{name}_{value}")
    elif isinstance(value, bool):
        written = words("menu.on" if value else "menu.off")
    elif name in _SOUND or name == "scale":
        written = words("settings.percent", value=value)
        share = value / LIMITS[name][1] if name in _SOUND else None
    elif name == "arr_ms" and value == 0:
        written = words("settings.at_once")
    else:
        written = words(_UNITS[name], value=value)
    hint = words(f"settings.{name}_hint")
    return Item(words(f"settings.{name}"), value=written, step=step, share=share, hint=hint)


def _pads(stage: Stage) -> str:
    count = stage.pads.count
    return stage.look.words("bindings.pads" if count else "bindings.no_pad", count=count)


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
            self._stage.sounds.click("take")
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
        self._stage.change(changed(self._stage.settings, **{self._kind: names}))

    def _stop(self) -> None:
        self._waiting, self._until_s = "", None
        self.rebuild()

    def _page(self) -> Menu:
        words = self._stage.look.words
        usual = getattr(Settings(), self._kind)
        items = [
            *map(self._item, bindings.ACTIONS),
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
            caps=tuple(bindings.caption(name) for name in names),
            step=change,
            hint=words(f"bindings.hint{pad}"),
        )
