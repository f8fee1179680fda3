"""Every page by a game pad alone: each is reached, and left by one button."""

import pygame
import pytest

from host.app.screens import phone
from host.connection.receiver import Receiver
from host.connection.virtual_orb import VirtualOrbProcess
from tests.support.app_window import READY_S
from tests.support.teaching_window import Window
from tests.system.pictures import Shelf
from tests.system.walk import SHUT
from tetris.engine.game import Phase
from tetris.kit.bindings import BUTTONS
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import PlayScreen

Way = tuple[str, ...]  # labels of the items taken, from the first page
NUMBERS = {name: number for number, name in BUTTONS.items()}
PAGES = {
    "BindingScreen", "CheckScreen", "GesturePage", "LabScreen", "LearnScreen", "MenuScreen",
    "NamePage", "OrbsScreen", "PhoneScreen", "PlayScreen", "PresentOrbScreen",
    "ProgramsScreen", "StrengthPage", "TeachScreen", "TrainPage", "WatchScreen",
}  # fmt: skip


class Pad:
    """A pad whose buttons steer a window."""

    def __init__(self) -> None:
        self.window = Window()
        self.window.app.orbs = Shelf(Receiver(VirtualOrbProcess(1).open))
        self.window.pass_s(0.1)

    def press(self, *names: str) -> None:
        for name in names:
            for kind in (pygame.CONTROLLERBUTTONDOWN, pygame.CONTROLLERBUTTONUP):
                event = pygame.event.Event(kind, button=NUMBERS[name], instance_id=0)
                self.window.app.handle(event, self.window.now_s)
            self.window.pass_s(0.03)

    def choose(self, label: str) -> None:
        """Go down to an item, and take it."""
        for _ in range(60):
            if self.window.menu.items[self.window.screen.selected].label.startswith(label):
                self.press("pad_a")
                return
            self.press("pad_down")
        raise AssertionError(f"{label} cannot be selected on {self.page}")

    @property
    def page(self) -> tuple[str, str]:
        screen = self.window.app.stage.screen
        title = screen.menu.title if isinstance(screen, MenuScreen) else ""
        return type(screen).__name__, title

    def home(self) -> None:
        """Go back by the one button to the first page; out of a game by its menu."""
        for _ in range(9):
            if self.window.app.stage.screen is self.window.app.stage._screens[0]:
                return
            if isinstance(self.window.app.stage.screen, PlayScreen):
                self.press("pad_start", "pad_up", "pad_a")
            else:
                before = self.window.app.stage.screen
                self.press("pad_b")
                assert self.window.app.stage.screen is not before, f"{self.page} cannot be left"
        raise AssertionError(f"{self.page} does not lead home")


@pytest.fixture
def pad(monkeypatch: pytest.MonkeyPatch) -> Pad:
    monkeypatch.setattr(phone, "own_addresses", list)  # no page is served
    return Pad()


def test_every_page_is_reached_and_left_by_the_pad(pad: Pad) -> None:
    seen: dict[tuple[str, str], Way] = {}
    ways: list[Way] = [()]
    while ways:
        way = ways.pop(0)
        pad.home()
        for label in way:
            pad.choose(label)
        if pad.page in seen:
            continue
        seen[pad.page] = way
        if isinstance(pad.window.app.stage.screen, PlayScreen):
            continue
        items = pad.window.menu.items
        doors = [item.label for item in items if item.do and not item.step]
        ways += [(*way, door) for door in doors if door not in SHUT]
    assert {name for name, _ in seen} >= PAGES


def test_a_game_is_played_and_paused(pad: Pad) -> None:
    pad.choose("Play")
    pad.choose("Start")
    pad.window.pass_s(READY_S)
    x, game = pad.window.game.piece.x, pad.window.game
    pad.press("pad_left")
    assert game.piece.x == x - 1
    pad.press("pad_up")
    assert game.pieces_placed == 1
    pad.press("pad_start")
    assert pad.window.phase() is Phase.PAUSED
    pad.press("pad_a")
    assert pad.window.playing


def test_the_demo_is_taken_over_and_the_introduction_gone_through(pad: Pad) -> None:
    pad.choose("Watch")
    pad.choose("Take over")
    assert pad.window.playing
    pad.home()
    pad.choose("Learn")
    pad.window.pass_s(0.1)
    while "Skip this one" in [item.label for item in pad.window.menu.items]:
        pad.choose("Skip this one")
    pad.choose("Play")
    assert pad.window.playing


def test_a_setting_is_changed_and_a_button_bound(pad: Pad) -> None:
    stage = pad.window.app.stage
    pad.choose("Settings")
    pad.choose("Sound")
    volume = stage.settings.effects
    pad.press("pad_left")
    assert stage.settings.effects < volume
    pad.press("pad_b")
    pad.choose("Game pad")
    pad.press("pad_a", "pad_r1")
    assert "pad_r1" in stage.settings.pads["left"]


def test_a_gesture_is_taught_tried_and_played_with(pad: Pad) -> None:
    for item in ("Teach", "New gesture", "swipe"):
        pad.choose(item)
    for _ in range(3):
        pad.window.touch()
    pad.choose("Learn")
    pad.window.pass_s(1.0)
    pad.choose("Play with it")
    assert pad.window.orb.taught == {"swipe": "hold"}
    assert pad.window.playing
