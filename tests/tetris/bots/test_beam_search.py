"""The stronger bot: it sees what comes, holds, tucks and spins, and outlives the other one."""

from types import ModuleType

import pytest

from tests.support.tetris_games import set_up
from tetris.bots import beam_search, greedy
from tetris.engine.board import Board
from tetris.engine.game import Action, Config, Game, Phase
from tetris.engine.modes import MODES
from tetris.engine.pieces import Piece
from tetris.history.replay import Player, Recorder, play_bot


def test_it_tucks_a_piece_under_an_overhang() -> None:
    board = Board.parse("""
        ..........
        ..ZZZZZZZZ
        ..ZZZZZZZZ
        .....ZZZZZ
        .ZZZZZZZZZ
    """)
    game = Game(seed=1)
    set_up(game, board, Piece("L", 1, 10))
    to = beam_search.plan(game, depth=1, width=50)
    game.update(0.0, to.actions)
    assert set(to.landing.cells) <= {(0, 0), (0, 1), (1, 1), (2, 1), (3, 1), (4, 1), (0, 2), (1, 2)}


def test_it_waits_for_four_rows_and_clears_them_with_one_long_piece() -> None:
    board = Board.parse("\n".join(["ZZZZZZZZZ."] * 4))
    game = Game(seed=1)
    set_up(game, board, Piece("T", 4, 18))
    to = beam_search.plan(game, depth=1)
    assert all(x != 9 for x, _ in to.landing.cells)  # not one row for a T
    game = Game(seed=1)
    set_up(game, board, Piece("I", 4, 18))
    game.update(0.0, beam_search.plan(game, depth=1).actions)
    assert game.lines == 4


def test_it_holds_a_piece_that_another_one_should_come_before() -> None:
    held = 0
    game = Game(seed=4)
    while game.pieces_placed < 60:
        plan = beam_search.plan(game, width=4, depth=3)
        held += plan.actions[0] is Action.HOLD
        before = game.pieces_placed
        game.update(0.0, plan.actions)
        assert game.pieces_placed == before + 1
    assert held > 5


def test_where_hold_is_not_allowed_it_does_without() -> None:
    game = Game(seed=4, config=Config(hold=False))
    for _ in range(20):
        plan = beam_search.plan(game, width=3, depth=3)
        assert Action.HOLD not in plan.actions
        game.update(0.0, plan.actions)
    assert game.pieces_placed == 20


def test_asked_again_after_every_action_it_keeps_its_mind() -> None:
    game = Game(seed=11)
    game.update(0.0)
    now_s, target, landings = 0.0, None, set()
    while game.pieces_placed == 0:
        piece = game.piece
        plan = beam_search.plan(game, target=target, width=4, depth=2)
        now_s += 0.1
        game.update(now_s, plan.actions[:1])
        held = plan.actions[0] is Action.HOLD
        target = None if held else plan.landing
        landings |= set() if held or game.piece.kind != piece.kind else {plan.landing.mask}
    assert len(landings) <= 1


def test_it_plays_on_a_narrow_and_low_board_with_other_kicks() -> None:
    config = Config(columns=6, rows=9, kicks="srs+", randomiser="uniform", start_level=5)
    recorder = Recorder(3, config)
    play_bot(recorder, beam_search.plan, pieces=60)
    assert recorder.game.pieces_placed == 60


def test_when_nothing_can_be_saved_it_still_answers() -> None:
    wall = ".OOOOOOOOO\n" * 20
    game = Game(seed=1)
    set_up(game, Board.parse(wall), Piece("T", 3, 20))
    plan = beam_search.plan(game)
    assert plan.actions[-1] is Action.HARD_DROP


@pytest.mark.parametrize(
    ("planner", "says"), [(beam_search, "no piece is in play"), (greedy, "the game is over")]
)
def test_a_game_that_is_over_cannot_be_planned(planner: ModuleType, says: str) -> None:
    game = Game(seed=1)
    while game.phase is Phase.RUNNING:
        game.update(0.0, [Action.HARD_DROP])
    with pytest.raises(ValueError, match=says):
        planner.plan(game)


@pytest.mark.slow
def test_it_clears_more_lines_than_the_bot_that_looks_one_piece_ahead() -> None:
    config = Config(rows=5, randomiser="uniform", partial_lock_out=True, gravity=False)

    def lines(planner: object, seed: int) -> int:
        recorder = Recorder(seed, config)
        play_bot(recorder, planner, pieces=120)  # type: ignore[arg-type]
        return recorder.game.lines

    for seed in range(3):
        assert lines(beam_search.plan, seed) > 1.5 * lines(greedy.plan, seed)


@pytest.mark.parametrize("name", ["dig", "orb_marathon", "sprint"])
def test_a_bot_plays_a_mode_through_inputs_that_replay(name: str) -> None:
    recorder = Recorder(9, MODES[name].config(seed=9), name)
    events = play_bot(recorder, greedy.plan, pieces=30, action_s=0.05)
    assert recorder.game.pieces_placed == 30
    player = Player(recorder.replay())
    assert player.first_events + player.advance(1e9) == events


def test_a_generation_delay_is_waited_for() -> None:
    recorder = Recorder(9, Config(generation_delay_s=0.2))
    play_bot(recorder, greedy.plan, pieces=5)
    assert recorder.game.pieces_placed == 5
    assert recorder.time_s == pytest.approx(0.8)
