"""Keyboard shortcuts that correct the orb's latest recognition: `that was a twist`.

Alt+1 ... 9: it was that gesture, in the order of the panel; Alt+0: it was none; Alt+backspace:
take the last correction back. The orb learns it while play goes on (docs/teach.md).
"""

from collections.abc import Callable
from typing import Final

import pygame

from controller.shared.protocol.messages import Correction, UploadStatus
from host.ui.naming import said
from tetris.kit.language import Words

SHOWN_S: Final = 6.0  # how long its answer stands below the dome
PATIENCE_S: Final = 60.0  # while it learns
NULL_LABEL: Final = "null"
_FIRST: Final = pygame.K_1
_LAST: Final = pygame.K_9


class CorrectionKeys:
    """Sends corrections, and words the orb's answers."""

    def __init__(self, send: Callable[[Correction], object]) -> None:
        self._send = send
        self._told: tuple[str, int] = "", 0
        self._until_s = 0.0

    def key(self, code: int, mod: int, labels: tuple[str, ...], now_s: float) -> bool:
        """Take a key that goes down; return whether it was a correction.

        `labels` are the orb's, "null" first; without any nothing is taken.
        """
        if not mod & pygame.KMOD_ALT or not labels:
            return False
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
