"""The reference kernel plays the engine's games, move by move."""

from random import Random

import pytest

from tests.reference.tetris_kernel import MOVES, Kernel, agree
from tetris.engine.game import Action, Config, Game


@pytest.mark.parametrize(
    "config",
    [
        Config(),
        Config(kicks="srs+", randomiser="uniform", columns=6, rows=8),
        Config(partial_lock_out=True, rows=10, hold=False, board="#########."),
    ],
)
def test_the_kernel_and_the_engine_play_the_same_games_move_by_move(config: Config) -> None:
    random = Random(7)
    game, kernel = Game(3, config), Kernel(3, config)
    for _ in range(8000):
        action = random.choice(MOVES)
        game.update(0.0, [action])
        kernel.step(action)
        assert agree(kernel, game)
        if kernel.over:
            assert not kernel.step(Action.LEFT)
            kernel.restart()
            game.update(0.0, [Action.RESTART])


def test_the_kernel_says_whether_there_was_room() -> None:
    kernel = Kernel(1)
    assert [kernel.step(Action.LEFT) for _ in range(6)].count(True) in (3, 4)
    assert kernel.step(Action.HOLD)
    assert not kernel.step(Action.HOLD)
    assert not kernel.step(Action.PAUSE)
