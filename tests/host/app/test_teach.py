"""Teach in the application, with a fake orb that answers its requests."""

import os
from collections.abc import Iterator

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import pygame
import pytest

from controller.protocol.messages import COMMANDS, Command, Message, Telemetry, Welcome
from controller.protocol.teaching import (
    DONE,
    FAILED,
    LEARNING,
    CommandRule,
    Describe,
    ExampleDrop,
    ExampleEnd,
    ExampleStart,
    ExampleTaken,
    Forget,
    GestureInfo,
    Learn,
    LearnStatus,
    SaveAs,
    Undo,
    Vocabulary,
)
from host.app.application import SIZE, OrbApp
from host.app.screens.teach import TeachScreen
from host.app.screens.teach_examples import ExamplesPage
from host.app.screens.teach_new import DetailsPage
from host.app.screens.teach_page import NamePage
from host.app.screens.teach_try import TryPage
from host.connection.receiver import Connected, Delivered, Lost, Received
from tetris.window.menu import Menu
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.screens.play_screen import PlayScreen

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
WELCOME = Welcome(1, 7, "virtual-1", "OrbTouch", True, 5, 5, 10.0, 40.0, 100, 300, LABELS, COMMANDS)
FLAT = bytes([128] * 25)
DENT = bytes([128] * 11 + [90, 70, 90] + [128] * 11)
FRAME_S = 1 / 40
INF = float("inf")
OF = {"press": "left", "pinch": "drop", "twist_cw": "rotate_cw", "twist_ccw": "rotate_ccw"}


class FakeOrb:
    """Answers the messages of teaching, and has no networks."""

    def __init__(self) -> None:
        self.heard: list[Message] = []
        self.taught: dict[str, str] = {}  # labels and their commands
        self.pending: dict[int, ExampleTaken] = {}
        self.weak = False  # whether the next example cannot be learned
        self.objects = False  # whether nothing can be learned
        self._started = ("", 0)

    def answers(self, message: Message) -> list[Message]:
        self.heard.append(message)
        match message:
            case Describe():
                return [*self.described(), *self.pending.values()]
            case ExampleStart(number=number, label=label):
                self._started = label, number
            case ExampleEnd(number=number, keep=True):
                return [self._taken(number)]
            case ExampleDrop(number=number):
                del self.pending[number]
            case Learn() if self.objects:
                return [LearnStatus(FAILED, 1.0, "the examples are too different")]
            case Learn(label=label, command=command):
                self.taught[label] = command
                self.pending.clear()
                kept = (1.0, 0.98, *[1.0] * (len(self.taught) + 3))
                return [
                    LearnStatus(LEARNING, 0.5, ""),
                    *self.described(),
                    LearnStatus(DONE, 1.0, "press waits 0.2 s for it", kept),
                ]
            case Forget(label=label):
                del self.taught[label]
                return [*self.described(), LearnStatus(DONE, 1.0, "forgotten")]
            case Undo() | SaveAs():
                return [LearnStatus(DONE, 1.0, "done")]
        return []

    def _taken(self, number: int) -> ExampleTaken:
        label, started = self._started
        assert started == number
        if self.weak:
            return ExampleTaken(number, label, False, "that touch is too weak", 0.0, b"")
        self.pending[number] = ExampleTaken(number, label, True, "", 0.4, DENT)
        return self.pending[number]

    def described(self) -> list[Message]:
        head = Vocabulary((*LABELS, *self.taught), COMMANDS, "", True, len(self.taught), "/data")
        infos = [
            GestureInfo(label, label, label in self.taught, 0, DENT, rules(command))
            for label, command in (OF | self.taught).items()
        ]
        return [head, *infos]


def rules(command: str) -> tuple[CommandRule, ...]:
    return (CommandRule(command, INF, -INF, INF, -INF),) if command else ()


