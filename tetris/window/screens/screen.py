"""What every screen can be told and asked."""

from abc import ABC, abstractmethod

import pygame

from tetris.events import Action
from tetris.window.keys import Code
from tetris.window.nav import OF_ACTION, Nav


class Screen(ABC):
    """One thing that the window shows."""

    def press(self, code: Code, time_s: float) -> None:  # noqa: B027
        """Take a key or a button that went down."""

    def release(self, code: Code, time_s: float) -> None:  # noqa: B027
        """Take a key or a button that came up."""

    def release_all(self, time_s: float) -> None:  # noqa: B027
        """Take it that the window lost the focus, or a pad went: nothing is held any more."""

    def nav(self, nav: Nav, time_s: float) -> None:  # noqa: B027
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
