"""A lamp: the window has the colour of the last command, and fades to black in a second."""

from collections.abc import Sequence

import pygame

from orbtouch.plugins import CommandMessage, Delivered, Received, Target, TargetOptions

COLOURS = {"left": "blue", "right": "green", "down": "white", "drop": "red"}
OTHER = "orange"
FADE_S = 1.0


class Lamp(Target):
    """A window of one colour."""

    size = (300, 300)

    def __init__(self) -> None:
        """Begin dark."""
        super().__init__()
        self.colour, self._lit_s, self._now_s = pygame.Color("black"), -FADE_S, 0.0

    def tick(self, now_s: float, received: Sequence[Received] = ()) -> None:
        """Take commands; all other events update the state of the orb."""
        self._now_s = now_s
        for item in received:
            self.observe(item, now_s)
            if isinstance(item, Delivered) and isinstance(item.message, CommandMessage):
                self.colour = pygame.Color(COLOURS.get(item.message.name, OTHER))
                self._lit_s = now_s

    def handle(self, event: pygame.event.Event, now_s: float) -> None:
        """Close the window when asked to."""
        self.closed = self.closed or event.type == pygame.QUIT

    def draw(self, surface: pygame.Surface) -> None:
        """Fill the window."""
        share = min(1.0, max(0.0, (self._now_s - self._lit_s) / FADE_S))
        surface.fill(self.colour.lerp(pygame.Color("black"), share))


def create(options: TargetOptions) -> Lamp:
    """Return the target; `host --target lamp` calls it."""
    return Lamp()
