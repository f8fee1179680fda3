"""Moving about in menus: what keys, pad buttons and the orb's commands mean there.

Six commands are enough: a twist turns through the items like a dial, left and right change
what is chosen, and a drop takes it. Nobody can lock himself out by binding keys anew, because
menus heed fixed keys.
"""

from collections.abc import Mapping
from enum import Enum
from typing import Final

import pygame

from tetris.engine.events import Action
from tetris.window.keys import Code


class Nav(Enum):
    """One step in a menu."""

    UP = "up"
    DOWN = "down"
    LEFT = "left"
    RIGHT = "right"
    CONFIRM = "confirm"
    BACK = "back"


OF_ACTION: Final[Mapping[Action, Nav]] = {
    Action.LEFT: Nav.LEFT,
    Action.RIGHT: Nav.RIGHT,
    Action.DOWN: Nav.DOWN,
    Action.HARD_DROP: Nav.CONFIRM,
    Action.ROTATE_CW: Nav.DOWN,
    Action.ROTATE_CCW: Nav.UP,
    Action.PAUSE: Nav.BACK,
}
"""For controllers that give actions, such as the orb."""

OF_CODE: Final[Mapping[Code, Nav]] = {
    pygame.K_UP: Nav.UP,
    pygame.K_DOWN: Nav.DOWN,
    pygame.K_LEFT: Nav.LEFT,
    pygame.K_RIGHT: Nav.RIGHT,
    pygame.K_RETURN: Nav.CONFIRM,
    pygame.K_KP_ENTER: Nav.CONFIRM,
    pygame.K_SPACE: Nav.CONFIRM,
    pygame.K_ESCAPE: Nav.BACK,
    pygame.K_BACKSPACE: Nav.BACK,
    "pad_up": Nav.UP,
    "pad_down": Nav.DOWN,
    "pad_left": Nav.LEFT,
    "pad_right": Nav.RIGHT,
    "stick_up": Nav.UP,
    "stick_down": Nav.DOWN,
    "stick_left": Nav.LEFT,
    "stick_right": Nav.RIGHT,
    "pad_a": Nav.CONFIRM,
    "pad_start": Nav.CONFIRM,
    "pad_b": Nav.BACK,
    "pad_back": Nav.BACK,
}

_REPEATED: Final = frozenset({Nav.UP, Nav.DOWN, Nav.LEFT, Nav.RIGHT})
_FIRST_S: Final = 0.35  # a held direction repeats after this, and then every
_NEXT_S: Final = 0.09


class Repeater:
    """Repeats a direction that is held, so that a long list needs no drumming."""

    def __init__(self) -> None:
        self._held: Nav | None = None
        self._next_s = 0.0

    def press(self, nav: Nav, time_s: float) -> None:
        """Take note of a press, which acts by itself; the latest direction repeats."""
        self._held = nav if nav in _REPEATED else None
        self._next_s = time_s + _FIRST_S

    def release(self) -> None:
        """Stop."""
        self._held = None

    def poll(self, time_s: float) -> Nav | None:
        """Return a repeat that is due; at most one at a time, so that none pile up."""
        if self._held is None or time_s < self._next_s:
            return None
        self._next_s = time_s + _NEXT_S
        return self._held
