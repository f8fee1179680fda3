"""Statistics: what is counted, and which shifts and turns were one too many."""

import pytest

from tests.support.tetris_games import set_up
from tetris.bots import greedy
from tetris.engine.game import Action, Config, Game
from tetris.engine.pieces import Piece
from tetris.history.stats import COMMANDS, Statistics, Summary

LEFT, RIGHT, CW, CCW = Action.LEFT, Action.RIGHT, Action.ROTATE_CW, Action.ROTATE_CCW
DROP, DOWN, HOLD, UNDO = Action.HARD_DROP, Action.DOWN, Action.HOLD, Action.UNDO
STILL = Config(gravity=False, lock_resets=None, undo=True)


def seed_of(kind: str) -> int:
    """Return a game that begins with a piece of this kind."""
    return next(seed for seed in range(200) if Game(seed).piece.kind == kind)


def played(seed: int, *actions: Action, config: Config = STILL) -> Summary:
    game, statistics = Game(seed, config), Statistics(config)
    statistics.update(game.update(0.0))
    for number, action in enumerate(actions, 1):
        statistics.update(game.update(number * 0.5, [action]), commands=action in COMMANDS)
    return statistics.summary(game)


def test_pieces_commands_and_speed() -> None:
    summary = played(1, LEFT, CW, DROP, RIGHT, DROP)
    assert (summary.pieces, summary.commands, summary.time_s) == (2, 5, 2.5)
    assert summary.commands_per_piece == 2.5
    assert summary.pieces_per_s == pytest.approx(0.8)


def test_a_game_that_has_not_begun_has_figures_too() -> None:
    summary = Statistics(STILL).summary(Game(1, STILL))
    assert summary.pieces_per_s == summary.commands_per_piece == 0.0
    assert summary.finesse == 1.0


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
    summary = played(seed_of("T"), *actions)
    assert summary.faults == faults
    assert summary.finesse == (0.0 if faults else 1.0)


def test_the_repeats_of_a_held_shift_are_no_inputs() -> None:
    game, statistics = Game(seed_of("T"), STILL), Statistics(STILL)
    statistics.update(game.update(0.0))
    statistics.update(game.update(0.1, [LEFT]), commands=1)
    for number in range(9):  # two of them move it to the wall
        statistics.update(game.update(0.2 + number / 30, [LEFT]))
    statistics.update(game.update(1.0, [DROP]), commands=1)
    assert statistics.summary(game).faults == 0


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


def test_clears_chains_and_combos_are_counted() -> None:
    config = Config(gravity=False, lock_resets=None, board="OOOOOOOOO.\n" * 9)
    game, statistics = Game(1, config), Statistics(config)
    for _ in range(2):
        set_up(game, game.board, Piece("I", 7, 17, turn=1))
        statistics.update(game.update(0.0, [DROP]))
    summary = statistics.summary(game)
    assert summary.clears == {"tetris": 2}
    assert (summary.combo, summary.b2b, summary.pieces) == (2, 1, 2)


def test_a_lock_that_is_taken_back_is_not_counted() -> None:
    summary = played(seed_of("T"), LEFT, RIGHT, DROP, UNDO, LEFT, DROP)
    assert (summary.pieces, summary.faults, summary.finesse) == (1, 0, 1.0)
    assert summary.commands == 5  # they were given all the same


def test_a_new_game_is_counted_from_its_beginning() -> None:
    summary = played(1, LEFT, RIGHT, DROP, Action.RESTART)
    assert (summary.pieces, summary.commands, summary.faults) == (0, 0, 0)


def test_the_bot_that_takes_the_shortest_way_makes_no_fault() -> None:
    game, statistics = Game(3), Statistics(Config())
    statistics.update(game.update(0.0))
    while game.pieces_placed < 50:
        actions = greedy.plan(game).actions
        statistics.update(game.update(0.0, actions), commands=len(actions))
    summary = statistics.summary(game)
    assert summary.faults == 0
    assert summary.finesse == 1.0
    assert sum(count for name, count in summary.clears.items()) >= 10
