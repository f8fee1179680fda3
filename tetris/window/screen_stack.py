"""The stack of screens, and what all share: settings, look, sounds, pads."""

from pathlib import Path

import pygame

from tetris.window import settings as settings_file
from tetris.window.pads import Pads
from tetris.window.screens.screen import Screen
from tetris.window.settings import Settings
from tetris.window.sounds import Sounds
from tetris.window.theme_choice import ThemeChoice

_HEIGHT = 720  # design units of the window's height
_WIDTH = 860  # and the least of its width


class ScreenStack:
    """Holds the screens, the uppermost of which is active.

    Attributes:
        settings: What the player has chosen.
        look: What everything is drawn with.
        sounds: The audio output.
        pads: The game pads.
        notice: A sentence that the player should read, "" for none.
        area: The window, in pixels.
        time_s: The present time, by the clock of the window.
    """

    def __init__(self, settings: Settings, folder: Path | None, area: pygame.Rect) -> None:
        """Begin without a screen.

        Args:
            settings: What the player has chosen.
            folder: Where settings are kept; None keeps none.
            area: The window.
        """
        self.settings = settings
        self.look = ThemeChoice.chosen(settings)
        self.sounds = Sounds()
        self.sounds.set_volumes(settings)
        self.pads = Pads()
        self.notice = ""
        self.area = area
        self.time_s = 0.0
        self._folder = folder
        self._screens: list[Screen] = []

    @property
    def unit(self) -> float:
        """Pixels in a design unit."""
        return min(self.area.height / _HEIGHT, self.area.width / _WIDTH)

    @property
    def screen(self) -> Screen | None:
        """The screen that is seen; None when the player has left the last one."""
        return self._screens[-1] if self._screens else None

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
            self.notice = settings_file.save(self._folder / settings_file.FILE_NAME, settings)
        self.sounds.set_volumes(settings)
        if _seen(before) != _seen(settings):
            self.look = ThemeChoice.chosen(settings)
            self._refresh()

    def _refresh(self) -> None:
        for screen in self._screens:
            screen.refresh()


def _seen(settings: Settings) -> tuple[object, ...]:
    return (
        settings.theme,
        settings.patterns,
        settings.motion,
        settings.ghost,
        settings.grid,
        settings.language,
    )
