"""Keyboard shortcuts that correct the orb's latest recognition: `that was a twist`.

Ctrl+1 ... 9: it was that gesture, in the order of the panel; Ctrl+0: it was none; Ctrl+backspace:
take the last correction back. The orb learns it while play goes on (docs/teach.md). So Ctrl itself
acts when it comes up.
"""

from collections.abc import Callable
from typing import Final

import pygame

from controller.shared.protocol.messages import Correction, UploadStatus
from host.actions import HELD
from host.ui.naming import said
from tetris.kit import bindings
from tetris.kit.language import Words
from tetris.kit.settings import Settings

SHOWN_S: Final = 6.0  # how long its answer stands below the dome
PATIENCE_S: Final = 60.0  # while it learns
NULL_LABEL: Final = "null"
_CTRL: Final = (pygame.K_LCTRL, pygame.K_RCTRL)
_FIRST: Final = pygame.K_1
_LAST: Final = pygame.K_9


class CorrectionKeys:
    """Sends corrections, words the orb's answers, and holds Ctrl back while it may begin one."""

    def __init__(self, send: Callable[[Correction], object]) -> None:
        self._send = send
        self._told: tuple[str, int] = "", 0
        self._until_s = 0.0
        self._waiting = 0  # code of the Ctrl key that is held back

    def key(
        self, code: int, mod: int, labels: tuple[str, ...], settings: Settings, now_s: float
    ) -> bool:
        """Take a key that goes down; return whether it was a correction, or Ctrl is held back.

        `labels` are the orb's, "null" first. Without any nothing is taken, nor is a Ctrl that the
        game needs to know how long it is down.
        """
        if not labels:
            return False
        if mod & pygame.KMOD_CTRL and self._corrects(code, labels, now_s):
            self._waiting = 0
            return True
        held = bindings.table(HELD.values(), settings.keys).get(code) in HELD.values()
        if code not in _CTRL or held:
            return False
        self._waiting = code
        return True

    def _corrects(self, code: int, labels: tuple[str, ...], now_s: float) -> bool:
        if code == pygame.K_BACKSPACE:
            label = ""
        elif code == pygame.K_0:
            label = NULL_LABEL
        elif not _FIRST <= code <= _LAST:
            return False
        elif (number := code - _FIRST + 1) < len(labels):
            label = labels[number]
        else:
            self._say("dome.correcting.unknown", now_s, SHOWN_S, number)
            return True
        self._send(Correction(label))
        self._say("dome.correcting.sent", now_s, SHOWN_S)
        return True

    def forget(self) -> None:
        """Drop the Ctrl that is held back."""
        self._waiting = 0

    def ctrl(self, released: int | None = None) -> list[pygame.event.Event]:
        """Return the press and release of the Ctrl held back; if `released`, only of that key."""
        if released not in (None, self._waiting):
            return []
        code, self._waiting = self._waiting, 0
        kinds = (pygame.KEYDOWN, pygame.KEYUP) if code else ()
        return [pygame.event.Event(kind, key=code) for kind in kinds]

    def answer(self, message: UploadStatus, now_s: float) -> None:
        """Take the orb's answer."""
        if message.text:
            busy = message.text == "learning"
            self._say(message.text, now_s, PATIENCE_S if busy else SHOWN_S)

    def told(self, now_s: float, words: Words) -> str:
        """Return what is to be shown now, also sentences of the orb; "" nothing."""
        told, number = self._told
        if now_s >= self._until_s or not told:
            return ""
        return words(told, number=number) if number else said(words, words(told))

    def _say(self, told: str, now_s: float, seconds: float, number: int = 0) -> None:
        """Show a key of the language files, or a sentence of the orb."""
        self._told, self._until_s = (told, number), now_s + seconds
