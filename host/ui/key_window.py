"""Small window of the keyboard and gamepad targets: the orb, and the state of arming."""

from typing import Final

import pygame

from host.ui import sprites
from host.ui.orb_state import OrbState
from host.ui.panel import Panel, Projection
from host.ui.pointer_input import DomeArea
from tetris.window import theme

SIZE: Final = (390, 720)
_STRIP: Final = 96  # design units below the panel
_MARGIN: Final = 12
_LEAST: Final = 0.05  # of the first size; in a smaller window the edges are cut off


class OrbWindow:
    """Content of the small window.

    Attributes:
        drawn: Its last place and size in the surface; empty before the first drawing.
    """

    def __init__(self) -> None:
        """Begin without a picture."""
        self.drawn = pygame.Rect(0, 0, 0, 0)
        self._panel = Panel()

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
        factor = min(self.drawn.width / SIZE[0], self.drawn.height / SIZE[1])
        unit = sprites.SpriteScale(max(_LEAST, factor))
        surface.fill(theme.BACKGROUND)
        page = pygame.Rect(0, 0, unit.px(SIZE[0]), unit.px(SIZE[1]))
        page.center = self.drawn.center
        inner = page.inflate(-2 * unit.px(_MARGIN), -2 * unit.px(_MARGIN))
        strip = pygame.Rect(inner.left, 0, inner.width, unit.px(_STRIP))
        strip.bottom = inner.bottom
        inner.height -= strip.height + unit.px(_MARGIN)
        self._panel.place(inner, dome)
        self._panel.draw(surface, orb, now_s)
        unit.card(surface, strip)
        left, top = strip.left + unit.px(18), strip.top + unit.px(12)
        word, colour = ("ARMED", theme.WARN) if armed else ("DISARMED", theme.TEXT_DIM)
        surface.blit(unit.text(word, 28, colour), (left, top))
        for line in lines:
            top += unit.px(26)
            shown = unit.text(line, 18, theme.TEXT, strip.width - 2 * unit.px(18))
            surface.blit(shown, (left, top))
