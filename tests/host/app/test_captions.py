"""Captions have room: no page cuts a word in small windows or at large sizes of text."""

from dataclasses import replace

import pygame
import pytest

from host.app.screens.teach.gesture import GesturePage
from host.connection.receiver import Connected, Delivered, Received
from tests.support.app_window import WELCOME
from tests.support.pytest_types import Patch
from tests.support.teaching_window import FakeOrb, Window
from tests.system.pictures import Album
from tetris.kit import language, theme
from tetris.kit.theme import Colour

pytestmark = [pytest.mark.slow]


@pytest.fixture
def cut(monkeypatch: Patch) -> list[str]:
    """Captions that are wider than their room, as they are drawn."""
    found: list[str] = []
    real = theme.fitted

    def fitted(words: str, size: int, colour: Colour, widest: int) -> pygame.Surface:
        smallest = theme.font(0).size(words)[0]  # at the least size of letters
        if min(smallest, theme.font(size).size(words)[0]) > widest:
            found.append(words)
        return real(words, size, colour, widest)

    monkeypatch.setattr(theme, "fitted", fitted)
    return found


@pytest.mark.parametrize("name", language.names())
@pytest.mark.parametrize(("size", "scale"), [((640, 360), 100), ((1024, 640), 160)])
def test_no_caption_is_cut(size: tuple[int, int], scale: int, name: str, cut: list[str]) -> None:
    told = FakeOrb().described()
    orb: list[Received] = [Connected(WELCOME), *(Delivered(one, 0) for one in told)]
    for page, _ in Album(size, {"language": name, "scale": scale}, orb).pages():
        assert not cut, page


@pytest.mark.parametrize("name", language.names())
def test_no_caption_is_cut_where_symmetries_are_asked(name: str, cut: list[str]) -> None:
    window = Window((640, 360))
    for door in ("Teach", "New gesture", "double tap"):
        window.choose(door)
    for _ in range(3):
        window.touch()
    stage = window.app.stage
    stage.change(replace(stage.settings, language=name))
    cut.clear()
    for _ in range(4):  # the values of all answers
        for item in window.menu.items:
            if item.step:
                item.step(1)
        window.screen.rebuild()
        window.pass_s(0.1)
    assert isinstance(window.screen, GesturePage)
    assert not cut
