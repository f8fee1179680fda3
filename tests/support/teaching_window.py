"""The application's window, driven by granted time, and a fake orb that answers its teaching."""

import pygame

from controller.shared.protocol.messages import COMMANDS, Command, Message, Telemetry
from controller.shared.protocol.teaching import (
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
    LessonCost,
    SaveAs,
    SetCommand,
    SetStrength,
    SetWaiting,
    TouchStrength,
    Undo,
    UserInfo,
    Vocabulary,
)
from host.connection.receiver import Connected, Delivered, Lost, Received
from host.targets import SIZE
from tests.support import app_window
from tests.support.app_window import LABELS, WELCOME
from tetris.kit.menu import Menu
from tetris.window.menu_screen import MenuScreen

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
        self.users: dict[str, dict[str, str]] = {}  # own commands of each by label
        self.pending: dict[int, ExampleTaken] = {}
        self.strengths = {"": 1.0}
        self.usual = DENT  # image of each gesture
        self.guess = ("none", False)  # symmetries that examples suggest
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
                return [
                    LearnStatus(LEARNING, 0.5, ""),
                    *self.described(),
                    LearnStatus(DONE, 1.0, "press waits 0.2 s for it"),
                    LessonCost(label, "press", 20, 20, 0.15, 20, 0.4, 20, 0.15),
                    LessonCost(label, label, 20, 0, 0.0, 19, 0.4, 6, 0.4),
                ]
            case Forget(label=label):
                del self.taught[label]
                return [*self.described(), LearnStatus(DONE, 1.0, "forgotten")]
            case SetCommand(label="", user=user):
                self.users[user] = {}
                return [*self.described(), LearnStatus(DONE, 1.0, "done")]
            case SetCommand(label=label, command=command, user=user):
                self.users[user][label] = command or "none"
                return [*self.described(), LearnStatus(DONE, 1.0, "done")]
            case SetStrength(strength=0.0, user=""):
                self.strengths[""] = 1.0
                return [*self.described(), LearnStatus(DONE, 1.0, "done")]
            case SetStrength(strength=0.0, user=user):
                del self.strengths[user]
                return [*self.described(), LearnStatus(DONE, 1.0, "done")]
            case SetStrength(strength=strength, user=user):
                self.strengths[user] = strength
                return [*self.described(), LearnStatus(DONE, 1.0, "done")]
            case Undo() | SaveAs() | SetWaiting():
                return [LearnStatus(DONE, 1.0, "done")]
        return []

    def _taken(self, number: int) -> ExampleTaken:
        label, started = self._started
        assert started == number
        if self.weak:
            return ExampleTaken(number, label, False, "that touch is too weak", 0.0, b"")
        self.pending[number] = ExampleTaken(number, label, True, "", 0.4, DENT, *self.guess)
        return self.pending[number]

    def described(self) -> list[Message]:
        head = Vocabulary((*LABELS, *self.taught), COMMANDS, "", True, len(self.taught), "/data")
        infos = [
            GestureInfo(label, label, label in self.taught, 0, self.usual, rules(command))
            for label, command in (OF | self.taught).items()
        ]
        users = [
            UserInfo(name, tuple(own), tuple(own.values())) for name, own in self.users.items()
        ]
        return [head, *infos, *users, *(TouchStrength(*pair) for pair in self.strengths.items())]


def rules(command: str) -> tuple[CommandRule, ...]:
    return (CommandRule(command, INF, -INF, INF, -INF),) if command else ()


class Window(app_window.Window):
    """The application in a window of its own, a clock, and the fake orb."""

    def __init__(self, size: tuple[int, int] = SIZE) -> None:
        self.orb = FakeOrb()
        self._due: list[Received] = []
        super().__init__(welcome=None, size=size)
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

    def make(self, item: str) -> None:
        """Go down to the item whose words begin so, and take it, by the orb's gestures."""
        self.pass_s(1.0)
        for _ in range(30):
            if self.screen.selected == self.number(item):
                break
            self.pass_s(0.1, Delivered(Command("down", "press", 0.9, None, 1), 0))
        self.pass_s(0.1, Delivered(Command("drop", "pinch", 0.9, None, 1), 0))

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
