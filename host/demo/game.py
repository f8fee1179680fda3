"""Game of the demo: the orb's commands become actions, and a picture shows game and orb."""

from collections.abc import Sequence
from typing import Final

import pygame

from controller.shared.protocol.messages import Command, State
from host.actions import ACTIONS, HeldGestures
from host.connection.receiver import Connected, Delivered, Received
from host.ui.layout import Dock
from host.ui.orb_state import OrbState
from host.ui.panel.panel import Panel
from host.ui.pointer_input import DomeArea
from tetris.engine.game import Action, Config, Event, Game, Phase
from tetris.kit.look import Look
from tetris.kit.settings import Settings
from tetris.window.view import GameView

# An orb gives about one command a second, and a placement needs up to eight: at level 3 a
# piece falls for 12 s, and what has landed can still be moved by one more gesture.
PACE: Final = Config(gravity_cap=3, lock_delay_s=1.0)
AGAIN_S: Final = 1.0  # a drop meant for the last piece does not start the next game


class DemoGame:
    """A game, and the orb that plays it.

    Attributes:
        game: The engine.
        orb: State of the orb.
    """

    def __init__(self, seed: int) -> None:
        self.game, self.orb = Game(seed, PACE), OrbState()
        self._gestures = HeldGestures(Settings())
        self._pad = DomeArea()
        self._look, self._panel = Look(), Panel()
        self._view: GameView | None = None
        self._dock = Dock.of((1, 1))
        self._now_s = 0.0
        self._running_s = 0.0  # when a game was last running or paused

    def tick(self, now_s: float, received: Sequence[Received]) -> list[Event]:
        """Advance to the present time and play received events, oldest first.

        Return the events of the game. The time is never earlier than before.
        """
        self._now_s = now_s
        events: list[Event] = []
        for item in received:
            self.orb.observe(item, now_s)
            action = self._take(item, now_s)
            events += self._update([action] if action else [])
        events += self._update(self._gestures.poll(now_s))
        if self.game.phase is not Phase.OVER:
            self._running_s = now_s
        self.orb.advance(now_s)
        if self._view:
            self._view.show(events)
        return events

    def _update(self, actions: list[Action]) -> list[Event]:
        lowering = self._gestures.soft_drop(self._now_s)
        return self.game.update(self._now_s, actions, soft_drop=lowering)

    def _take(self, item: Received, now_s: float) -> Action | None:
        match item:
            case Connected(welcome=welcome):
                self._gestures = HeldGestures(Settings(), welcome.rate_hz)
                self._pad = DomeArea(welcome.rows, welcome.columns, welcome.pitch_mm)
            case Delivered(message=State(pressed=pressed)):
                self._gestures.hold(pressed, now_s)
            case Delivered(message=Command(name="drop")) if self.game.phase is Phase.OVER:
                return Action.RESTART if now_s - self._running_s >= AGAIN_S else None
            case Delivered(message=Command(name=name)):
                return ACTIONS.get(name)
        return None

    def draw(self, surface: pygame.Surface) -> None:
        """Draw game and orb as they were at the last tick."""
        dock = Dock.of(surface.get_size())
        if self._view is None or dock != self._dock:
            self._dock, self._view = dock, GameView(dock.game, look=self._look)
        surface.fill(self._look.palette.background)
        self._view.draw(surface, self.game, self._now_s)
        self._panel.place(self._dock.panel, self._pad, gestures=len(self.orb.labels[1:]))
        self._panel.draw(surface, self.orb, self._now_s, self._look)
