"""The small window beside the program that is played: the orb, and whether it is armed."""

from typing import Final

import pygame

from controller.protocol.messages import Message
from host.ui import sprites
from host.ui.orb_state import OrbState
from host.ui.panel import Panel
from host.ui.pointer_input import PointerInput
from tetris.window import theme

SIZE: Final = (390, 720)
_STRIP: Final = 96  # design units below the panel
_MARGIN: Final = 12
_RIGHT_BUTTON: Final = 3
_BUTTONS: Final = (1, _RIGHT_BUTTON)
_LEAST: Final = 0.05  # of the first size; in a smaller window the edges are cut off


class OrbWindow:
    """What is known of the orb, the player's fingers on a virtual one, and their picture.

    Attributes:
        orb: What the panel shows.
        touch: The fingers.
    """

    def __init__(self) -> None:
        """Begin without an orb."""
        self.orb = OrbState()
        self.touch = PointerInput()
        self._panel = Panel()
        self._button = 0
        self._drawn = pygame.Rect(0, 0, 0, 0)

    @property
    def touchable(self) -> bool:
        """Whether the orb is a virtual one that listens."""
        return self.orb.link == "live" and bool(self.orb.welcome and self.orb.welcome.virtual)

    def handle(self, event: pygame.event.Event, now_s: float) -> None:
        """Take an event of the mouse, of a touch screen, or of the focus."""
        if event.type == pygame.WINDOWFOCUSLOST:
            self.touch.lift_all()
        # SDL shows a finger as a mouse too.
        if not self.touchable or not self._drawn or getattr(event, "touch", False):
            return
        to_grid = self._panel.projection.to_grid
        match event.type:
            case pygame.MOUSEBUTTONDOWN if event.button in _BUTTONS:
                pinch = event.button == _RIGHT_BUTTON
                if self.touch.press(*to_grid(*event.pos), now_s, pinch=pinch):
                    self._button = event.button
            case pygame.MOUSEMOTION:
                self.touch.move(*to_grid(*event.pos))
            case pygame.MOUSEBUTTONUP if event.button == self._button:
                self.touch.release()
            case pygame.FINGERDOWN | pygame.FINGERMOTION:
                x, y = event.x * self._drawn.width, event.y * self._drawn.height
                down = event.type == pygame.FINGERDOWN
                self.touch.finger(event.finger_id, *to_grid(x, y), down=down)
            case pygame.FINGERUP:
                self.touch.finger_up(event.finger_id)

    def outgoing(self, now_s: float) -> list[Message]:
        """Return the contacts that a virtual orb has to be told of now, if any."""
        if not self.touchable:
            self.orb.contacts = ()
            return []
        self.orb.contacts = self.touch.contacts(now_s)
        contacts = self.touch.update(now_s)
        return [contacts] if contacts else []

    def draw(
        self, surface: pygame.Surface, now_s: float, *, armed: bool, lines: tuple[str, ...]
    ) -> None:
        """Draw the orb, and below it whether it is armed and what there is to know of it."""
        self._drawn = surface.get_rect()
        factor = min(self._drawn.width / SIZE[0], self._drawn.height / SIZE[1])
        unit = sprites.SpriteScale(max(_LEAST, factor))
        surface.fill(theme.BACKGROUND)
        page = pygame.Rect(0, 0, unit.px(SIZE[0]), unit.px(SIZE[1]))
        page.center = self._drawn.center
        inner = page.inflate(-2 * unit.px(_MARGIN), -2 * unit.px(_MARGIN))
        strip = pygame.Rect(inner.left, 0, inner.width, unit.px(_STRIP))
        strip.bottom = inner.bottom
        inner.height -= strip.height + unit.px(_MARGIN)
        self._panel.place(inner, self.touch.pad)
        self._panel.draw(surface, self.orb, now_s)
        unit.card(surface, strip)
        left, top = strip.left + unit.px(18), strip.top + unit.px(12)
        word, colour = ("ARMED", theme.WARN) if armed else ("DISARMED", theme.TEXT_DIM)
        surface.blit(unit.text(word, 28, colour), (left, top))
        for line in lines:
            top += unit.px(26)
            shown = unit.text(line, 18, theme.TEXT, strip.width - 2 * unit.px(18))
            surface.blit(shown, (left, top))