class Window:
    """The application in a window of its own, a clock, and the fake orb."""

    def __init__(self, size: tuple[int, int] = SIZE) -> None:
        self.app = OrbApp(sound=False)
        self.orb = FakeOrb()
        self.surface = pygame.Surface(size)
        self.now_s = 0.0
        self._due: list[Received] = []
        self.pass_s(0.1, Connected(WELCOME))

    def pass_s(self, seconds: float, *received: Received, image: bytes = FLAT) -> None:
        """Let time pass with a frame of the orb at each step, and a picture at the end."""
        until_s, items = self.now_s + seconds, list(received)
        while self.now_s < until_s:
            self.now_s += FRAME_S
            shares = (1.0, *[0.0] * (len(self.app.orb.labels) - 1))
            frame = Telemetry(1, image, shares, None, "", True, 40.0)
            live = not any(isinstance(item, Lost) for item in items)
            self.app.tick(self.now_s, [*self._due, *items, *([Delivered(frame, 0)] * live)])
            items, self._due = [], []
            for message in self.app.outgoing(self.now_s):
                self._due += [Delivered(each, 0) for each in self.orb.answers(message)]
        self.app.draw(self.surface)

    def key(self, *codes: int) -> None:
        for code in codes:
            for kind in (pygame.KEYDOWN, pygame.KEYUP):
                self.app.handle(pygame.event.Event(kind, key=code), self.now_s)
            self.pass_s(0.1)

    def click(self, item: str) -> None:
        """Click the item whose words begin so, where it is drawn."""
        spots = self.screen.spots
        number = self.number(item)
        place = next(spot.place for spot in spots if spot.number == number)
        self.click_at(place.center)

    def click_at(self, place: tuple[int, int]) -> None:
        left, top = self.app.dock.game.topleft
        at = place[0] + left, place[1] + top
        for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.app.handle(pygame.event.Event(kind, pos=at, button=1), self.now_s)
        self.pass_s(0.1)

    def choose(self, item: str) -> None:
        """Go down to the item whose words begin so, and take it, by keys only."""
        for _ in range(30):
            if self.screen.selected == self.number(item):
                break
            self.key(pygame.K_DOWN)
        self.key(pygame.K_RETURN)

    def number(self, item: str) -> int:
        texts = [each.label for each in self.menu.items]
        return next(number for number, text in enumerate(texts) if text.startswith(item))

    def touch(self, seconds: float = 0.4) -> None:
        """Touch the dome, lift, and wait for the orb's answer."""
        self.pass_s(seconds, image=DENT)
        self.pass_s(1.0)

    @property
    def screen(self) -> MenuScreen:
        screen = self.app.stage.screen
        assert isinstance(screen, MenuScreen)
        return screen

    @property
    def menu(self) -> Menu:
        return self.screen.menu

    def sent(self, kind: type[Message]) -> list[Message]:
        return [message for message in self.orb.heard if isinstance(message, kind)]


@pytest.fixture(autouse=True)
def display() -> Iterator[None]:
    pygame.display.init()
    yield
    pygame.display.quit()


def examples_page(window: Window) -> None:
    """Go to the page of the examples of a swipe by keys."""
    for item in ("Teach", "New gesture", "swipe", "Do it now"):
        window.choose(item)
    assert isinstance(window.screen, ExamplesPage)


@pytest.mark.parametrize("by", ["click", "choose"])
def test_a_gesture_is_taught_by_mouse_or_keys_only(by: str) -> None:
    window = Window()
    take = getattr(window, by)
    for item, page in [
        ("Teach", TeachScreen),
        ("New gesture", NamePage),
        ("swipe", DetailsPage),
        ("Do it now", ExamplesPage),
    ]:
        take(item)
        assert isinstance(window.screen, page)
    for _ in range(3):
        window.touch()
    take("Learn")
    assert isinstance(window.screen, TryPage)
    assert window.sent(Learn) == [Learn("swipe", "hold", "none", False, "")]
    take("Play with it")
    assert isinstance(window.app.stage.screen, PlayScreen)


def test_learning_begins_with_three_examples_and_by_itself_after_five() -> None:
    window = Window()
    examples_page(window)
    for count in range(5):
        assert (window.menu.items[0].do is not None) is (count >= 3)
        window.touch()
    window.pass_s(4.0)
    assert isinstance(window.screen, TryPage)


def test_learning_by_itself_can_wait() -> None:
    window = Window()
    examples_page(window)
    for _ in range(5):
        window.touch()
    window.choose("Not yet")
    window.pass_s(10.0)
    assert isinstance(window.screen, ExamplesPage)


def test_a_double_tap_is_one_example() -> None:
    window = Window()
    examples_page(window)
    window.pass_s(0.15, image=DENT)
    window.pass_s(0.2)
    window.pass_s(0.15, image=DENT)
    window.pass_s(1.0)
    assert len(window.sent(ExampleStart)) == len(window.sent(ExampleEnd)) == 1


