"""Base class of all screens."""

from abc import ABC, abstractmethod

import pygame

from tetris.engine.events import Action
from tetris.window.keys import Code
from tetris.window.menu import OF_ACTION, MenuStep


class Screen(ABC):
    """One thing that the window shows.

    Attributes:
        pointer: Whether the mouse has something to do there, and is seen.
    """

    pointer = True

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
        if step := OF_ACTION.get(action):
            self.nav(step, time_s)

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:  # noqa: B027
        """Take an event of the mouse."""

    def refresh(self) -> None:  # noqa: B027
        """Take over another look, or another size of the window."""

    def tick(self, time_s: float) -> None:  # noqa: B027
        """Let time pass."""

    @abstractmethod
    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the whole window."""
