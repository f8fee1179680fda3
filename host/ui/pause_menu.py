"""Menu of a paused game; the orb's six commands are enough for it."""

from collections.abc import Callable
from typing import Final

import pygame

from tetris.window.menu import Cursor, Item, Menu, MenuStep
from tetris.window.menu_view import MenuView
from tetris.window.scenery import draw_card
from tetris.window.settings import Settings, stepped
from tetris.window.tiles import ThemeChoice

_SWITCHES: Final = ("patterns", "motion", "ghost", "grid")
_HEIGHT: Final = 720  # the game's, in design units
_PANEL: Final = 470  # the menu's width in them


class PauseMenu:
    """Go on, restart, or change what is seen."""

    def __init__(
        self,
        settings: Callable[[], Settings],
        change: Callable[[Settings], None],
        *,
        resume: Callable[[], None],
        restart: Callable[[], None],
    ) -> None:
        """Offer what the functions do."""
        self._settings, self._change = settings, change
        self._resume, self._restart = resume, restart
        self._cursor = Cursor()
        self._view: MenuView | None = None
        self._look: ThemeChoice | None = None
        self._menu = self._build(ThemeChoice())

    @property
    def menu(self) -> Menu:
        """Items that can be chosen now."""
        return self._menu

    @property
    def selected(self) -> int:
        """The number of the chosen item."""
        return self._cursor.selected

    def open(self) -> None:
        """Begin with the first item."""
        self._cursor = Cursor()

    def nav(self, nav: MenuStep) -> None:
        """Take a step; one back goes on with the game."""
        if nav is MenuStep.BACK:
            self._resume()
        else:
            self._cursor.move(self._menu, nav)
            self._menu = self._build(self._look or ThemeChoice())

    def _build(self, look: ThemeChoice) -> Menu:
        words, settings = look.words, self._settings()
        items = [
            Item(words("menu.resume"), self._resume),
            Item(words("menu.restart"), self._restart),
        ]
        for name in _SWITCHES:
            value = words("menu.on" if getattr(settings, name) else "menu.off")
            hint = words(f"settings.{name}_hint")
            label = words(f"settings.{name}")
            items.append(Item(label, value=value, step=self._stepper(name), hint=hint))
        return Menu(words("pause.title"), items)

    def _stepper(self, name: str) -> Callable[[int], None]:
        return lambda step: self._change(stepped(self._settings(), name, step))

    def draw(self, surface: pygame.Surface, area: pygame.Rect, look: ThemeChoice) -> None:
        """Draw the menu in the middle of the game's area."""
        if self._view is None or self._look is not look:
            self._view, self._look = MenuView(look), look
            self._menu = self._build(look)
        unit = area.height / _HEIGHT
        height = self._view.height(self._menu, unit) + round(40 * unit)
        panel = pygame.Rect(0, 0, round(_PANEL * unit), min(height, area.height))
        panel.center = area.center
        draw_card(surface, panel, round(16 * unit), look)
        inner = panel.inflate(-round(16 * unit), -round(36 * unit))
        self._view.draw(surface, inner, self._menu, self.selected, unit)
