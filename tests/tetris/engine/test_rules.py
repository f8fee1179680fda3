"""Rules that a player may change: goals, limits, guards, lock delays, kicks, pieces, boards."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tetris_games import game_with, of, set_up
from tetris.engine.board import Board
from tetris.engine.events import Blocked, Finished, Held, Locked, Moved, Rotated, Spawned, ToppedOut
from tetris.engine.game import Action, Config, Finish, Game, Gravity, Phase, TopOut
from tetris.engine.pieces import KICKS, KINDS, Kicks, KickTable, Kind, Piece

DROP = [Action.HARD_DROP]


# -- how a game ends -----------------------------------------------------------------------


def test_the_last_line_of_the_goal_wins() -> None:
    game = game_with("JJJJJJ....\nJJJJJJ....", Piece("I", 6, 3), Config(lines_goal=2))
    assert not of(game.update(1.0, DROP), Finished)
    set_up(game, Board.parse("JJJJJJ...."), Piece("I", 6, 3))
    events = game.update(2.0, DROP)
    assert events[-1] == Finished(2.0, Finish.GOAL)
    assert (game.phase, game.result, game.in_play) == (Phase.OVER, Finish.GOAL, False)
    assert game.update(3.0, [Action.LEFT]) == [Blocked(3.0, Action.LEFT)]


def test_the_game_ends_when_its_time_is_over_and_a_pause_does_not_count() -> None:
    game = game_with("", Piece("T", 3, 15), Config(time_limit_s=2.0))
    game.update(1.0, [Action.PAUSE])
    game.update(50.0, [Action.PAUSE])
    assert not of(game.update(50.999), Finished)
    assert of(game.update(60.0), Finished) == [Finished(51.0, Finish.TIME)]
    assert game.time_s == 2.0
    assert game.update(60.0, DROP) == [Blocked(60.0, Action.HARD_DROP)]


def test_what_is_due_at_the_last_moment_still_happens() -> None:
    game = game_with("", Piece("T", 3, 15), Config(time_limit_s=1.0))
    moved, finished = game.update(1.0)
    assert isinstance(moved, Moved)
    assert isinstance(finished, Finished)


def test_a_dig_is_won_with_its_last_garbage() -> None:
    game = Game(1, Config(board="#########.\n.########.", dig=True))
    game.update(0.0)
    assert game.garbage_rows == 2
    set_up(game, game.board, Piece("I", 7, 2, turn=1))  # into the column at the right
    assert not of(game.update(0.0, DROP), Finished)
    assert (str(game.board).count("#"), game.garbage_rows) == (8, 1)
    set_up(game, game.board, Piece("I", -2, 2, turn=1))
    assert game.update(0.0, DROP)[-1] == Finished(0.0, Finish.GOAL)
    assert game.garbage_rows == 0


def test_a_restart_brings_the_first_board_back() -> None:
    game = Game(1, Config(board="#########."))
    game.update(0.0, [*DROP, Action.RESTART])
    assert str(game.board) == "#########."


@pytest.mark.parametrize("partial", [False, True])
def test_a_partial_lock_out_ends_the_game_where_the_rules_say_so(partial: bool) -> None:
    tower = "\n".join(["J.J......."] * 19)
    game = game_with(tower, Piece("O", 0, 19), Config(partial_lock_out=partial))
    reasons = [event.reason for event in of(game.update(0.0, DROP), ToppedOut)]
    assert reasons == [TopOut.LOCK_OUT] * partial


# -- time between pieces -------------------------------------------------------------------


def test_a_hard_drop_that_comes_too_late_does_not_drop_the_next_piece() -> None:
    game = game_with("", Piece("T", 3, -1), Config(guard_s=0.3))
    game.update(0.5)  # locks by itself
    assert game.update(0.7, DROP) == [Blocked(0.7, Action.HARD_DROP)]
    assert of(game.update(0.8, DROP), Locked)


def test_with_a_generation_delay_nothing_is_in_play_for_a_while() -> None:
    game = game_with("", Piece("T", 3, -1), Config(generation_delay_s=0.2))
    assert not of(game.update(0.4, DROP), Spawned)
    assert (game.in_play, game.phase) == (False, Phase.RUNNING)
    assert game.update(0.5, [Action.LEFT]) == [Blocked(0.5, Action.LEFT)]
    (spawned,) = of(game.update(0.9), Spawned)
    assert spawned.time_s == 0.6
    assert game.in_play


def test_a_turn_held_down_turns_the_piece_that_enters() -> None:
    game = game_with("", Piece("T", 3, -1))
    game.update(0.0, DROP, initial=[Action.ROTATE_CW])
    assert game.piece.turn == 1
    game.update(0.0, DROP, initial=[Action.ROTATE_CCW])
    assert game.piece.turn == 3 or game.piece.kind == "O"
    game.update(0.0, DROP, initial=[Action.ROTATE_CW, Action.ROTATE_CCW])
    assert game.piece.turn == 0


def test_hold_held_down_holds_the_piece_that_enters() -> None:
    game = Game(seed=2)
    game.update(0.0)
    first, second = game.next[:2]
    events = game.update(0.0, DROP, initial=[Action.HOLD])
    assert of(events, Held) == [Held(0.0, first)]
    assert (game.hold, game.piece.kind, game.can_hold) == (first, second, False)


def test_holding_can_be_forbidden() -> None:
    game = Game(1, Config(hold=False))
    game.update(0.0)
    assert game.update(0.0, [Action.HOLD]) == [Blocked(0.0, Action.HOLD)]


# -- gravity and lock delay ----------------------------------------------------------------


def test_without_gravity_nothing_falls_and_nothing_locks() -> None:
    game = game_with("", Piece("T", 3, 3), Config(gravity=False))
    assert game.update(1e6) == []
    for _ in range(4):
        game.update(1e6, [Action.DOWN])
    assert game.piece.lowest_row == 0
    assert game.update(2e6) == []
    assert of(game.update(2e6, DROP), Locked)


def test_a_gravity_of_its_own_takes_the_place_of_the_levels_and_shortens_the_lock() -> None:
    game = game_with("", Piece("T", 3, 1), Config(start_level=9, lock_delay_s=2.0))
    events = game.update(0.0, [Gravity(400_000)]) + game.update(1.9)
    assert [event.time_s for event in of(events, Moved)] == pytest.approx([0.4, 0.8])
    (locked,) = of(events, Locked)
    assert locked.time_s == pytest.approx(0.8 + 2.5 * 0.4)
    assert game.row_us == 400_000


def test_a_new_game_falls_by_its_level_again() -> None:
    game = Game(1)
    game.update(0.0, [Gravity(50_000), Action.RESTART])
    assert game.row_us is None
    (moved,) = of(game.update(1.0), Moved)
    assert moved.time_s == pytest.approx(1.0)


def shuffled(config: Config, shifts: int) -> Game:
    """Return a game with a grounded piece that was shifted every 0.1 s."""
    game = game_with("", Piece("T", 3, -1), config)
    for step in range(1, shifts + 1):
        game.update(step / 10, [Action.LEFT if step % 2 else Action.RIGHT])
    return game


def test_with_endless_resets_a_piece_may_be_shifted_for_ever() -> None:
    game = shuffled(Config(lock_resets=None), 200)
    assert game.pieces_placed == 0
    assert of(game.update(20.501), Locked)


def test_without_resets_only_a_fall_begins_the_delay_anew() -> None:
    assert shuffled(Config(lock_resets=0), 4).pieces_placed == 0
    assert shuffled(Config(lock_resets=0), 5).pieces_placed == 1
    game = game_with("....J.....", Piece("O", 4, 1), Config(lock_resets=0))
    game.update(0.4, [Action.RIGHT])  # over the edge, to fall a row at 1.4 s
    assert not of(game.update(1.899), Locked)
    assert of(game.update(1.901), Locked)


# -- kicks, pieces, boards -----------------------------------------------------------------


def mirrored(kicks: KickTable) -> KickTable:
    return {(-a % 4, -b % 4): tuple((-x, y) for x, y in tests) for (a, b), tests in kicks.items()}


def test_srs_plus_is_the_same_in_a_mirror_and_the_guideline_i_is_not() -> None:
    assert all(kicks == mirrored(kicks) for kicks in KICKS["srs+"].values())
    assert [kind for kind in KINDS if KICKS["srs"][kind] != mirrored(KICKS["srs"][kind])] == ["I"]


@pytest.mark.parametrize(("kicks", "x"), [("srs", 1), ("srs+", 4)])
def test_an_i_over_a_block_turns_to_the_left_or_to_the_right(kicks: Kicks, x: int) -> None:
    picture = """
        .....J....
        ..........
        ..........
    """
    game = game_with(picture, Piece("I", 3, 2), Config(kicks=kicks))
    (rotated,) = of(game.update(0.0, [Action.ROTATE_CW]), Rotated)
    assert (rotated.piece, rotated.kick) == (Piece("I", x, 2, turn=1), 1)


def test_uniform_pieces_repeat_more_than_bags_allow() -> None:
    game = Game(3, Config(randomiser="uniform", previews=6))
    kinds: list[Kind] = []
    for _ in range(700):
        kinds.append(game.piece.kind)
        set_up(game, Board(), game.piece)
        game.update(0.0, DROP)
    assert all(70 < kinds.count(kind) < 130 for kind in KINDS)
    assert any(kinds[i] == kinds[i + 1] == kinds[i + 2] for i in range(698))


@pytest.mark.parametrize(("columns", "rows"), [(10, 10), (4, 4), (6, 12), (9, 30)])
def test_on_any_board_pieces_enter_above_the_rows_and_stay_inside(columns: int, rows: int) -> None:
    game = Game(5, Config(columns=columns, rows=rows))
    (spawned,) = of(game.update(0.0), Spawned)
    assert spawned.piece.lowest_row == rows - 1
    for _ in range(300):
        game.update(0.0, [Action.LEFT, Action.ROTATE_CW, Action.HARD_DROP])
        game.update(0.0, [*[Action.RIGHT] * 9, Action.HARD_DROP])
        assert all(len(row) == columns for row in game.board.rows)
        if game.phase is Phase.OVER:
            game.update(0.0, [Action.RESTART])


@pytest.mark.parametrize(
    "extreme",
    [
        *({"start_level": 1}, {"gravity_cap": 1}, {"gravity_cap": 20}, {"lines_goal": 1}),
        *({"lock_delay_s": 0.001}, {"lock_delay_s": 1e6}, {"time_limit_s": 0.001}),
        *({"generation_delay_s": 0.0}, {"guard_s": 0.0}, {"lock_resets": 0}),
        *({"soft_drop_factor": 1}, {"previews": 1}, {"columns": 4}, {"columns": 10}),
        *({"rows": 4}, {"rows": 30}, {"rows": 5, "board": "J.........\n" * 5}),
        {"dig": True, "board": "#........."},
        *({"start_level": 10_000}, {"soft_drop_factor": 10_000}, {"lock_resets": 10_000}),
        *({"lines_goal": 10_000}, {"previews": 100}, {"guard_s": 1e6}, {"time_limit_s": 1e6}),
    ],
)
def test_rules_at_their_limits_are_taken(extreme: dict[str, Any]) -> None:
    assert Game(1, Config(**extreme)).phase is Phase.RUNNING


@pytest.mark.parametrize(
    "wrong",
    [
        *({"start_level": 0}, {"gravity_cap": 21}, {"lock_delay_s": 0.0}),
        *({"lock_delay_s": float("nan")}, {"generation_delay_s": float("inf")}),
        *({"soft_drop_factor": 0}, {"lock_resets": -1}, {"guard_s": -0.1}, {"lines_goal": 0}),
        *({"time_limit_s": 0.0}, {"kicks": "ars"}, {"randomiser": "dice"}, {"columns": 3}),
        *({"rows": 31}, {"board": "JJJJJJJJJJ"}, {"board": "JJJ"}, {"dig": True}),
        *({"gravity_cap": 0}, {"lock_delay_s": 0.0009}, {"lock_delay_s": 1_000_001}),
        *({"generation_delay_s": -0.1}, {"time_limit_s": 0.0009}, {"previews": 0}, {"columns": 11}),
        *({"rows": 3}, {"rows": 5, "board": "J.........\n" * 6}),
        *({"start_level": 10_001}, {"soft_drop_factor": 10_001}, {"lock_resets": 10_001}),
        *({"lines_goal": 10_001}, {"previews": 101}, {"guard_s": 1e6 + 1}, {"time_limit_s": 2e6}),
    ],
)
def test_impossible_rules_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="must"):
        Config(**wrong)


# -- properties ----------------------------------------------------------------------------

actions = st.lists(
    st.sampled_from([a for a in Action if a not in (Action.RESTART, Action.PAUSE)]), max_size=60
)


@given(st.integers(0, 999), actions, st.integers(1, 900))
@settings(max_examples=60, deadline=None)
def test_cells_are_kept_and_pieces_lie_free(seed: int, script: list[Action], step_ms: int) -> None:
    game = Game(seed)
    cells, now_s = 0, 0.0
    for action in script:
        now_s += step_ms / 1000
        for event in game.update(now_s, [action]):
            if isinstance(event, Locked):
                cells += 4 - 10 * len(event.rows)
        assert sum(mark != "." for row in game.board.rows for mark in row) == cells
        if game.in_play:
            assert not game.board.bits & game.piece.mask
            assert game.piece.lowest_row >= 0  # gravity never passes the floor
