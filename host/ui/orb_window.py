"""Content of the window of the keyboard and gamepad targets: the orb, and how it is armed."""

from typing import Final

import pygame

from host.ui import sprites
from host.ui.orb_state import OrbState
from host.ui.panel.panel import Panel, Projection
from host.ui.pointer_input import DomeArea
from tetris.kit.look import Look

WINDOW: Final = (390, 720)  # its first size
_STRIP: Final = 96  # design units below the panel
_MARGIN: Final = 12
_LEAST: Final = 0.05  # of the first size; in a smaller window the edges are cut off


class OrbWindow:
    """Draws that window, in the dark theme and in English.

    Attributes:
        drawn: Its last place and size in the surface; empty before the first drawing.
    """

    def __init__(self) -> None:
        self.drawn = pygame.Rect(0, 0, 0, 0)
        self._panel, self._look = Panel(), Look()

    @property
    def projection(self) -> Projection:
        """Rectangle of the dome in the window."""
        return self._panel.projection

    def draw(
        self,
        surface: pygame.Surface,
        now_s: float,
        orb: OrbState,
        dome: DomeArea,
        *,
        armed: bool,
        lines: tuple[str, ...],
    ) -> None:
        """Draw the orb, and below it the state of arming and some lines of text."""
        self.drawn = surface.get_rect()
        palette = self._look.palette
        factor = min(self.drawn.width / WINDOW[0], self.drawn.height / WINDOW[1])
        unit = sprites.SpriteScale(max(_LEAST, factor), palette)
        surface.fill(palette.background)
        page = pygame.Rect(0, 0, unit.px(WINDOW[0]), unit.px(WINDOW[1]))
        page.center = self.drawn.center
        inner = page.inflate(-2 * unit.px(_MARGIN), -2 * unit.px(_MARGIN))
        strip = pygame.Rect(inner.left, 0, inner.width, unit.px(_STRIP))
        strip.bottom = inner.bottom
        inner.height -= strip.height + unit.px(_MARGIN)
        inner.size = max(1, inner.width), max(1, inner.height)
        self._panel.place(inner, dome, gestures=len(orb.labels[1:]))
        self._panel.draw(surface, orb, now_s, self._look)
        unit.card(surface, strip)
        left, top = strip.left + unit.px(18), strip.top + unit.px(12)
        word, colour = ("ARMED", palette.warn) if armed else ("DISARMED", palette.dim)
        surface.blit(unit.text(word, 28, colour), (left, top))
        for line in lines:
            top += unit.px(26)
            shown = unit.text(line, 18, palette.text, strip.width - 2 * unit.px(18))
            surface.blit(shown, (left, top))
