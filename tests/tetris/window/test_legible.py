"""Legibility of every screen: sizes of letters, contrast, and room in windows of every shape."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pygame
import pytest

from tests.support.pytest_types import Patch
from tests.support.tetris_player import FRAME_S, Player, open_app
from tests.tetris.kit.test_theme import contrast
from tetris.kit import language, theme
from tetris.kit.settings import Settings
from tetris.kit.theme import LEAST_PX, PALETTES, Colour
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import READY_S, RESUME_S

SIZES = [(640, 360), (480, 800), (960, 720)]


def opened(window: pygame.Surface, size: tuple[int, int], folder: Path, **chosen: object) -> Player:
    player = open_app(window, config=folder, data=folder)
    player.app.stage.change(Settings(**{"language": "en", **chosen}))  # type: ignore[arg-type]
    pygame.display.set_mode(size, pygame.RESIZABLE)
    player.wait(FRAME_S, pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
    return player


def walk(player: Player) -> Iterator[str]:
    """Go to every screen, and name it."""
    words = player.app.stage.look.words
    yield "title"
    player.choose(words("menu.play"))
    yield "play"
    for page in ("menu.best", "menu.replays"):
        player.choose(words(page))
        yield page
        player.key(pygame.K_ESCAPE)
    player.key(pygame.K_ESCAPE)
    player.choose(words("menu.settings"))
    yield "settings"
    for name in ("handling", "keys", "pads", "screen", "sound"):
        player.choose(words(f"settings.{name}"))
        yield name
        player.key(pygame.K_ESCAPE)
    player.key(pygame.K_ESCAPE, pygame.K_F1)
    yield "help"
    player.key(pygame.K_F1)
    player.choose(words("menu.play"), words("menu.start"))
    yield "ready"
    player.wait(READY_S)
    player.key(pygame.K_c, pygame.K_SPACE)
    yield "game"
    player.key(pygame.K_p)
    yield "pause"
    player.key(pygame.K_RETURN)
    yield "countdown"
    player.wait(RESUME_S)
    player.lose()
    yield "results"
    player.choose(words("menu.watch"))
    player.wait(0.5)
    yield "replay"


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("scale", [80, 160])
def test_no_letter_is_too_small(
    window: pygame.Surface,
    tmp_path: Path,
    monkeypatch: Patch,
    size: tuple[int, int],
    scale: int,
) -> None:
    sizes: list[int] = []
    real = pygame.font.Font

    def font(file: object, points: int) -> pygame.font.Font:
        sizes.append(points)
        return real(file, points)  # type: ignore[arg-type]

    monkeypatch.setattr(pygame.font, "Font", font)
    for kept in (theme.font, theme.text, theme.fitted):
        kept.cache_clear()
    assert len(list(walk(opened(window, size, tmp_path, scale=scale)))) == 17
    assert sizes
    assert min(sizes) >= LEAST_PX


@pytest.mark.parametrize("name", PALETTES)
def test_all_words_have_the_contrast_that_wcag_asks_for(
    window: pygame.Surface, tmp_path: Path, monkeypatch: Patch, name: str
) -> None:
    used: set[Colour] = set()
    real: Callable[..., pygame.Surface] = theme.text.__wrapped__

    def text(words: str, size: int, colour: Colour) -> pygame.Surface:
        used.add(colour)
        return real(words, size, colour)

    monkeypatch.setattr(theme, "text", text)
    player = opened(window, (1280, 720), tmp_path, theme=name)
    theme.fitted.cache_clear()
    used.clear()  # of the first picture, which had the usual theme
    list(walk(player))
    palette = PALETTES[name]
    assert {palette.text, palette.dim, palette.accent} <= used
    # And those of a callout, of a notice, and of a list's first place.
    used |= {palette.good, palette.warn, palette.cool}
    for colour in used:
        for ground in (palette.background, palette.surface, palette.raised):
            assert contrast(colour, ground) >= 4.5, (colour, ground)


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("spoken", language.names())
def test_the_chosen_item_is_always_seen_and_inside(
    window: pygame.Surface, tmp_path: Path, size: tuple[int, int], spoken: str
) -> None:
    player = opened(window, size, tmp_path, language=spoken, scale=160)
    for page in walk(player):
        screen = player.screen
        if not isinstance(screen, MenuScreen):
            continue
        for _ in screen.menu.items:
            player.key(pygame.K_DOWN)
            spots = {spot.number: spot.place for spot in screen._view.spots}
            seen = spots[screen.selected].inflate(-40, 0)
            assert pygame.Rect((0, 0), size).contains(seen), page
