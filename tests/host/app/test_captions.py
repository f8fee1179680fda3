"""Captions have room: no page cuts a word in the smallest window, in any language."""

import pygame
import pytest

from host.connection.receiver import Connected, Delivered, Received
from tests.support.pytest_types import Patch
from tests.support.teaching_window import WELCOME, FakeOrb
from tests.system.pictures import Album
from tetris.window import language, theme
from tetris.window.theme import Colour

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
def test_no_caption_is_cut_in_the_smallest_window(name: str, cut: list[str]) -> None:
    told = FakeOrb().described()
    orb: list[Received] = [Connected(WELCOME), *(Delivered(one, 0) for one in told)]
    for page, _ in Album((640, 360), "light", name, orb).pages():
        assert not cut, page
