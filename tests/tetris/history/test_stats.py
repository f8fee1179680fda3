"""Statistics: what is counted, and which shifts and turns were one too many."""

import pytest

from tests.support.tetris_games import set_up
from tetris.bots import greedy
from tetris.engine.game import Action, Config, Game
from tetris.engine.pieces import Piece
from tetris.history.stats import COMMANDS, Statistics

LEFT, RIGHT, CW, CCW = Action.LEFT, Action.RIGHT, Action.ROTATE_CW, Action.ROTATE_CCW
DROP, DOWN, HOLD, UNDO = Action.HARD_DROP, Action.DOWN, Action.HOLD, Action.UNDO
STILL = Config(gravity=False, lock_resets=None, undo=True)


def seed_of(kind: str) -> int:
    """Return a game that begins with a piece of this kind."""
    return next(seed for seed in range(200) if Game(seed).piece.kind == kind)


def played(seed: int, *actions: Action, config: Config = STILL) -> Statistics:
    game = Game(seed, config)
    statistics = Statistics(game)
    statistics.update(game.update(0.0))
    for number, action in enumerate(actions, 1):
        statistics.update(game.update(number * 0.5, [action]), commands=action in COMMANDS)
    return statistics


def test_commands_are_counted_for_each_piece() -> None:
    statistics = played(1, LEFT, CW, DROP, RIGHT, DROP)
    assert (statistics.commands, statistics.commands_per_piece) == (5, 2.5)


def test_a_game_that_has_not_begun_has_figures_too() -> None:
    statistics = Statistics(Game(1, STILL))
    assert (statistics.commands_per_piece, statistics.finesse) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("actions", "faults"),
    [
        ((LEFT, LEFT, LEFT, DROP), 0),
        ((LEFT, RIGHT, DROP), 2),  # there and back
        ((LEFT, LEFT, LEFT, LEFT, DROP), 1),  # the wall was there already
        ((CW, CW, CW, DROP), 2),  # one turn the other way
        ((CW, CCW, LEFT, DROP), 2),
        ((DOWN, DOWN, DROP), 0),  # rows down are free
    ],
)
def test_a_fault_is_a_shift_or_turn_too_many(actions: tuple[Action, ...], faults: int) -> None:
    statistics = played(seed_of("T"), *actions)
    assert statistics.faults == faults
    assert statistics.finesse == (0.0 if faults else 1.0)


def test_the_repeats_of_a_held_shift_are_no_inputs() -> None:
    game = Game(seed_of("T"), STILL)
    statistics = Statistics(game)
    statistics.update(game.update(0.0))
    statistics.update(game.update(0.1, [LEFT]), commands=1)
    for number in range(9):  # two of them move it to the wall
        statistics.update(game.update(0.2 + number / 30, [LEFT]))
    statistics.update(game.update(1.0, [DROP]), commands=1)
    assert statistics.faults == 0


def test_what_was_done_before_holding_was_for_nothing() -> None:
    assert played(seed_of("T"), LEFT, CW, HOLD, DROP).faults == 2


def test_a_tuck_is_measured_by_the_way_that_leads_there() -> None:
    config = Config(
        gravity=False, lock_resets=None, board="OOOOOOOO..\nOOOOO.....\nOOOOO.....\nOOOOOOOOO."
    )
    down = [DOWN] * 18
    kind = seed_of("O")
    needless = (RIGHT, LEFT)
    way = (RIGHT, RIGHT, RIGHT, RIGHT, *down, LEFT, DROP)
    assert played(kind, *way, config=config).faults == 0
    assert played(kind, *needless, *way, config=config).faults == 2


def test_great_clears_are_counted() -> None:
    game = Game(1, Config(gravity=False, lock_resets=None, board="OOOOOOOOO.\n" * 9))
    statistics = Statistics(game)
    for _ in range(2):
        set_up(game, game.board, Piece("I", 7, 17, turn=1))
        statistics.update(game.update(0.0, [DROP]))
    assert statistics.grand_clears == 2


def test_a_lock_that_is_taken_back_is_not_counted() -> None:
    statistics = played(seed_of("T"), LEFT, RIGHT, DROP, UNDO, LEFT, DROP)
    assert (statistics.faults, statistics.finesse) == (0, 1.0)
    assert statistics.commands == 5  # they were given all the same


def test_a_new_game_is_counted_from_its_beginning() -> None:
    statistics = played(1, LEFT, RIGHT, DROP, Action.RESTART)
    assert (statistics.commands, statistics.faults) == (0, 0)


def test_the_bot_that_takes_the_shortest_way_makes_no_fault() -> None:
    game = Game(3)
    statistics = Statistics(game)
    statistics.update(game.update(0.0))
    while game.pieces_placed < 50:
        actions = greedy.plan(game).actions
        statistics.update(game.update(0.0, actions), commands=len(actions))
    assert (statistics.faults, statistics.finesse) == (0, 1.0)
