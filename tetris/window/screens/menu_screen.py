"""A menu on the screen: beside the bot's game, or as a panel over another screen."""

from collections.abc import Callable, Sequence
from typing import Final

import pygame

from tetris.engine.game import Game
from tetris.window.game_session import BotPlayer
from tetris.window.keys import Code
from tetris.window.menu import OF_CODE, Cursor, Menu, MenuStep, Repeater
from tetris.window.menu_view import MenuView, Spot
from tetris.window.scenery import draw_card, draw_logo
from tetris.window.screen_stack import Screen, ScreenStack
from tetris.window.tiles import ThemeChoice
from tetris.window.view import GameView

_COLUMN: Final = 560  # width of the menu beside the bot's game, design units
_LEAST_BESIDE: Final = 0.45  # of the height: a narrower rest of the window shows no game
_LEFT: Final = 24
_TOP: Final = 56
_LOGO: Final = 150
_PANEL: Final = 520
_VEIL_ALPHA: Final = 150
_ACTION_S: Final = 0.22  # the bot's pace
_LONGEST_S: Final = 0.1  # time that one frame may bring; it stands still while it is not seen
_SEED: Final = 7


class AttractMode:
    """The bot's game and its picture."""

    def __init__(self) -> None:
        self._game = Game(_SEED)
        self._bot = BotPlayer(_ACTION_S)
        self._view: GameView | None = None
        self._area = pygame.Rect(0, 0, 0, 0)
        self._look: ThemeChoice | None = None
        self._time_s = self._seen_s = 0.0

    def tick(self, time_s: float) -> None:
        """Let time pass."""
        self._time_s += min(_LONGEST_S, max(0.0, time_s - self._seen_s))
        self._seen_s = time_s
        events = self._game.update(self._time_s, self._bot.actions(self._game, self._time_s))
        self._bot.watch(events)
        if self._view:
            self._view.show(events)

    def draw(self, surface: pygame.Surface, area: pygame.Rect, look: ThemeChoice) -> None:
        """Draw the game into an area."""
        if self._view is None or self._look is not look or self._area != area:
            self._view = GameView(area, look=look)
            self._look, self._area = look, area.copy()
        self._view.draw(surface, self._game, self._time_s)


