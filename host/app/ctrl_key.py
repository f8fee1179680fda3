"""The Ctrl key, which acts when it comes up: it may begin a correction instead."""

from typing import Final

import pygame

from host.actions import HELD
from host.ui.panel.correction_keys import CorrectionKeys
from tetris.kit import bindings
from tetris.kit.settings import Settings

_CTRL: Final = (pygame.K_LCTRL, pygame.K_RCTRL)


class CtrlKey:
    """Holds back a Ctrl until it is clear that it begins no correction."""

    def __init__(self) -> None:
        self._waiting = 0  # code of the key

    def waits(self, code: int, correcting: CorrectionKeys, settings: Settings) -> bool:
        """Hold back a key that was pressed; return whether that is so.

        Not while nothing can be corrected, nor where the game needs to know how long it is down.
        """
        held = bindings.table(HELD.values(), settings.keys).get(code) in HELD.values()
        if code not in _CTRL or not correcting.labels or held:
            return False
        self._waiting = code
        return True

    def forget(self) -> None:
        """Drop the key: it was part of a correction."""
        self._waiting = 0

    def act(self, released: int | None = None) -> list[pygame.event.Event]:
        """Return the press and release of the key held back, or of it only if `released` is it."""
        if released not in (None, self._waiting):
            return []
        code, self._waiting = self._waiting, 0
        kinds = (pygame.KEYDOWN, pygame.KEYUP) if code else ()
        return [pygame.event.Event(kind, key=code) for kind in kinds]
