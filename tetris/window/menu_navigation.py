"""Navigation in menus: what keys, pad buttons and the orb's commands mean there.

Six commands are enough: a twist turns through the items like a dial, left and right change
what is chosen, and a drop takes it. Menus use fixed keys, so
that no binding can lock a player out.
"""

from collections.abc import Mapping
from enum import Enum
from typing import Final

import pygame

from tetris.engine.events import Action
from tetris.window.keys import Code


class MenuStep(Enum):
    """One step in a menu."""

    UP = "up"
    DOWN = "down"
    LEFT = "left"
    RIGHT = "right"
    CONFIRM = "confirm"
    BACK = "back"


OF_ACTION: Final[Mapping[Action, MenuStep]] = {
    Action.LEFT: MenuStep.LEFT,
    Action.RIGHT: MenuStep.RIGHT,
    Action.DOWN: MenuStep.DOWN,
    Action.HARD_DROP: MenuStep.CONFIRM,
    Action.ROTATE_CW: MenuStep.DOWN,
    Action.ROTATE_CCW: MenuStep.UP,
    Action.PAUSE: MenuStep.BACK,
}
"""For controllers that give actions, such as the orb."""

OF_CODE: Final[Mapping[Code, MenuStep]] = {
    pygame.K_UP: MenuStep.UP,
    pygame.K_DOWN: MenuStep.DOWN,
    pygame.K_LEFT: MenuStep.LEFT,
    pygame.K_RIGHT: MenuStep.RIGHT,
    pygame.K_RETURN: MenuStep.CONFIRM,
    pygame.K_KP_ENTER: MenuStep.CONFIRM,
    pygame.K_SPACE: MenuStep.CONFIRM,
    pygame.K_ESCAPE: MenuStep.BACK,
    pygame.K_BACKSPACE: MenuStep.BACK,
    "pad_up": MenuStep.UP,
    "pad_down": MenuStep.DOWN,
    "pad_left": MenuStep.LEFT,
    "pad_right": MenuStep.RIGHT,
    "stick_up": MenuStep.UP,
    "stick_down": MenuStep.DOWN,
    "stick_left": MenuStep.LEFT,
    "stick_right": MenuStep.RIGHT,
    "pad_a": MenuStep.CONFIRM,
    "pad_start": MenuStep.CONFIRM,
    "pad_b": MenuStep.BACK,
    "pad_back": MenuStep.BACK,
}

_REPEATED: Final = frozenset({MenuStep.UP, MenuStep.DOWN, MenuStep.LEFT, MenuStep.RIGHT})
_FIRST_S: Final = 0.35  # a held direction repeats after this, and then every
_NEXT_S: Final = 0.09


class Repeater:
    """Repeats a direction that is held, so that a long list needs no drumming."""

    def __init__(self) -> None:
        self._held: MenuStep | None = None
        self._next_s = 0.0

    def press(self, nav: MenuStep, time_s: float) -> None:
        """Take note of a press, which acts by itself; the latest direction repeats."""
        self._held = nav if nav in _REPEATED else None
        self._next_s = time_s + _FIRST_S

    def release(self) -> None:
        """Stop."""
        self._held = None

    def poll(self, time_s: float) -> MenuStep | None:
        """Return a repeat that is due; at most one at a time, so that none pile up."""
        if self._held is None or time_s < self._next_s:
            return None
        self._next_s = time_s + _NEXT_S
        return self._held