class MenuScreen(Screen):
    """Shows a menu, and moves through it by keys, buttons, commands and the mouse."""

    def __init__(
        self,
        stage: ScreenStack,
        build: Callable[[], Menu],
        *,
        attract: AttractMode | None = None,
        behind: Screen | None = None,
        logo: bool = False,
        back: Callable[[], None] | None = None,
        quiet_s: float = 0.0,
    ) -> None:
        """Show a menu.

        Args:
            stage: Where it is seen.
            build: Makes the menu, after every step.
            attract: The bot's game to show beside it.
            behind: The screen over which it is a panel; without one it fills the window.
            logo: Whether the program's name stands above it.
            back: What a step back does; None goes to the screen below.
            quiet_s: For how long input, meant for the game that has just ended, is ignored.
        """
        self._stage, self._build = stage, build
        self._attract, self._behind, self._logo = attract, behind, logo
        self._back = back or stage.pop
        self._open_s = stage.time_s + quiet_s
        self._cursor, self._repeater = Cursor(), Repeater()
        self._view = MenuView(stage.look)
        self._menu = build()

    @property
    def menu(self) -> Menu:
        """The menu as it is now."""
        return self._menu

    @property
    def spots(self) -> Sequence[Spot]:
        """Where the items stand that were drawn last, in the window."""
        return self._view.spots

    @property
    def selected(self) -> int:
        """The number of the chosen item."""
        return min(self._cursor.selected, len(self._menu.items) - 1)

    def nav(self, nav: MenuStep, time_s: float) -> None:
        """Take a step."""
        if time_s < self._open_s:
            return
        if nav is MenuStep.BACK:
            self._stage.sounds.click("back")
            self._back()
            return
        if self._cursor.move(self._menu, nav):
            self._stage.sounds.click("take" if nav is MenuStep.CONFIRM else "move")
        self.rebuild()

    def rebuild(self) -> None:
        """Show the menu as things are now."""
        self._menu = self._build()

    def press(self, code: Code, time_s: float) -> None:
        """Take a key or button by its fixed meaning in menus."""
        nav = OF_CODE.get(code)
        if nav:
            self._repeater.press(nav, time_s)
            self.nav(nav, time_s)

    def release(self, code: Code, time_s: float) -> None:
        """End the repetition of a held direction."""
        self._repeater.release()

    def release_all(self, reason: str) -> None:
        """End the repetition of a held direction."""
        self._repeater.release()

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:
        """Choose the item under the pointer; take it, or turn its value, by a click."""
        match event.type:
            case pygame.MOUSEMOTION | pygame.MOUSEBUTTONDOWN:
                for spot in self._view.spots:
                    if spot.place.collidepoint(event.pos) and spot.number < len(self._menu.items):
                        self._cursor.selected = spot.number
                        if getattr(event, "button", 0) == 1:
                            self._click(event.pos[0] - spot.place.left, spot.place.width, time_s)
                        return
            case pygame.MOUSEWHEEL if event.y:
                self.nav(MenuStep.UP if event.y > 0 else MenuStep.DOWN, time_s)

    def _click(self, x: int, width: int, time_s: float) -> None:
        """Take an item; one with a value goes back where its left half is clicked."""
        item = self._menu.items[self._cursor.selected]
        if item.step and not item.do:
            self.nav(MenuStep.RIGHT if x > 0.72 * width else MenuStep.LEFT, time_s)
        else:
            self.nav(MenuStep.CONFIRM, time_s)

    def refresh(self) -> None:
        """Take over another look."""
        self._view = MenuView(self._stage.look)
        self.rebuild()

    def tick(self, time_s: float) -> None:
        """Let a held direction repeat, and the bot play."""
        self.rebuild()  # a notice may have come, or a pad
        if step := self._repeater.poll(time_s):
            self.nav(step, time_s)
        if self._attract and self._stage.screen is self:
            self._attract.tick(time_s)

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the menu, and what is beside or behind it."""
        if self._behind:
            self._draw_panel(surface, time_s)
        else:
            self._draw_page(surface)

    def _draw_page(self, surface: pygame.Surface) -> None:
        stage, area, unit = self._stage, self._stage.area, self._stage.unit
        surface.fill(stage.look.palette.background)
        column = pygame.Rect(0, 0, round(_COLUMN * unit), area.height - round(_TOP * unit))
        column.topleft = round(_LEFT * unit), round(_TOP * unit)
        beside = pygame.Rect(column.right, 0, area.width - column.right, area.height)
        if self._attract and beside.width >= _LEAST_BESIDE * area.height:
            spare = max(0, beside.width - round(1.05 * area.height)) // 2
            column.left += spare // 2
            beside.left, beside.width = column.right, area.width - column.right - spare // 2
            self._attract.draw(surface, beside, stage.look)
        else:
            column.centerx = area.centerx
        if self._logo:
            logo = pygame.Rect(column.left, column.top, column.width, round(_LOGO * unit))
            draw_logo(surface, logo.inflate(-round(52 * unit), 0), stage.look)
            column.top, column.height = logo.bottom, column.height - logo.height
        self._view.draw(surface, column, self._menu, self.selected, unit)

    def _draw_panel(self, surface: pygame.Surface, time_s: float) -> None:
        assert self._behind
        self._behind.draw(surface, time_s)
        stage, area, unit = self._stage, self._stage.area, self._stage.unit
        veil = pygame.Surface(area.size)
        veil.fill(stage.look.palette.background)
        veil.set_alpha(_VEIL_ALPHA)
        surface.blit(veil, (0, 0))
        height = self._view.height(self._menu, unit) + round(52 * unit)
        panel = pygame.Rect(0, 0, round(_PANEL * unit), min(height, area.height))
        panel.center = area.center
        draw_card(surface, panel, round(16 * unit), stage.look)
        inner = panel.inflate(-round(20 * unit), -round(44 * unit))
        self._view.draw(surface, inner, self._menu, self.selected, unit)
