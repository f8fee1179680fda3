"""Tetris in a window of its own: the loop that owns the clock."""

import time
from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import pygame

from tetris.engine.game import Action, Game
from tetris.files import config_folder, data_folder
from tetris.kit import settings as settings_file
from tetris.kit.display import open_window, set_fullscreen, show_icon
from tetris.kit.menu import Item
from tetris.kit.settings import Settings, stepped
from tetris.kit.stage import Screen, Stage
from tetris.kit.theme import DARK
from tetris.window.game_session import Saves
from tetris.window.screen_flow import ScreenFlow, Start
from tetris.window.tiles import Tiles

__all__ = ["App", "Start", "play"]

_SIZE: Final = (1120, 720)  # pixels; fits a small laptop's screen
_ICON: Final = 32  # pixels, of each block of the piece that is the icon
_LOOK_MS: Final = 10  # between two looks for events on an idle page
_FRAMES_HZ: Final = 60
_SETTLE_S: Final = 0.5  # some systems take the focus for a moment from a window that changes
_MOUSE: Final = (pygame.MOUSEMOTION, pygame.MOUSEBUTTONDOWN, pygame.MOUSEWHEEL)


def play(start: Start = Start()) -> Game | None:  # noqa: B008 (frozen)
    """Play until the window is closed, and return the game played last, if there was one.

    Raises:
        DisplayError: There is no display.
    """
    surface = open_window(_SIZE, "Tetris")
    show_icon(surface, Tiles(DARK).preview("T", _ICON))
    app = App(surface, start, config=config_folder(), data=data_folder())
    try:
        clock = pygame.time.Clock()
        began_s = time.monotonic()
        events = pygame.event.get()
        while app.step(time.monotonic() - began_s, events):
            if app.changed is None:
                pygame.display.flip()
            else:
                pygame.display.update(app.changed)
            clock.tick(_FRAMES_HZ)
            events = _next_events(app.frames_hz)
    finally:
        app.close()
        pygame.quit()
    return app.game


def _next_events(frames_hz: int) -> list[pygame.event.Event]:
    """Return what has happened; if nothing has, look again until the screen's next frame.

    `pygame.event.wait` looks a thousand times a second while there may be a game pad.
    """
    wait_ms = round(1000 / frames_hz - 1000 / _FRAMES_HZ)
    while not (events := pygame.event.get()) and wait_ms > 0:
        wait_ms -= pygame.time.wait(min(_LOOK_MS, wait_ms))
    return events


