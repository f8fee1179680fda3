"""A menu on the screen: beside the bot's game, or as a card on the board of a game."""

from collections.abc import Callable, Sequence
from typing import Final

import pygame

from tetris.engine.game import Game
from tetris.kit.bindings import Code, Keys
from tetris.kit.menu import DIRECTIONS, OF_CODE, Menu, MenuStep, step_in
from tetris.kit.menu_view import MenuView, Spot
from tetris.kit.stage import ATTRACT_HZ, IDLE_HZ, Screen, Stage
from tetris.window.game_session import BotPlayer
from tetris.window.play_screen import LEAST_CARD, LONGEST_S, PlayScreen
from tetris.window.scenery import Layout, draw_card
from tetris.window.view import GameView

_COLUMN: Final = 560  # width of the menu beside the bot's game, design units
_LEAST_BESIDE: Final = 0.4  # of the height: a narrower rest of the window shows no game
_EDGE: Final = 30  # of the column, outside of its letters
_TOP: Final = 56
_BOTTOM: Final = 16
_PANEL: Final = 520
_VEIL_ALPHA: Final = 150
_ACTION_S: Final = 0.22  # the bot's pace
_SEED: Final = 7
_STAYS: Final = 0.7  # of an item's height from its middle, to which a pointing finger keeps it
_FIRST_S: Final = 0.35  # a held direction repeats after this, and then every
_NEXT_S: Final = 0.09


