"""The loop of the window: its end, its first connection, its size."""

from collections.abc import Iterator, Sequence
from itertools import count

import pygame
import pytest

from controller.shared.protocol import messages
from host import window_loop as loop
from host.app.application import OrbApp
from host.connection.receiver import Connected, Received, Receiver, Refused
from host.connection.transport import LinkError
from host.targets import SIZE
from tests.support.app_window import FELT, WELCOME, said
from tetris.window.app import Start


class FakeReceiver(Receiver):
    """A link whose news are written down beforehand, a list for each frame of the window."""

    def __init__(self, *news: Sequence[Received]) -> None:
        self.news = list(news)
        self.sent: list[messages.Message] = []

    def poll(self) -> list[Received]:
        return list(self.news.pop(0)) if self.news else []

    def send(self, message: messages.Message) -> bool:
        self.sent.append(message)
        return True

    def wait(self, timeout_s: float) -> None: ...


@pytest.fixture
def surface() -> Iterator[pygame.Surface]:
    yield loop.window(headless=True)
    pygame.display.quit()


def test_loop_plays_until_its_time_is_up(surface: pygame.Surface) -> None:
    app = OrbApp(Start("zen", 1), sound=False)
    receiver = FakeReceiver([Connected(WELCOME)], [FELT], [], [said("drop")])
    loop.play(app, receiver, surface, seconds=6, clock=map(float, count()).__next__)
    assert app.game.game is not None
    assert app.game.game.pieces_placed == 1
    assert receiver.sent  # it asks for the orb's gestures


def test_f11_fills_the_screen_and_comes_back(surface: pygame.Surface) -> None:
    app = OrbApp(sound=False)
    for expected in (pygame.display.get_desktop_sizes()[0], SIZE):
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_F11))
        loop.play(app, FakeReceiver(), surface, seconds=0.5, clock=count(0.0).__next__)
        assert pygame.display.get_window_size() == expected


def test_loop_ends_with_the_reason_when_the_first_connection_fails(
    surface: pygame.Surface,
) -> None:
    with pytest.raises(LinkError, match="COM7 is busy"):
        loop.play(OrbApp(sound=False), FakeReceiver([], [Refused("COM7 is busy")]), surface)