class App:
    """The whole window, without a clock: each frame passes the time.

    Attributes:
        flow: Begins games.
        changed: Where the last picture differs from the one before; None for everywhere.
    """

    def __init__(
        self,
        surface: pygame.Surface,
        start: Start = Start(),  # noqa: B008 (frozen)
        *,
        config: Path | None = None,
        data: Path | None = None,
        sound: bool = True,
        items: Callable[[Stage], Sequence[Item]] | None = None,
    ) -> None:
        """Set up the first screen; without a folder, settings or games are not kept.

        With `items` for its title page, the game is a part of a larger window with an orb: `place`
        changes the part, and the mode chosen for the orb is offered.
        """
        settings, notice = Settings(), ""
        if config is not None:
            settings, notice = settings_file.load(config / settings_file.FILE_NAME)
        self._surface = surface
        self.changed: Sequence[pygame.Rect] | None = None
        self._drawn: Screen | None = None  # the screen that the surface shows
        self.stage = Stage(settings, config, surface.get_rect())
        self.stage.notice = notice
        self._whole = items is None  # whether the surface is the whole window
        if items is not None:
            self.stage.mode_setting = "orb_mode"
            self.stage.further = partial(items, self.stage)
        self.flow = ScreenFlow(self.stage, Saves(data))
        self._fullscreen = False
        self._window: tuple[tuple[int, int], tuple[int, int] | None] = _SIZE, None  # size, place
        self._settled_s = 0.0  # when the window has come to rest after filling the screen
        self.stage.pads.start()
        if sound:
            self.stage.sounds.start()
        self.flow.begin(start)
        self._obey_fullscreen()

    @property
    def game(self) -> Game | None:
        """The game played last; None before the first."""
        return self.flow.game

    @property
    def frames_hz(self) -> int:
        """How often the screen that is seen has something new to show while nothing is pressed."""
        return self.stage.screen.frames_hz if self.stage.screen else _FRAMES_HZ

    def step(self, time_s: float, events: list[pygame.event.Event]) -> bool:
        """Take events, let time pass, draw; return whether the window stays open."""
        stays = self.advance(time_s, events)
        if stays:
            self.draw(time_s)
        return stays

    def advance(self, time_s: float, events: list[pygame.event.Event]) -> bool:
        """Take events and let time pass; return whether the window stays open."""
        stage = self.stage
        stage.time_s = time_s
        for event in events:
            if event.type == pygame.QUIT:
                stage.quit()
            if stage.screen is None:
                return False
            self._take(event, time_s)
        if stage.screen is not None:
            stage.screen.tick(time_s)
        self._obey_fullscreen()
        return stage.screen is not None

    def draw(self, time_s: float) -> None:
        """Draw the screen that is seen, or what of it has changed."""
        screen = self.stage.screen
        assert screen
        if self._whole and screen.pointer is not pygame.mouse.get_visible():
            pygame.mouse.set_visible(screen.pointer)
        self.stage.kept, self._drawn = self._drawn is screen, screen
        self.changed = screen.draw(self._surface, time_s)

    def place(self, surface: pygame.Surface) -> None:
        """Draw into this surface, such as another part of the host window, from now on."""
        self._surface, self._drawn = surface, None
        if surface.get_size() != self.stage.area.size:
            self.stage.resize(surface.get_rect())

    def act(self, action: Action) -> None:
        """Take a command of a controller that gives actions, such as the orb."""
        if self.stage.screen is not None:
            self.stage.screen.act(action, self.stage.time_s)

    def hold(self, held: Collection[Action], repeats: Sequence[Action]) -> None:
        """Take what such a controller holds down, and the repeats that are due."""
        if self.stage.screen is not None:
            self.stage.screen.hold(held, repeats, self.stage.time_s)

    def _take(self, event: pygame.event.Event, time_s: float) -> None:
        stage, screen = self.stage, self.stage.screen
        assert screen
        pads = stage.pads.count
        for name, down in stage.pads.take(event):
            if not stage.screen:
                return
            (stage.screen.press if down else stage.screen.release)(name, time_s)
        if stage.pads.count < pads and stage.screen:
            stage.screen.release_all("pause.pad")
        match event.type:
            case pygame.KEYDOWN if event.key == pygame.K_F11:
                stage.change(stepped(stage.settings, "fullscreen", 1))
            case pygame.KEYDOWN if event.key == pygame.K_F1:
                self.flow.toggle_help()
            case pygame.KEYDOWN:
                screen.press(event.key, time_s)
            case pygame.KEYUP:
                screen.release(event.key, time_s)
            case pygame.WINDOWFOCUSLOST if time_s >= self._settled_s:
                stage.pads.release_all()
                screen.release_all("pause.focus")
            case pygame.VIDEORESIZE | pygame.WINDOWSIZECHANGED if self._whole:
                self.place(pygame.display.get_surface() or self._surface)
            case pygame.WINDOWEXPOSED:
                self._drawn = None
            case kind if kind in _MOUSE:
                screen.mouse(event, time_s)

    def _obey_fullscreen(self) -> None:
        wanted = self.stage.settings.fullscreen
        if wanted is not self._fullscreen and pygame.display.get_surface() is self._surface:
            self._fullscreen = wanted
            if wanted:
                self._window = self._surface.get_size(), pygame.display.get_window_position()
            size, place = self._window
            surface = set_fullscreen(wanted, size)
            if not wanted and place is not None:
                pygame.display.set_window_position(place)
            self.place(surface)
            self._settled_s = self.stage.time_s + _SETTLE_S

    def close(self) -> None:
        """Let go of the devices."""
        self.stage.sounds.stop()
