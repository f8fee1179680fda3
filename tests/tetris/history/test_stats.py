"""Statistics: what is counted."""

from tests.support.tetris_games import set_up
from tetris.engine.game import Action, Config, Game
from tetris.engine.pieces import Piece
from tetris.history.stats import COMMANDS, Statistics

LEFT, RIGHT, CW, DROP = Action.LEFT, Action.RIGHT, Action.ROTATE_CW, Action.HARD_DROP
STILL = Config(gravity=False, lock_resets=None, undo=True)


def played(*actions: Action) -> Statistics:
    game, statistics = Game(1, STILL), Statistics()
    statistics.update(game.update(0.0))
    for number, action in enumerate(actions, 1):
        statistics.update(game.update(number * 0.5, [action]), commands=action in COMMANDS)
    return statistics


def test_commands_are_counted_for_each_piece() -> None:
    statistics = played(LEFT, CW, DROP, RIGHT, DROP)
    assert (statistics.commands, statistics.commands_per_piece) == (5, 2.5)


def test_a_game_that_has_not_begun_has_figures_too() -> None:
    assert (Statistics().commands_per_piece, Statistics().grand_clears) == (0.0, 0)


def test_great_clears_are_counted() -> None:
    game = Game(1, Config(gravity=False, lock_resets=None, board="OOOOOOOOO.\n" * 9))
    statistics = Statistics()
    for _ in range(2):
        set_up(game, game.board, Piece("I", 7, 17, turn=1))
        statistics.update(game.update(0.0, [DROP]))
    assert statistics.grand_clears == 2


def test_a_lock_that_is_taken_back_is_not_counted() -> None:
    statistics = played(LEFT, DROP, Action.UNDO, LEFT, DROP)
    assert statistics.commands == 4  # they were given all the same
    assert statistics.commands_per_piece == 4.0


def test_a_new_game_is_counted_from_its_beginning() -> None:
    statistics = played(LEFT, RIGHT, DROP, Action.RESTART)
    assert (statistics.commands, statistics.commands_per_piece) == (0, 0.0)
