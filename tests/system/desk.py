"""The desk of a scenario: a screen, a home folder and windows."""

import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from .desktop import Screen, VirtualOrb, Window


class Desk:
    """A screen, a home folder, and the windows that a scenario opens.

    Attributes:
        seen: What it measured, by name.
    """

    def __init__(self, screen: Screen, home: Path, stack: ExitStack) -> None:
        self._screen, self.home, self._stack = screen, home, stack
        self.seen: dict[str, float] = {}
        self.window: Window | None = None

    def open(self, *options: str, python: str = sys.executable, introduced: bool = True) -> Window:
        """Open the application, and wait until its orb can be touched."""
        window = Window(self._screen, self.home, options, python)
        self.window = self._stack.enter_context(window)
        window.until(lambda shown: shown["link"] == "live" and shown["ready"], "the orb", 30.0)
        if introduced and "Later" in window.shown["items"]:  # the introduction is offered once
            window.choose("Later")
        return window

    def orb(self) -> VirtualOrb:
        """Start a virtual orb that listens on loopback."""
        return self._stack.enter_context(VirtualOrb(self.home))


Scenario = Callable[[Desk], None]
