"""Timing: gravity, soft drop, and the lock delay with its resets."""

import pytest

from tests.support.tetris_games import game_with, of, set_up
from tetris.engine.board import Board
from tetris.engine.events import Blocked, Dropped, Locked, Moved
from tetris.engine.game import Action, Config, Game
from tetris.engine.pieces import Piece
from tetris.engine.rules import seconds_per_row

# -- gravity and soft drop -----------------------------------------------------------------


@pytest.mark.parametrize("config", [Config(), Config(start_level=9, gravity_cap=1)])
def test_at_level_1_or_capped_to_it_a_piece_falls_a_row_in_a_second(config: Config) -> None:
    game = game_with("", Piece("T", 3, 10), config)
    game.update(0.999)
    assert game.piece.y == 10
    game.update(1.001)
    assert (game.piece.y, game.level) == (9, config.start_level)


@pytest.mark.parametrize(
    ("level", "seconds"),
    [
        (1, 1.0),
        (2, 0.793),
        (3, 0.617796),
        (5, 0.355197),
        (10, 0.064152),
        (15, 0.007059),
        (20, 0.000455),
    ],
)
def test_gravity_grows_with_the_level(level: int, seconds: float) -> None:
    assert seconds_per_row(level) == pytest.approx(seconds, abs=5e-7)


def test_beyond_level_20_nothing_falls_faster() -> None:
    assert seconds_per_row(120) == seconds_per_row(20)


def test_soft_drop_is_twenty_times_faster_and_pays_a_point_a_row() -> None:
    game = Game(seed=1)
    set_up(game, Board(), Piece("T", 3, 10))
    game.update(0.0, soft_drop=True)
    game.update(0.049, soft_drop=True)
    assert game.piece.y == 10
    game.update(0.051, soft_drop=True)
    assert game.piece.y == 9
    assert game.score == 1


def test_soft_drop_begins_when_it_is_pressed_and_ends_when_it_is_released() -> None:
    game = game_with("", Piece("T", 3, 10))
    game.update(0.4, soft_drop=True)
    game.update(0.46)  # one soft row, at 0.45 s; then a whole row at the old pace
    assert game.piece.y == 9
    game.update(1.449)
    assert game.piece.y == 9
    game.update(1.451)
    assert game.piece.y == 8


def test_soft_drop_on_the_floor_does_not_lock() -> None:
    game = game_with("", Piece("O", 4, 0))
    game.update(0.001, soft_drop=True)
    assert not of(game.update(0.499, soft_drop=True), Locked)
    assert of(game.update(0.501, soft_drop=True), Locked)


def test_down_is_one_row_at_once_and_pays_a_point() -> None:
    game = game_with("", Piece("T", 3, 10), Config(start_level=5))
    (moved,) = of(game.update(0.0, [Action.DOWN]), Moved)
    assert (moved.dx, moved.dy, moved.action) == (0, -1, Action.DOWN)
    assert game.piece.y == 9
    assert game.score == 1  # not times the level


def test_down_on_the_ground_does_nothing() -> None:
    game = game_with("", Piece("O", 4, 0))
    events = game.update(0.1, [Action.DOWN])
    assert events == [Blocked(0.1, Action.DOWN)]
    assert game.pieces_placed == 0


def test_a_hard_drop_locks_at_once_and_pays_two_points_a_row() -> None:
    game = game_with("", Piece("O", 4, 10))
    events = game.update(0.0, [Action.HARD_DROP])
    assert of(events, Dropped) == [Dropped(0.0, Piece("O", 4, 0), rows=10)]
    assert len(of(events, Locked)) == 1
    assert game.score == 20
    assert str(game.board) == "....OO....\n....OO...."


# -- lock delay ----------------------------------------------------------------------------


def test_a_shift_says_where_to() -> None:
    game = game_with("", Piece("O", 4, 5))
    moved = of(game.update(0.1, [Action.LEFT, Action.RIGHT]), Moved)
    assert moved == [
        Moved(0.1, Piece("O", 3, 5), -1, 0, Action.LEFT),
        Moved(0.1, Piece("O", 4, 5), 1, 0, Action.RIGHT),
    ]


@pytest.mark.parametrize(
    ("picture", "piece", "inputs", "locks_s"),
    [
        ("", Piece("T", 3, -1), {}, 0.5),  # lies on the ground
        ("", Piece("T", 3, -1), {0.4: Action.LEFT, 0.8: Action.RIGHT}, 1.3),  # each restarts
        ("....J.....", Piece("O", 2, 1), {0.4: Action.RIGHT}, 0.9),  # onto a block
        ("J.........\n..........", Piece("T", 0, 1, 1), {0.4: Action.ROTATE_CW}, 0.9),
    ],
)
def test_a_piece_locks_half_a_second_after_its_last_move_on_the_ground(
    picture: str, piece: Piece, inputs: dict[float, Action], locks_s: float
) -> None:
    game = game_with(picture, piece)
    for time_s, action in inputs.items():
        game.update(time_s, [action])
    assert not of(game.update(locks_s - 0.001), Locked)
    assert of(game.update(locks_s + 0.001), Locked)


SHUFFLE = [Action.LEFT, Action.RIGHT] * 8


@pytest.mark.parametrize(("moves", "locked"), [(14, False), (15, True)])
@pytest.mark.parametrize(
    ("piece", "actions"),
    [(Piece("T", 3, -1), SHUFFLE), (Piece("O", 4, 0), [Action.ROTATE_CW] * 16)],
)
def test_the_fifteenth_shift_or_turn_on_the_ground_leaves_no_delay(
    piece: Piece, actions: list[Action], moves: int, locked: bool
) -> None:
    game = game_with("", piece)
    assert not of(game.update(0.0, actions[:moves]), Locked)
    assert bool(of(game.update(0.001), Locked)) is locked


@pytest.mark.parametrize("action", [Action.ROTATE_CW, Action.LEFT])
def test_in_the_air_neither_turns_nor_shifts_cost_a_reset(action: Action) -> None:
    game = game_with("", Piece("O", 4, 1))
    game.update(0.0, [action, Action.RIGHT] * 20)
    game.update(0.0, [Action.DOWN])
    assert not of(game.update(0.499), Locked)
    assert of(game.update(0.501), Locked)


def test_a_new_lowest_row_restores_the_resets() -> None:
    pillar = "....J.....\n" * 8
    game = game_with(pillar, Piece("O", 4, 8))
    actions = [Action.LEFT, Action.RIGHT] * 7 + [Action.RIGHT]  # the last steps off the pillar
    game.update(0.0, actions)
    assert not of(game.update(7.9), Locked)
    game.update(8.0)
    assert game.piece == Piece("O", 5, 0)
    assert not of(game.update(8.499), Locked)
    assert of(game.update(8.501), Locked)


def test_spent_resets_lock_a_piece_as_soon_as_it_touches_the_old_row_again() -> None:
    game = game_with("JJ..JJ....", Piece("T", 3, 0))  # lies on the right block
    game.update(0.0, [*SHUFFLE[:14], Action.LEFT])
    assert of(game.update(0.001), Locked)


def test_a_piece_that_steps_off_an_edge_begins_to_fall_anew() -> None:
    game = game_with("....J.....\n....J.....", Piece("O", 4, 2), Config(start_level=5))
    game.update(0.45, [Action.RIGHT])  # longer on the pillar than a row takes at level 5
    game.update(0.45 + 0.355)
    assert game.piece.y == 2
    game.update(0.45 + 0.356)
    assert game.piece.y == 1
