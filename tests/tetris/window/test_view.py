"""A view that draws every state of a game without a display, and the display itself."""

import os

import pygame
import pytest

from tests.support.pytest_types import Patch
from tests.support.tetris_games import set_up
from tetris.bots import greedy
from tetris.engine.board import Board
from tetris.engine.events import Spawned
from tetris.engine.game import Action, Config, Game, Phase
from tetris.engine.pieces import Piece
from tetris.kit import display, theme
from tetris.kit.settings import Look, Settings
from tetris.window.game_session import BotPlayer
from tetris.window.tiles import colours
from tetris.window.view import GameView

# -- view ----------------------------------------------------------------------------------


def drawn(game: Game, view: GameView, time_s: float) -> pygame.Surface:
    surface = pygame.Surface((640, 480))
    view.draw(surface, game, time_s)
    return surface


def differs(first: pygame.Surface, second: pygame.Surface, area: pygame.Rect) -> bool:
    return pygame.image.tobytes(first.subsurface(area), "RGB") != pygame.image.tobytes(
        second.subsurface(area), "RGB"
    )


@pytest.fixture
def view() -> GameView:
    return GameView(pygame.Rect(0, 0, 640, 480))


def test_a_block_has_the_colour_of_its_piece(view: GameView) -> None:
    game = Game(seed=1)
    set_up(game, Board.parse("S........."), Piece("O", 4, 15))
    surface = drawn(game, view, 0.0)
    cell = view.layout.cell
    x, y = view.layout.at(0, 0)
    red, green, blue, _ = surface.get_at((x + cell // 2, y + cell // 2))
    expected = colours(theme.DARK)["S"]
    assert max(abs(a - b) for a, b in zip((red, green, blue), expected, strict=True)) < 30


def test_a_drop_and_a_clear_are_seen_and_fade(view: GameView) -> None:
    game = Game(seed=1)
    set_up(game, Board.parse("JJJJJJJJJ.\n" * 4 + "J........."), Piece("I", 7, 10, 1))
    game.update(0.0)
    view.show(game.update(0.0, [Action.HARD_DROP]))
    at_once, later = drawn(game, view, 0.02), drawn(game, view, 5.0)
    assert differs(at_once, later, view.layout.board)
    assert not differs(later, drawn(game, view, 6.0), view.layout.board)


def test_a_pause_covers_the_board(view: GameView) -> None:
    game = Game(seed=1)
    running = drawn(game, view, 0.0)
    game.update(0.0, [Action.PAUSE])
    assert differs(running, drawn(game, view, 0.0), view.layout.board)


def test_the_end_of_a_game_is_said_on_the_board(view: GameView) -> None:
    game = Game(seed=1)
    while game.phase is Phase.RUNNING:
        view.show(game.update(0.0, [Action.HARD_DROP]))
    board = drawn(game, view, 0.0).subsurface(view.layout.board)
    assert pygame.mask.from_threshold(board, theme.DARK.accent, (9, 9, 9, 255)).count() > 50


@pytest.mark.parametrize("name", ["dark", "safe"])
def test_drawing_what_changed_gives_the_picture_that_drawing_all_of_it_gives(name: str) -> None:
    look = Look(Settings(theme=name))
    view, game = GameView(pygame.Rect(0, 0, 640, 480), look=look), Game(5, Config(start_level=5))
    kept, whole, plan = pygame.Surface((640, 480)), pygame.Surface((640, 480)), greedy.plan(game)
    actions, saved = list(plan.actions), 0
    for frame in range(1500):
        taken = [actions.pop(0)] if actions and frame % 5 == 0 else []
        taken += [Action.PAUSE] * (frame in (400, 430))
        events = game.update(frame / 60, taken)
        view.show(events)
        if any(isinstance(event, Spawned) for event in events):
            plan = greedy.plan(game)
            actions = [Action.HOLD, *plan.actions] if frame % 7 == 0 else list(plan.actions)
        hint = plan if frame % 240 < 60 else None
        ready = "Ready" if frame < 20 else ""
        changed = view.draw(kept, game, frame / 60, hint=hint, ready=ready, kept=frame > 0)
        view.draw(whole, game, frame / 60, hint=hint, ready=ready)
        assert pygame.image.tobytes(kept, "RGB") == pygame.image.tobytes(whole, "RGB"), frame
        saved += not changed
    assert saved > 250  # the figures of time change, too


def test_words_can_be_drawn_again_after_pygame_was_quit() -> None:
    theme.text("TETRIS", 31, theme.WHITE)
    pygame.quit()
    pygame.font.init()
    assert theme.text("PLAY AGAIN", 31, theme.WHITE).get_width() > 0


# -- display and the bot in the window -----------------------------------------------------


def test_an_unseen_driver_is_taken_only_when_asked_for(monkeypatch: Patch) -> None:
    monkeypatch.setattr(pygame.display, "init", lambda: None)
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    monkeypatch.delenv("SDL_VIDEO_DRIVER", raising=False)
    with pytest.raises(display.DisplayError, match="no display was found"):
        display.open_window((64, 48), "test")


def test_a_window_opens_where_the_user_names_the_driver(monkeypatch: Patch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    try:
        surface = display.open_window((64, 48), "Test")
        assert surface.get_size() == (64, 48)
        assert os.environ["SDL_VIDEO_X11_WMCLASS"] == "test"  # pygame sets the program's name
        icon = pygame.Surface((9, 9))
        icon.fill("red")
        display.show_icon(surface, icon)
        assert surface.get_at((32, 24)) == pygame.Color("red")
    finally:
        pygame.display.quit()


def test_the_bot_acts_at_its_pace_and_begins_anew_after_the_end() -> None:
    game, player = Game(seed=1), BotPlayer(0.1)
    assert len(player.actions(game, 0.0)) == 1
    assert player.actions(game, 0.05) == []
    assert len(player.actions(game, 0.1)) == 1
    events = []
    while game.phase is Phase.RUNNING:
        events = game.update(1.0, [Action.HARD_DROP])
    player.watch(events)
    assert player.actions(game, 1.0) == []
    assert player.actions(game, 9.0) == [Action.RESTART]
