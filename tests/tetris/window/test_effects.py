"""Feedback: what lights up after an event, what is said, and that nothing hides the board."""

from dataclasses import replace

import pygame
import pytest

from tests.support.tetris_games import set_up
from tetris.engine import events as happened
from tetris.engine.board import Board
from tetris.engine.events import Event
from tetris.engine.game import Action, Config, Game
from tetris.engine.pieces import Piece
from tetris.kit.settings import Look, Settings
from tetris.window.effects import Effects, praise
from tetris.window.scenery import Layout
from tetris.window.view import GameView, clock, figures_of

AREA = pygame.Rect(0, 0, 1280, 720)
STILL = Look(Settings(motion=False, language="en"))
MOVING = Look(Settings(language="en"))


def drop(board: str, piece: Piece) -> tuple[Game, list[Event]]:
    game = Game(seed=1)
    set_up(game, Board.parse(board), piece)
    game.update(0.0)
    return game, game.update(0.0, [Action.HARD_DROP])


def cleared(board: str, piece: Piece) -> tuple[Game, list[Event], happened.Locked]:
    game, events = drop(board, piece)
    (lock,) = (event for event in events if isinstance(event, happened.Locked))
    return game, events, lock


def changed(look: Look, events: list[Event], game: Game, at_s: float) -> pygame.Mask:
    """Return which pixels differ from a picture in which nothing has happened."""
    pictures = []
    for shown in (events, []):
        view, surface = GameView(AREA, look=look), pygame.Surface(AREA.size)
        view.draw(surface, game, 0.0)
        view.show(shown)
        view.draw(surface, game, at_s)
        pictures.append(surface)
    same = pygame.mask.from_threshold(pictures[0], (0, 0, 0), (1, 1, 1, 255), pictures[1])
    same.invert()
    return same


QUAD = "J.........\n" + "JJJJJJJJJ.\n" * 4


def test_a_great_clear_is_seen_and_then_gone() -> None:
    game, events, _ = cleared(QUAD, Piece("I", 7, 10, 1))
    assert changed(MOVING, events, game, 0.05).count() > 2000
    assert changed(MOVING, events, game, 5.0).count() == 0


def test_cleared_rows_dim_and_nothing_large_becomes_bright() -> None:
    game, events, _ = cleared(QUAD, Piece("I", 7, 10, 1))
    view, surface = GameView(AREA, look=MOVING), pygame.Surface(AREA.size)
    view.draw(surface, game, 0.0)
    view.show(events)
    view.draw(surface, game, 0.01)
    rows = pygame.Rect(view.layout.at(0, 3), (view.layout.board.width, 4 * view.layout.cell))
    assert max(pygame.transform.average_color(surface, rows)[:3]) < 60


def test_light_begins_three_times_a_second_at_most() -> None:
    look, layout = MOVING, Layout.inside(AREA)
    effects, lit = Effects(look), []
    for tick in range(300):
        _, events = drop("", Piece("O", 4, 18))
        events = [replace(event, time_s=tick / 100) for event in events]
        before = len(effects._lights)
        effects.show(events, layout.cell)
        if len(effects._lights) > before:
            lit.append(tick / 100)
        effects.draw(pygame.Surface(AREA.size), layout, tick / 100)
    assert len(lit) > 5
    assert all(later - earlier > 1 for earlier, later in zip(lit, lit[3:], strict=False))


def test_a_row_that_two_pieces_of_one_frame_complete_is_seen() -> None:
    game, view = Game(seed=1), GameView(AREA, look=MOVING)
    set_up(game, Board.parse("JJJJJJ...."), Piece("O", 6, 10))
    game.update(0.0)
    view.draw(pygame.Surface(AREA.size), game, 0.0)
    events = game.update(0.0, [Action.HARD_DROP])
    game.put(Piece("O", 8, 10))
    view.show([*events, *game.update(0.0, [Action.HARD_DROP])])
    view.draw(pygame.Surface(AREA.size), game, 0.05)
    assert (game.lines, view.lively) == (1, True)


