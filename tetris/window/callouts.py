"""Callouts beside the board when a piece locks: "T-spin double", "combo ×3", "+1,200"."""

from collections.abc import Iterable
from typing import Final

import pygame

from tetris.engine import events as happened
from tetris.engine.events import Event
from tetris.window import theme
from tetris.window.layout import Layout
from tetris.window.theme import Colour
from tetris.window.theme_choice import ThemeChoice

_LASTS_S: Final = 1.8
_POP_S: Final = 0.12  # the words come in a little from below
_FADE_FROM: Final = 0.7  # of its time

Line = tuple[str, Colour]


class Callouts:
    """The latest words; new ones take their place."""

    def __init__(self, look: ThemeChoice) -> None:
        self._look = look
        self._lines: list[Line] = []
        self._since_s = 0.0
        self._picture: pygame.Surface | None = None

    def show(self, events: Iterable[Event]) -> None:
        """Show the lines of the events."""
        for event in events:
            match event:
                case happened.Locked():
                    if lines := praise(event, self._look):
                        self._say(event.time_s, lines)
                case happened.LevelUp(level=level):
                    words = self._look.words("callout.level", level=level)
                    fresh = self._lines if self._since_s == event.time_s else []
                    self._say(event.time_s, [*fresh, (words, self._look.palette.good)])
                case happened.Restarted():
                    self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._lines, self._picture = [], None

    def draw(self, surface: pygame.Surface, layout: Layout, time_s: float) -> None:
        """Draw the words while they last."""
        age_s = max(0.0, time_s - self._since_s)
        if not self._lines or age_s >= _LASTS_S:
            self.clear()
            return
        if self._picture is None:
            self._picture = self._draw_words(layout)
        age = age_s / _LASTS_S
        self._picture.set_alpha(round(255 * min(1.0, (1 - age) / (1 - _FADE_FROM))))
        sunk = max(0.0, 1 - age_s / _POP_S) * 0.5 * layout.cell if self._look.motion else 0.0
        surface.blit(self._picture, layout.callout.move(0, round(sunk)))

    def _say(self, time_s: float, lines: list[Line]) -> None:
        self._lines, self._since_s, self._picture = lines, time_s, None

    def _draw_words(self, layout: Layout) -> pygame.Surface:
        box, cell = layout.callout, layout.cell
        picture = pygame.Surface(box.size, pygame.SRCALPHA)
        top = 0
        for row, (words, colour) in enumerate(self._lines):
            size = round(cell * (1.0 if row == 0 else 0.78))
            line = theme.fitted(words, size, colour, box.width)
            picture.blit(line, (0, top))
            top += round(line.get_height() * 0.98)
        return picture


def praise(event: happened.Locked, look: ThemeChoice) -> list[Line]:
    """Return the lines about a lock, the greatest first, each with its colour."""
    clear, palette, words = event.clear, look.palette, look.words
    lines: list[Line] = []
    if clear.perfect:
        lines.append((words("callout.perfect"), palette.good))
    if clear.name:
        grand = clear.difficult or clear.name.endswith("t-spin")
        key = clear.name.replace(" ", "_").replace("-", "_")
        lines.append((words(f"clears.{key}").upper(), palette.accent if grand else palette.text))
    if clear.b2b:
        lines.append((words("callout.b2b"), palette.warn))
    if clear.combo > 0:
        lines.append((words("callout.combo", count=clear.combo), palette.cool))
    if clear.points:
        lines.append((f"+{clear.points:,}", palette.text))
    return lines
