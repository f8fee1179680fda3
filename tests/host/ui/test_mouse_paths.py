"""A mouse in the window, the virtual orb as a process, its networks, the link, the game.

Nothing is short-circuited: paths of the mouse become contacts, contacts dents, dents
capacitances, and what the networks make of them comes back as commands.
"""

import math
import os
import random
from collections.abc import Callable, Iterator
from contextlib import ExitStack

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import pygame
import pytest

from controller.shared.protocol.messages import Command, Grant, Granted
from host import window_loop as loop
from host.app.application import OrbApp
from host.connection.receiver import Delivered, Lost, Received, Receiver
from host.connection.virtual_orb import VirtualOrbProcess

pytestmark = pytest.mark.slow

SEED = 90_001  # of orb and paths; training used others
EACH = 20
LEFT, RIGHT = 1, 3
WAIT_S = 5.0  # for the answer to one grant


class Player:
    """A mouse that knows where the dome is in the window; time is granted, so nothing waits."""

    def __init__(self, receiver: Receiver) -> None:
        self.target = OrbApp(sound=False)
        self.surface = loop.window(headless=True)
        self.random = random.Random(SEED)
        self.receiver = receiver
        self.ticks = 0

    def play(self, seconds: float) -> list[str]:
        """Let time pass; return the commands that came."""
        commands = []
        for _ in range(round(seconds * 60)):
            for message in self.target.outgoing(self.ticks / 60):
                self.receiver.send(message)
            self.ticks += 1
            until_ms = round(self.ticks * 1000 / 60)
            self.receiver.send(Grant(until_ms))
            received = self.answer()
            self.target.tick(until_ms / 1000, received)
            messages = [item.message for item in received if isinstance(item, Delivered)]
            commands += [m.name for m in messages if isinstance(m, Command)]
        return commands

    def answer(self) -> list[Received]:
        heard: list[Received] = []
        while not any(isinstance(i, Delivered) and isinstance(i.message, Granted) for i in heard):
            self.receiver.wait(WAIT_S)
            news = self.receiver.poll()
            assert news, "the orb did not answer a grant"
            assert not any(isinstance(item, Lost) for item in news)
            heard += news
        return heard

    def mouse(self, kind: int, x: float, y: float, button: int = LEFT) -> None:
        across, down = self.target.panel.projection.to_screen(x, y)
        event = pygame.event.Event(kind, pos=(round(across), round(down)), button=button)
        self.target.handle(event, self.ticks / 60)

    def hold(self, x: float, y: float, seconds: float, button: int = LEFT) -> list[str]:
        self.mouse(pygame.MOUSEBUTTONDOWN, x, y, button)
        commands = self.play(seconds)
        self.mouse(pygame.MOUSEBUTTONUP, x, y, button)
        return commands + self.play(self.random.uniform(0.8, 1.2))

    def press(self, xs: tuple[float, float], ys: tuple[float, float]) -> list[str]:
        place = self.random.uniform(*xs), self.random.uniform(*ys)
        return self.hold(*place, self.random.uniform(0.45, 0.9))

    def pinch(self) -> list[str]:
        place = self.random.uniform(1.2, 2.8), self.random.uniform(1.2, 2.8)
        return self.hold(*place, self.random.uniform(0.7, 1.1), RIGHT)

    def twist(self, sign: int) -> list[str]:
        """Drag round the rim from one of its four sides; +1 is counterclockwise."""
        start = math.radians(self.random.choice((0, 90, 180, 270)) + self.random.uniform(-25, 25))
        turn = math.radians(self.random.uniform(45, 90)) * sign
        steps = round(self.random.uniform(0.6, 1.0) * 60)
        path = [start + turn * step / steps for step in range(steps + 1)]
        points = [(2 + 3.4 * math.cos(angle), 2 + 3.4 * math.sin(angle)) for angle in path]
        self.mouse(pygame.MOUSEBUTTONDOWN, *points[0])
        commands = []
        for point in points[1:]:
            self.mouse(pygame.MOUSEMOTION, *point)
            commands += self.play(1 / 60)
        self.mouse(pygame.MOUSEBUTTONUP, *points[-1])
        return commands + self.play(self.random.uniform(0.8, 1.2))


@pytest.fixture
def player() -> Iterator[Player]:
    with ExitStack() as stack:
        own = VirtualOrbProcess(SEED)
        stack.callback(own.close)
        receiver = Receiver(own.open, token=own.token, granted=True)
        stack.callback(receiver.close)
        receiver.connect()
        player = Player(receiver)
        player.target.draw(player.surface)
        player.play(3.0)  # the orb takes its rest image
        yield player


def test_at_least_95_percent_of_mouse_gestures_become_the_right_command(player: Player) -> None:
    gestures: dict[str, Callable[[], list[str]]] = {
        "left": lambda: player.press((0.0, 1.5), (1.7, 4.0)),
        "right": lambda: player.press((2.5, 4.0), (1.7, 4.0)),
        "down": lambda: player.press((0.5, 3.5), (0.0, 0.9)),
        "drop": player.pinch,
        "rotate_cw": lambda: player.twist(-1),
        "rotate_ccw": lambda: player.twist(1),
    }
    meant = [name for name in gestures for _ in range(EACH)]
    player.random.shuffle(meant)
    understood = [(name, gestures[name]()) for name in meant]
    wrong = [(name, commands) for name, commands in understood if commands != [name]]
    assert len(wrong) <= 0.05 * len(meant), wrong
