"""The application in a window of its own, driven by granted time."""

from dataclasses import replace
from pathlib import Path

import pygame

from controller.bundles import vocabulary
from controller.shared.protocol.messages import (
    COMMANDS,
    Command,
    Contacts,
    ContactState,
    Telemetry,
    Welcome,
)
from controller.shared.protocol.teaching import CommandRule, GestureInfo
from host.app.application import OrbApp
from host.connection.receiver import Connected, Delivered, Received
from host.targets import SIZE
from tests.support.rise import Rise
from tetris.engine.game import Game, Phase
from tetris.window.app import Start
from tetris.window.play_screen import PlayScreen

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
WELCOME = Welcome(1, 7, "virtual-1", "OrbTouch", True, 5, 5, 10.0, 40.0, 100, 300, LABELS, COMMANDS)
FELT = Delivered(Telemetry(1, bytes([128] * 25), (1.0, 0, 0, 0, 0), None, "", True, 40.0), 0)
FRAME_S = 1 / 60
ORB_FRAME_S = 1 / 40
READY_S = 1.0  # after which the first piece can be moved


def said(name: str) -> Delivered:
    return Delivered(Command(name, "press", 0.99, None, 1), 0)


def shipped_gestures() -> tuple[GestureInfo, ...]:
    """Return the shipped gestures as an orb describes them; their images are unknown."""
    book = vocabulary.shipped()
    found = []
    for entry in book.entries:
        rules = book.mapping.rules.get(entry.label, ())
        copies = (
            CommandRule(one.command, one.left_of, one.right_of, one.below, one.above)
            for one in rules
        )
        found.append(GestureInfo(entry.label, entry.say, False, 0, b"", tuple(copies)))
    return tuple(found)


class Window:
    """The application in a window of its own, and a clock."""

    def __init__(
        self,
        start: Start = Start(),  # noqa: B008
        config: Path | None = None,
        welcome: Welcome | None = WELCOME,
        size: tuple[int, int] = SIZE,
    ) -> None:
        self.app = OrbApp(start, config=config, sound=False)
        self.surface = pygame.Surface(size)
        self.now_s = 0.0
        described = [Delivered(gesture, 0) for gesture in shipped_gestures()]
        begun: list[Received] = [Connected(welcome), *described] if welcome else []
        self.pass_s(0.0, *begun)

    def pass_s(self, seconds: float, *received: Received) -> None:
        """Let time pass, with a picture every 60th of a second."""
        until_s, items = self.now_s + seconds, list(received)
        while True:
            self.app.tick(self.now_s, items)
            self.app.draw(self.surface)
            items = []
            if self.now_s >= until_s:
                return
            self.now_s += FRAME_S

    def key(self, *codes: int) -> None:
        """Press keys one after the other, and let each come up."""
        for code in codes:
            for down in (True, False):
                self.hold_key(code, down=down)
            self.pass_s(0.1)

    def hold_key(self, code: int, *, down: bool = True, mod: int = 0) -> None:
        """Press a key without releasing it, or release it; `mod` tells which others are down."""
        kind = pygame.KEYDOWN if down else pygame.KEYUP
        self.app.handle(pygame.event.Event(kind, key=code, mod=mod), self.now_s)

    def contacts(self) -> list[Contacts]:
        """Return the contacts for the virtual orb that are due."""
        return [one for one in self.app.outgoing(self.now_s) if isinstance(one, Contacts)]

    @property
    def game(self) -> Game:
        game = self.app.game.game
        assert game
        return game

    def phase(self) -> Phase:
        """Return whether the game runs, pauses or is over."""
        return self.game.phase

    @property
    def playing(self) -> bool:
        return isinstance(self.app.stage.screen, PlayScreen)


def playing(welcome: Welcome | None = WELCOME) -> Window:
    """Return a window in which a game runs whose pieces do not fall."""
    window = Window(Start("zen", 1), welcome=welcome)
    window.pass_s(READY_S, *([FELT] if welcome else []))
    return window


class Finger:
    """A finger on the orb of a window, seen 40 times a second."""

    def __init__(self, window: Window) -> None:
        self.window, self._ms, self._rise = window, 0, Rise()

    def hold(self, seconds: float, x: float, depth_mm: float, y: float = 2.0) -> None:
        for _ in range(round(seconds / ORB_FRAME_S)):
            self.see(ContactState(1, x, y, 0.02, depth_mm, 0.3, 1, 0.99))
            self.window.pass_s(ORB_FRAME_S)

    def see(self, *contacts: ContactState) -> None:
        """Let contacts come at once, each 25 ms after the one before."""
        items = []
        for contact in contacts:
            self._ms += 25
            contact = replace(contact, rise_mm=self._rise.of(contact.depth_mm))
            items.append(Delivered(contact, self._ms))
        self.window.pass_s(0.0, *items)

    def lift(self) -> None:
        self.see(ContactState(1))
