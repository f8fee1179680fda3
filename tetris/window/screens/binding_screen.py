"""The page on which keys or pad buttons are bound: take an action, press what shall do it."""

from typing import Final

from tetris.window import bindings
from tetris.window.bindings import Names
from tetris.window.bot_player import AttractMode
from tetris.window.keys import Code
from tetris.window.menu import Item, Menu, MenuStep
from tetris.window.screen_stack import ScreenStack
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.settings import Settings, changed

WAIT_S: Final = 5.0  # for a key that never comes, as where there is no keyboard


class BindingScreen(MenuScreen):
    """Binds the keys ("keys") or the buttons of pads ("pads")."""

    def __init__(self, stage: ScreenStack, kind: str, attract: AttractMode | None = None) -> None:
        """Show the bindings of one kind."""
        self._kind = kind
        self._waiting = ""  # the action that gets the next key
        self._until_s: float | None = None
        super().__init__(stage, self._page, attract=attract)

    @property
    def waiting(self) -> bool:
        """Whether the next key or button is bound."""
        return bool(self._waiting)

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
        items = [self._item(action) for action in bindings.ACTIONS]

        def reset() -> None:
            self._set(getattr(Settings(), self._kind))

        items.append(Item(words("settings.reset"), reset, hint=words("settings.reset_hint")))
        items.append(Item(words("menu.back"), self._stage.pop))
        notice = words("bindings.wait", seconds=round(WAIT_S)) if self._waiting else ""
        return Menu(words(f"settings.{self._kind}"), items, notice=notice or self._stage.notice)

    def _item(self, action: str) -> Item:
        words, pad = self._stage.look.words, self._kind == "pads"

        def wait() -> None:
            self._waiting = action

        def less(step: int) -> None:
            if step < 0:
                self._set(bindings.unbound(self._names, action))
            else:
                wait()

        caps = tuple(bindings.caption(name) for name in self._names.get(action, ()))
        value = words("bindings.none")
        if action == self._waiting:
            value, caps = words("bindings.press_pad" if pad else "bindings.press"), ()
        hint = words("bindings.hint_pad" if pad else "bindings.hint")
        return Item(
            words(f"actions.{action}"),
            wait,
            value=value,
            caps=caps,
            step=less,
            hint=hint,
        )