class AttractMode:
    """The bot's game and its picture."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._game = stage, Game(_SEED)
        self._bot = BotPlayer(_ACTION_S)
        self._view = GameView(stage.area, look=stage.look)
        self._time_s = self._seen_s = 0.0

    @property
    def lively(self) -> bool:
        """Whether an effect is going on; the bot itself moves a few times a second."""
        return self._view.lively

    def tick(self, time_s: float) -> None:
        """Let time pass."""
        self._time_s += min(LONGEST_S, max(0.0, time_s - self._seen_s))
        self._seen_s = time_s
        events = self._game.update(self._time_s, self._bot.actions(self._game, self._time_s))
        self._bot.watch(events)
        self._view.show(events)

    def draw(self, surface: pygame.Surface, area: pygame.Rect, *, kept: bool) -> list[pygame.Rect]:
        """Draw the game into an area, and return where it changed."""
        self._view.place(area, self._stage.look)
        return self._view.draw(surface, self._game, self._time_s, kept=kept)


class MenuScreen(Screen):
    """Shows a menu, and moves through it by keys, buttons, commands and the mouse.

    Attributes:
        selected: The number of the chosen item.
    """

    def __init__(
        self,
        stage: Stage,
        build: Callable[[], Menu],
        *,
        attract: AttractMode | None = None,
        behind: PlayScreen | None = None,
        back: Callable[[], None] | None = None,
        quiet_s: float = 0.0,
    ) -> None:
        """Show a menu.

        Args:
            stage: Where it is seen.
            build: Makes the menu, after every step.
            attract: The bot's game to show beside it.
            behind: The game on whose board it is a card; without one it fills the window.
            back: What a step back does; None goes to the screen below.
            quiet_s: For how long no input may have come before any is taken, so that presses
                meant for the game that has just ended do nothing.
        """
        self._stage, self._build = stage, build
        self._attract, self._behind = attract, behind
        self._back = back or stage.pop
        self._quiet_s, self._open_s = quiet_s, stage.time_s + quiet_s
        self.selected = 0
        self._keys = Keys(OF_CODE, das_s=_FIRST_S, arr_s=_NEXT_S, shifts=DIRECTIONS)
        self._view = MenuView(stage.look)
        self._backdrop: pygame.Surface | None = None  # what is behind a panel
        self._pictured: object = None  # what was drawn last
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
    def frames_hz(self) -> int:
        """Faster while a direction repeats, and while something flies in the bot's game."""
        held = not self._keys.held.isdisjoint(DIRECTIONS)
        lively = held or (self._attract and self._attract.lively)
        return ATTRACT_HZ if lively else IDLE_HZ

    def nav(self, nav: MenuStep, time_s: float) -> None:
        """Take a step."""
        if time_s < self._open_s:
            self._open_s = time_s + self._quiet_s
            return
        if nav is MenuStep.BACK:
            self._stage.sounds.play("menu_back", "clicks")
            self._back()
            return
        selected = step_in(self._menu, self.selected, nav)
        if selected is not None:
            self.selected = selected
            sound = "menu_take" if nav is MenuStep.CONFIRM else "menu_move"
            self._stage.sounds.play(sound, "clicks")
        self.rebuild()

    def point(self, share: float) -> None:
        """Choose the item at a share of the way from the first to the last."""
        last = len(self._menu.items) - 1
        place = min(max(share, 0.0), 1.0) * last
        if abs(place - self.selected) > _STAYS:  # it does not flicker at the edge of two
            self.selected = round(place)
            self._stage.sounds.play("menu_move", "clicks")
            self.rebuild()

    def rebuild(self) -> None:
        """Show the menu as things are now."""
        self._menu = self._build()
        self.selected = min(self.selected, len(self._menu.items) - 1)

    def press(self, code: Code, time_s: float) -> None:
        """Take a key or button by its fixed meaning in menus."""
        self._keys.release_all()  # another screen may have been told of a release
        self._keys.press(code, time_s)
        self._follow_keys(time_s)

    def _follow_keys(self, time_s: float) -> None:
        for due in self._keys.due(time_s)[:1]:  # none pile up
            self.nav(due.action, time_s)

    def release(self, code: Code, time_s: float) -> None:
        """End the repetition of a held direction."""
        self._keys.release(code, time_s)

    def release_all(self, reason: str) -> None:
        """End the repetition of a held direction."""
        self._keys.release_all()

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:
        """Choose the item under the pointer; take it, or turn its value, by a click."""
        match event.type:
            case pygame.MOUSEBUTTONDOWN if event.button == pygame.BUTTON_RIGHT:
                self.nav(MenuStep.BACK, time_s)
            case pygame.MOUSEBUTTONDOWN if event.button > pygame.BUTTON_RIGHT:
                pass  # the wheel, once more: it goes on from the item that is chosen
            case pygame.MOUSEMOTION | pygame.MOUSEBUTTONDOWN:
                for spot in self._view.spots:
                    if spot.place.collidepoint(event.pos) and spot.number < len(self._menu.items):
                        self.selected = spot.number
                        if getattr(event, "button", 0) == 1:
                            self._click(spot, event.pos, time_s)
                        return
            case pygame.MOUSEWHEEL if event.y:
                self.nav(MenuStep.UP if event.y > 0 else MenuStep.DOWN, time_s)

    def _click(self, spot: Spot, at: tuple[int, int], time_s: float) -> None:
        hit = pygame.Rect(at, (1, 1)).collidelist(spot.arrows)
        steps = {-1: MenuStep.CONFIRM, 0: MenuStep.LEFT, 1: MenuStep.RIGHT}
        self.nav(steps[hit], time_s)

    def refresh(self) -> None:
        """Take over another look."""
        self._view, self._backdrop, self._pictured = MenuView(self._stage.look), None, None
        self.rebuild()

    def tick(self, time_s: float) -> None:
        """Let a held direction repeat, and the bot play."""
        self.rebuild()  # a notice may have come, or a pad
        self._follow_keys(time_s)
        if self._attract and self._stage.screen is self:
            self._attract.tick(time_s)

    def draw(self, surface: pygame.Surface, time_s: float) -> Sequence[pygame.Rect] | None:
        """Draw the menu, and what is beside or behind it."""
        before = self._pictured
        self._pictured = self._menu, [item.step is None for item in self._menu.items], self.selected
        # Pages with a drawing of their own draw over this one: it is drawn whole.
        kept = self._stage.kept and before == self._pictured and type(self).draw is MenuScreen.draw
        if not self._behind:
            return self._draw_page(surface, kept)
        if not kept:
            self._draw_panel(surface, time_s)
        return [] if kept else None

    def _draw_page(self, surface: pygame.Surface, kept: bool) -> Sequence[pygame.Rect] | None:
        stage, area, unit = self._stage, self._stage.area, self._stage.unit
        changed: Sequence[pygame.Rect] = ()
        if not kept:
            surface.fill(stage.look.palette.background)
        column = pygame.Rect(
            0, 0, min(area.width, max(LEAST_CARD, round(_COLUMN * unit))), area.height
        )
        beside = pygame.Rect(column.right, 0, area.width - column.right, area.height)
        column.top, column.centerx = round(_TOP * unit / 2), area.centerx
        if beside.width >= _LEAST_BESIDE * area.height:
            game = self._share_out(column, beside)
            if self._attract:
                changed = self._attract.draw(surface, game, kept=kept)
        if kept:
            return changed
        column.height = area.height - column.top - round(_BOTTOM * unit)
        self._view.draw(surface, column, self._menu, self.selected, unit)
        return None

    def _share_out(self, column: pygame.Rect, beside: pygame.Rect) -> pygame.Rect:
        """Move a column and a game beside it, so that the margins are equal and both begin level.

        Return the area of the game.
        """
        stage = self._stage
        edge = round(_EDGE * stage.unit)  # from the column's end to its letters
        outer = Layout.inside(beside, scale=stage.look.scale).outer
        spare = stage.area.width - (column.width - 2 * edge) - outer.width
        margin = spare // 3
        column.left = margin - edge
        column.top = min(outer.top, round(_TOP * stage.unit))
        right = stage.area.width - margin
        return beside.move(right - outer.right, column.top - outer.top)

    def _draw_panel(self, surface: pygame.Surface, time_s: float) -> None:
        assert self._behind
        stage, area = self._stage, self._stage.area
        if self._backdrop is None:
            self._behind.draw(surface, time_s)
            veil = pygame.Surface(area.size)
            veil.fill(stage.look.palette.background)
            veil.set_alpha(_VEIL_ALPHA)
            surface.blit(veil, (0, 0))
            self._backdrop = surface.copy()
        surface.blit(self._backdrop, (0, 0))
        room = self._behind.room
        panel = pygame.Rect(0, 0, min(room.width, max(LEAST_CARD, round(_PANEL * stage.unit))), 0)
        unit = min(stage.unit, panel.width / _PANEL)
        panel.height = min(self._view.height(self._menu, unit) + round(52 * unit), area.height)
        panel.center = room.center
        panel.clamp_ip(area)
        draw_card(surface, panel, round(16 * unit), stage.look)
        inner = panel.inflate(-round(20 * unit), -round(44 * unit))
        self._view.draw(surface, inner, self._menu, self.selected, unit)
