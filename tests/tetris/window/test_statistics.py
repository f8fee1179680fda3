"""Statistics of a session: what is counted."""

from tests.support.tetris_games import set_up
from tetris.engine.game import Action, Config
from tetris.engine.modes import MODES
from tetris.engine.pieces import Piece
from tetris.history.replay import Recorder
from tetris.window.game_session import COMMANDS, Session

LEFT, RIGHT, CW, DROP = Action.LEFT, Action.RIGHT, Action.ROTATE_CW, Action.HARD_DROP
STILL = Config(gravity=False, lock_resets=None, undo=True)


def session(config: Config = STILL) -> Session:
    return Session(MODES["zen"], Recorder(1, config, "zen"))


def played(*actions: Action) -> Session:
    made = session()
    made.update(0.0)
    for number, action in enumerate(actions, 1):
        made.update(number * 0.5, [action], commands=action in COMMANDS)
    return made


def test_commands_are_counted_for_each_piece() -> None:
    made = played(LEFT, CW, DROP, RIGHT, DROP)
    assert (made.commands, made.commands_per_piece) == (5, 2.5)


def test_a_game_that_has_not_begun_has_figures_too() -> None:
    assert (session().commands_per_piece, session().grand_clears) == (0.0, 0)


def test_great_clears_are_counted() -> None:
    made = session(Config(gravity=False, lock_resets=None, board="OOOOOOOOO.\n" * 9))
    made.update(0.0)
    for number in range(2):
        set_up(made.game, made.game.board, Piece("I", 7, 17, turn=1))
        made.update(number * 0.5, [DROP])
    assert made.grand_clears == 2


def test_a_lock_that_is_taken_back_is_not_counted() -> None:
    made = played(LEFT, DROP, Action.UNDO, LEFT, DROP)
    assert made.commands == 4  # they were given all the same
    assert made.commands_per_piece == 4.0


def test_a_new_game_is_counted_from_its_beginning() -> None:
    made = played(LEFT, RIGHT, DROP, Action.RESTART)
    assert (made.commands, made.commands_per_piece) == (0, 0.0)
