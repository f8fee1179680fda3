"""Snapshots, and locks taken back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tetris_games import Step, configs, of, scripts
from tetris.engine.events import Blocked, Spawned, ToppedOut, Undone
from tetris.engine.game import Action, Config, Game, Phase

DROP, UNDO = Action.HARD_DROP, Action.UNDO
ZEN = Config(gravity=False, lock_resets=None, undo=True)


def test_undo_takes_the_last_lock_back_and_its_piece_enters_again() -> None:
    game = Game(4, ZEN)
    game.update(0.0)
    first, next_five = game.piece, game.next
    game.update(1.0, [Action.LEFT, DROP])
    events = game.update(2.0, [Action.RIGHT, UNDO])
    assert events[1:] == [Undone(2.0), Spawned(2.0, first)]
    assert (game.piece, game.next) == (first, next_five)
    assert (game.board.is_empty, game.score, game.pieces_placed) == (True, 0, 0)
    assert game.time_s == 2.0  # time goes on


@pytest.mark.parametrize(
    ("config", "inputs", "undos", "placed"),
    [(ZEN, [DROP] * 5, 6, 0), (Config(), [DROP], 1, 1), (ZEN, [DROP, Action.RESTART], 1, 0)],
)
def test_undo_goes_no_further_than_the_first_piece_the_rules_and_a_restart(
    config: Config, inputs: list[Action], undos: int, placed: int
) -> None:
    game = Game(4, config)
    game.update(0.0, inputs)
    events = game.update(0.0, [UNDO] * undos)
    assert (events[-1], len(of(events, Undone))) == (Blocked(0.0, UNDO), undos - 1)
    assert (game.pieces_placed, game.board.is_empty) == (placed, placed == 0)


def test_after_an_undo_the_same_pieces_come_again() -> None:
    game = Game(9, ZEN)
    came = [event.piece for event in of(game.update(0.0, [DROP] * 15), Spawned)]
    game.update(0.0, [UNDO] * 15)
    again = [event.piece for event in of(game.update(0.0, [DROP] * 15), Spawned)]
    assert again == came[1:]


def test_a_hold_is_taken_back_with_its_piece() -> None:
    game = Game(4, ZEN)
    game.update(0.0, [Action.HOLD, DROP])
    game.update(0.0, [UNDO])
    assert (game.hold, game.can_hold) == (None, True)


def test_a_lost_game_goes_on_after_an_undo() -> None:
    game = Game(1, ZEN)
    while game.phase is Phase.RUNNING:
        events = game.update(1.0, [DROP])
    assert of(events, ToppedOut)
    game.update(5.0, [UNDO])
    assert (game.phase, game.in_play, game.result) == (Phase.RUNNING, True, None)
    assert game.time_s == 0.0  # no time passed since: it began at 1 s, and was over at once


def test_a_moment_can_be_come_back_to() -> None:
    game = Game(2)
    game.update(0.0, [DROP, Action.HOLD])
    moment = game.snapshot()
    picture = str(game.board)
    after = game.update(3.3, [Action.LEFT, DROP, DROP])
    game.restore(moment)
    assert (game.snapshot(), str(game.board), moment.time_s) == (moment, picture, 0.0)
    assert game.update(3.3, [Action.LEFT, DROP, DROP]) == after


def test_a_moment_of_another_game_is_refused() -> None:
    with pytest.raises(ValueError, match="another seed or other rules"):
        Game(1).restore(Game(2).snapshot())
    with pytest.raises(ValueError, match="another seed or other rules"):
        Game(1).restore(Game(1, ZEN).snapshot())


@given(st.integers(0, 99), configs, scripts, st.integers(0, 24))
@settings(max_examples=80, deadline=None)
def test_a_snapshot_goes_on_alike(seed: int, config: Config, script: list[Step], at: int) -> None:
    game, other = Game(seed, config), Game(seed, config)
    now_ms = 0
    for step, (wait_ms, given_inputs, soft, held) in enumerate(script):
        now_ms += wait_ms
        if step == at:
            other.restore(game.snapshot())
        events = game.update(now_ms / 1000, given_inputs, soft_drop=soft, initial=held)
        if step >= at:
            again = other.update(now_ms / 1000, given_inputs, soft_drop=soft, initial=held)
            assert again == events
            assert other.snapshot() == game.snapshot()