def test_an_example_is_thrown_away_by_a_click_on_its_picture_or_by_keys() -> None:
    window = Window()
    examples_page(window)
    for _ in range(3):
        window.touch()
    screen = window.screen
    assert isinstance(screen, ExamplesPage)
    place, example = screen._places[1]
    window.click_at(place.center)
    assert window.sent(ExampleDrop) == [ExampleDrop(example.number)]
    assert len(screen.examples) == 2
    window.choose("Throw away")
    assert len(screen.examples) == 1


def test_an_example_that_cannot_be_learned_says_why() -> None:
    window = Window()
    examples_page(window)
    window.orb.weak = True
    window.touch()
    assert "too weak" in window.menu.notice
    assert window.menu.items[0].value == "0/5"


def test_gestures_take_no_step_while_examples_are_taken() -> None:
    window = Window()
    examples_page(window)
    before = window.screen.selected
    for name in ("down", "drop", "pause"):
        window.pass_s(0.1, Delivered(Command(name, "press", 0.9, None, 1), 0))
    assert isinstance(window.screen, ExamplesPage)
    assert window.screen.selected == before
    window.pass_s(31.0)  # without a touch the orb steers again
    window.pass_s(0.1, Delivered(Command("pause", "pinch", 0.9, None, 1), 0))
    assert isinstance(window.screen, TeachScreen)


def test_the_trial_counts_what_is_understood_and_what_it_is_taken_for() -> None:
    window = Window()
    examples_page(window)
    for _ in range(3):
        window.touch()
    window.choose("Learn")
    for label in ("swipe", "swipe", "press", "", "swipe"):
        window.pass_s(0.2, image=DENT)
        if label:
            window.pass_s(0.1, Delivered(Command("hold", label, 0.9, None, 1), 0), image=DENT)
        window.pass_s(1.0)
    assert [row.cells for row in window.menu.table] == [
        ("understood", "3 of 5"),
        ("taken for", "press ×1, nothing ×1"),
        ("older gestures kept", "100 %"),
        ("least: press", "98 %"),
    ]
    assert "waits" in window.menu.notice


def test_a_name_is_typed() -> None:
    window = Window()
    window.choose("Teach")
    window.choose("New gesture")
    window.key(
        pygame.K_w, pygame.K_a, pygame.K_x, pygame.K_BACKSPACE, pygame.K_MINUS, pygame.K_RETURN
    )
    screen = window.screen
    assert isinstance(screen, DetailsPage)
    assert screen.plan.label == "wa_"


def test_the_pictures_choose_how_it_may_be_turned() -> None:
    window = Window()
    for item in ("Teach", "New gesture", "knock"):
        window.choose(item)
    screen = window.screen
    assert isinstance(screen, DetailsPage)
    half, mirror = screen._pictures[1][0], screen._pictures[3][0]
    window.click_at(half.center)
    window.click_at(mirror.center)
    assert (screen.plan.rotations, screen.plan.mirrored) == ("half", True)


def test_a_taught_gesture_is_removed_when_that_is_confirmed() -> None:
    window = Window()
    window.orb.taught["swipe"] = "hold"
    window.choose("Teach")
    for item in ("swipe", "Remove", "Yes"):
        window.choose(item)
    assert window.sent(Forget) == [Forget("swipe")]
    assert "swipe" not in [item.label for item in window.menu.items]
    assert window.menu.notice == "forgotten"


def test_a_lost_link_leaves_the_page_and_the_examples() -> None:
    window = Window()
    examples_page(window)
    window.touch()
    window.pass_s(1.0, Lost("gone"))
    assert "lost" in window.menu.notice
    window.pass_s(0.2, Connected(WELCOME))
    screen = window.screen
    assert isinstance(screen, ExamplesPage)
    assert window.menu.notice == ""
    assert len(screen.examples) == 1


def test_what_cannot_be_learned_leads_back_to_the_examples() -> None:
    window = Window()
    examples_page(window)
    for _ in range(3):
        window.touch()
    window.orb.objects = True
    window.choose("Learn")
    screen = window.screen
    assert isinstance(screen, ExamplesPage)
    assert len(screen.examples) == 3
    assert "too different" in window.menu.notice