def test_words_stand_on_the_board() -> None:
    game, events, _ = cleared(QUAD, Piece("I", 7, 10, 1))
    layout = Layout.inside(AREA)
    late = changed(STILL, events, game, 1.0)  # only words live so long
    assert late.count() > 100
    assert all(layout.board.contains(rect) for rect in late.get_bounding_rects())


def test_without_motion_nothing_lights_up_and_words_stand_without_fading() -> None:
    game, events = drop("", Piece("O", 4, 18))
    assert changed(STILL, events, game, 0.02).count() == 0
    assert changed(MOVING, events, game, 0.02).count() > 0
    game, events, _ = cleared(QUAD, Piece("I", 7, 10, 1))
    assert changed(STILL, events, game, 0.02).count() == changed(STILL, events, game, 1.3).count()


def test_a_lock_is_praised_greatest_first() -> None:
    _, _, lock = cleared(QUAD, Piece("I", 7, 10, 1))
    assert [words for words, _ in praise(lock, MOVING)] == ["TETRIS", "+800"]
    _, _, lock = cleared("JJJJJJJJ..\nJJJJJJJJ..", Piece("O", 8, 10))
    assert [words for words, _ in praise(lock, MOVING)] == ["PERFECT CLEAR", "DOUBLE", "+1,500"]
    _, _, lock = cleared("", Piece("O", 8, 10))
    assert praise(lock, MOVING) == []


def test_every_name_of_a_clear_is_in_the_language_file() -> None:
    german = Look(Settings(language="de"))
    _, _, lock = cleared(QUAD, Piece("I", 7, 10, 1))
    assert praise(lock, german)[0][0] == "TETRIS"
    _, _, lock = cleared("J.........\nJJJJJJJJ..\nJJJJJJJJ..", Piece("O", 8, 10))
    assert praise(lock, german)[0][0] == "DOPPELREIHE"


# -- figures -------------------------------------------------------------------------------


def keys(config: Config, *chosen: str, by_time: bool = False) -> list[str]:
    figures = figures_of(Game(1, config), chosen, by_time=by_time)
    return [figure.key.removeprefix("figures.") for figure in figures]


def test_each_kind_of_game_shows_what_it_is_about() -> None:
    assert keys(Config()) == ["score", "level", "lines"]
    assert keys(Config(lines_goal=150)) == ["score", "level", "lines_left"]
    assert keys(Config(lines_goal=40), by_time=True) == ["time", "lines_left"]
    assert keys(Config(time_limit_s=120.0)) == ["time_left", "score", "lines"]
    dig = Config(board="###.######", dig=True)
    assert keys(dig, by_time=True) == ["time", "garbage", "lines"]


def test_the_player_chooses_two_more_and_none_is_shown_twice() -> None:
    usual = Settings().figures
    assert keys(Config(), *usual)[3:] == ["time", "pieces_per_s"]
    assert keys(Config(lines_goal=40), *usual, by_time=True)[2:] == ["pieces", "pieces_per_s"]
    assert keys(Config(time_limit_s=120.0), *usual)[3:] == ["pieces", "pieces_per_s"]
    assert keys(Config(), "none", "commands_per_piece")[3:] == ["commands_per_piece"]


@pytest.mark.parametrize(
    ("seconds", "written"),
    [(0, "0:00.00"), (59.999, "0:59.99"), (60, "1:00.00"), (65.2, "1:05.20"), (3600, "60:00.00")],
)
def test_time_is_written_as_a_stopwatch_shows_it(seconds: float, written: str) -> None:
    assert clock(seconds) == written


@pytest.mark.parametrize(("columns", "rows"), [(4, 4), (10, 10), (10, 20), (10, 30)])
def test_boards_of_other_sizes_fit_into_the_same_window(columns: int, rows: int) -> None:
    game = Game(1, Config(columns=columns, rows=rows))
    view, surface = GameView(AREA), pygame.Surface(AREA.size)
    game.update(0.0)
    view.show(game.update(0.1, [Action.HARD_DROP]))
    view.draw(surface, game, 0.1)
    layout = view.layout
    assert (layout.columns, layout.rows) == (columns, rows)
    parts = [layout.board, layout.hold, layout.stats, layout.next]
    assert all(AREA.contains(part) for part in parts)
    assert all(len(part.collidelistall(parts)) == 1 for part in parts)
