"""Base class of all screens, and their stack with what they share: settings, look, sounds, pads."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

import pygame

from tetris.kit import settings as settings_file
from tetris.kit.bindings import Code
from tetris.kit.menu import OF_ACTION, Item, MenuStep
from tetris.kit.pads import Pads
from tetris.kit.settings import SECTIONS, Look, Settings
from tetris.kit.sounds import Sounds

Action = Any  # a member of the application's enum of actions

_HEIGHT = 720  # design units of the window's height
_WIDTH = 620  # and the least of its width
PLAY_HZ = 60  # frames of a game
ATTRACT_HZ = 30  # of effects beside a menu
IDLE_HZ = 10  # of a menu; an event ends the wait for the next one


class Screen(ABC):
    """One thing that the window shows."""

    @property
    def pointer(self) -> bool:
        """Whether the mouse has something to do there, and is seen."""
        return True

    @property
    def frames_hz(self) -> int:
        """How often there is something new to draw while no key is pressed."""
        return IDLE_HZ

    def press(self, code: Code, time_s: float) -> None:  # noqa: B027
        """Take a key or a button that went down."""

    def release(self, code: Code, time_s: float) -> None:  # noqa: B027
        """Take a key or a button that came up."""

    def release_all(self, reason: str) -> None:  # noqa: B027
        """Take it that nothing is held any more; the reason is a key of the language files."""

    def nav(self, nav: MenuStep, time_s: float) -> None:  # noqa: B027
        """Take a step in a menu."""

    def act(self, action: Action, time_s: float) -> None:
        """Take a command of a controller that gives actions, such as the orb."""
        if step := OF_ACTION.get(action.value):
            self.nav(step, time_s)

    def hold(  # noqa: B027
        self, held: Collection[Action], repeats: Sequence[Action], time_s: float
    ) -> None:
        """Take the actions that such a controller holds down, and the repeats that are due."""

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:  # noqa: B027
        """Take an event of the mouse."""

    def refresh(self) -> None:  # noqa: B027
        """Take over another look, or another size of the window."""

    def tick(self, time_s: float) -> None:  # noqa: B027
        """Let time pass."""

    @abstractmethod
    def draw(self, surface: pygame.Surface, time_s: float) -> Sequence[pygame.Rect] | None:
        """Draw the whole window, or only what changed if the stage has `kept` its last picture.

        Return where it changed; None for everywhere.
        """


class Stage:
    """Holds the screens, the uppermost of which is active, and what they share."""

    def __init__(self, settings: Settings, folder: Path | None, area: pygame.Rect) -> None:
        """Begin without a screen; settings are kept in the folder, if there is one."""
        self.settings = settings
        self.look = Look(settings)
        self.sounds = Sounds()
        self.sounds.set_volumes(settings)
        self.pads = Pads()
        self.notice = ""  # a sentence that the player should read
        self.told: Callable[[str], str] = str  # what is shown of a sentence that is English
        self.area = area  # the window, in pixels
        self.time_s = 0.0  # by the clock of the window
        self.kept = False  # whether the window still shows the last picture of its screen
        self.name = "Tetris"  # title of the first page
        self.mode_setting = "mode"  # name of the setting with the mode that the title page offers
        self.watch: Callable[[Sequence[Any]], None] = lambda events: None  # of each game
        self.further: Callable[[], Sequence[Item]] = tuple  # further items of the title page
        self._folder = folder
        self._screens: list[Screen] = []

    @property
    def unit(self) -> float:
        """Pixels in a design unit."""
        fits = min(self.area.height / _HEIGHT, self.area.width / _WIDTH)
        return fits * self.settings.scale / 100

    @property
    def screen(self) -> Screen | None:
        """The screen that is seen; None when the player has left the last one."""
        return self._screens[-1] if self._screens else None

    def holds(self, screen: Screen | None) -> bool:
        """Whether a screen is the present one, or below it."""
        return screen in self._screens

    def push(self, screen: Screen) -> None:
        """Show a screen on top of the present one."""
        self._screens.append(screen)

    def pop(self) -> None:
        """Go back to the screen below."""
        self._screens.pop()

    def home(self, *screens: Screen) -> None:
        """Leave all screens but the first, and show others on top of it."""
        self._screens[1:] = screens

    def quit(self) -> None:
        """Leave all screens."""
        self._screens.clear()

    def resize(self, area: pygame.Rect) -> None:
        """Take over another size of the window."""
        self.area = area
        self._refresh()

    def change(self, settings: Settings) -> None:
        """Take over what the player has chosen, and keep it."""
        before, self.settings = self.settings, settings
        if self._folder is not None:
            path = self._folder / settings_file.FILE_NAME
            self.notice = self.told(settings_file.save(path, settings))
        self.sounds.set_volumes(settings)
        if any(getattr(before, name) != getattr(settings, name) for name in SECTIONS["screen"]):
            self.look = Look(settings)
            self._refresh()

    def _refresh(self) -> None:
        for screen in self._screens:
            screen.refresh()
