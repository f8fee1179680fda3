"""A swipe taught by the mouse in the application's window to a real virtual orb, over TCP."""

import os
import time
from collections.abc import Callable, Iterator
from math import ceil
from pathlib import Path

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import pygame
import pytest

from host.app.application import OrbApp
from host.app.screens.teach.examples import ExamplesPage
from host.app.screens.teach.new_gesture import DetailsPage
from host.app.screens.teach.trial import TryPage
from host.connection.receiver import Receiver
from host.connection.virtual_orb import VirtualOrbProcess
from host.targets import SIZE
from tetris.window.screens.menu_screen import MenuScreen

pytestmark = [pytest.mark.slow]
PATIENCE_S = 120.0
SWIPE_S = 0.4
BETWEEN_S = 0.6


class Player:
    """The application, its orb's process, and a mouse."""

    def __init__(self, orb: VirtualOrbProcess) -> None:
        self.app = OrbApp(sound=False)
        self.surface = pygame.Surface(SIZE)
        self.receiver = Receiver(orb.open, token=orb.token)
        self.receiver.start()

    def step(self) -> None:
        self.receiver.wait(1 / 60)
        now_s = time.monotonic()
        self.app.tick(now_s, self.receiver.poll())
        for message in self.app.outgoing(now_s):
            self.receiver.send(message)

    def until(self, condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> None:
        end_s = time.monotonic() + patience_s
        while not condition():
            assert time.monotonic() < end_s, self.screen.menu.notice
            self.step()

    def rest(self, seconds: float) -> None:
        end_s = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end_s)

    def click(self, item: str) -> None:
        """Click the item whose words begin so, when it is there."""

        def places() -> list[pygame.Rect]:
            self.app.draw(self.surface)
            items, spots = self.screen.menu.items, self.screen.spots
            return [each.place for each in spots if items[each.number].label.startswith(item)]

        self.until(lambda: bool(places()))
        self.mouse(pygame.MOUSEBUTTONDOWN, *places()[0].move(self.app.dock.game.topleft).center)
        self.mouse(pygame.MOUSEBUTTONUP, 0, 0)
        self.step()

    def swipe(self, number: int) -> None:
        """Drag from left to right across the dome, a little differently each time."""
        place = self.app.panel.projection
        (x, y), radius = place.centre, place.pixels_per_unit * place.pad.radius
        reach, height = 0.45 + 0.05 * (number % 2), 0.1 * (number % 3 - 1)
        kind, frames = pygame.MOUSEBUTTONDOWN, ceil(SWIPE_S * 60)
        for frame in range(frames):
            across = reach * (2 * frame / frames - 1)
            self.mouse(kind, round(x + radius * across), round(y - radius * height))
            kind = pygame.MOUSEMOTION
            self.rest(SWIPE_S / frames)
        self.mouse(pygame.MOUSEBUTTONUP, 0, 0)

    def mouse(self, kind: int, x: int, y: int) -> None:
        event = pygame.event.Event(kind, pos=(x, y), button=1)
        self.app.handle(event, time.monotonic())

    @property
    def screen(self) -> MenuScreen:
        screen = self.app.stage.screen
        assert isinstance(screen, MenuScreen)
        return screen


@pytest.fixture
def player(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Player]:
    for kind in ("CONFIG", "DATA", "STATE", "CACHE"):
        monkeypatch.setenv(f"XDG_{kind}_HOME", str(tmp_path / kind.lower()))
    pygame.display.init()
    orb = VirtualOrbProcess(5)
    player = Player(orb)
    yield player
    player.receiver.close()
    orb.close()
    pygame.display.quit()


def test_a_swipe_is_taught_and_understood(player: Player) -> None:
    player.until(lambda: player.app.orb.ready)
    for item in ("Teach", "New gesture", "swipe"):
        player.click(item)
    screen = player.screen
    assert isinstance(screen, ExamplesPage)
    for number in range(5):
        player.rest(BETWEEN_S)
        player.swipe(number)
        player.until(lambda number=number: len(screen.examples) > number)  # type: ignore[misc]
    player.until(lambda: isinstance(player.screen, DetailsPage))
    plan = player.screen.plan  # type: ignore[attr-defined]
    assert (plan.rotations, plan.mirrored) == ("none", False)  # all swipes went the same way
    player.click("Learn")
    player.until(lambda: isinstance(player.screen, TryPage))
    page = player.screen
    assert isinstance(page, TryPage)
    for number in range(5):
        player.rest(BETWEEN_S)
        player.swipe(number)
        player.until(lambda number=number: len(page.trial.heard) > number)  # type: ignore[misc]
    assert page.trial.understood >= 4
