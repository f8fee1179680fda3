"""Pages of settings: what can be chosen, and the keys and pad buttons that are bound."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final

from tetris.kit import bindings, language
from tetris.kit.bindings import Names
from tetris.kit.keys import Code
from tetris.kit.menu import Item, Menu, MenuStep
from tetris.kit.settings import CHOICES, LIMITS, SECTIONS, Settings, stepped
from tetris.kit.stage import Stage
from tetris.window.screens.menu_screen import AttractMode, MenuScreen

_WORDING: Final = {  # of numbers
    **dict.fromkeys(("das_ms", "arr_ms", "guard_ms"), "settings.ms"),
    **dict.fromkeys(("scale", *SECTIONS["sound"]), "settings.percent"),
    "soft_drop": "settings.times",
}
_FIXED_KEYS: Final = {"settings.fullscreen": ("F11",), "help.title": ("F1",)}
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
            show("settings.handling", SECTIONS["handling"]),
            bind("keys"),
            bind("pads", _pads(stage)),
            show("settings.screen", SECTIONS["screen"][:-1]),
            show("settings.sound", SECTIONS["sound"]),
            _item(stage, "language"),
            back_item(stage),
        )
        return Menu(stage.look.words("settings.title"), items, notice=stage.notice)

    stage.push(MenuScreen(stage, build, attract=attract))


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
            caps=tuple(bindings.caption(name) for name in names),
            step=change,
            hint=words(f"bindings.hint{pad}"),
        )
