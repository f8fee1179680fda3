"""The game: bags, hold, levels, pause, the end; and that slicing time changes nothing."""

from itertools import groupby, pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tetris_games import Step, configs, game_with, of, scripts, set_up
from tetris.engine import events as told
from tetris.engine.board import Board
from tetris.engine.events import Blocked, Held, LevelUp, Locked, Moved, Spawned, ToppedOut
from tetris.engine.game import Action, Config, Event, Game, Phase, TopOut
from tetris.engine.pieces import Kind, Piece

# -- pieces: bags, previews, hold, ghost ---------------------------------------------------


def dealt(seed: int, count: int) -> list[Kind]:
    """Return the pieces that a game deals, read from its entrances on empty boards."""
    game = Game(seed)
    kinds = []
    for _ in range(count):
        kinds.append(game.piece.kind)
        set_up(game, Board(), game.piece)
        game.update(0.0, [Action.HARD_DROP])
    return kinds


@given(st.integers(0, 2**32))
@settings(max_examples=20)
def test_every_bag_of_seven_holds_each_piece_once(seed: int) -> None:
    kinds = dealt(seed, 28)
    for start in range(0, 28, 7):
        assert set(kinds[start : start + 7]) == set("IOTSZJL")


def test_bags_differ_and_a_seed_repeats_them() -> None:
    assert dealt(5, 70) == dealt(5, 70)
    assert dealt(5, 70) != dealt(6, 70)
    bags = {tuple(dealt(seed, 7)) for seed in range(40)}
    assert len(bags) > 35


def test_a_piece_is_away_for_twelve_others_at_most_and_s_and_z_come_four_times_at_most() -> None:
    kinds = dealt(1, 700)
    for kind in set(kinds):
        places = [place for place, other in enumerate(kinds) if other == kind]
        assert max(later - place for place, later in pairwise(places)) <= 13
    runs = [len(list(run)) for snaky, run in groupby(kinds, key="SZ".__contains__) if snaky]
    assert max(runs) <= 4


def test_the_next_five_come_as_announced() -> None:
    game = Game(seed=3)
    announced = game.next
    assert len(announced) == 5
    came = []
    for _ in range(5):
        game.update(0.0, [Action.HARD_DROP])
        came.append(game.piece.kind)
    assert tuple(came) == announced


def test_a_piece_enters_and_moves_one_row_down_at_once() -> None:
    game = Game(seed=1)
    (spawned,) = of(game.update(5.0), Spawned)
    assert spawned.time_s == 5.0
    assert spawned.piece == game.piece
    assert {y for _, y in game.piece.cells} <= {19, 20}


def test_hold_takes_the_next_piece_and_later_swaps() -> None:
    game = Game(seed=2)
    first, second = game.piece.kind, game.next[0]
    game.update(0.0, [Action.ROTATE_CW])
    assert of(game.update(0.0, [Action.HOLD]), Held) == [Held(0.0, first)]
    assert (game.hold, game.piece.kind) == (first, second)
    third = game.next[0]
    game.update(0.0, [Action.HARD_DROP])
    assert game.piece.kind == third
    game.update(0.0, [Action.HOLD])
    assert (game.hold, game.piece.kind, game.piece.turn) == (third, first, 0)


def test_hold_works_once_until_the_next_lock() -> None:
    game = Game(seed=2)
    game.update(0.0, [Action.HOLD])
    piece = game.piece
    assert game.update(0.0, [Action.HOLD]) == [Blocked(0.0, Action.HOLD)]
    assert game.piece == piece
    game.update(0.0, [Action.HARD_DROP])
    assert game.can_hold


def test_the_ghost_shows_where_a_drop_ends() -> None:
    game = game_with("....J.....\n....J.....", Piece("O", 3, 15))
    assert game.ghost_y == 2


# -- levels --------------------------------------------------------------------------------


def single(game: Game) -> list[Event]:
    """Clear one row."""
    set_up(game, Board.parse("J.........\nJJJJJJ...."), Piece("I", 6, -2))
    return game.update(0.0, [Action.HARD_DROP])


def test_the_tenth_line_begins_level_2() -> None:
    game = Game(seed=1)
    for _ in range(9):
        assert not of(single(game), LevelUp)
    assert of(single(game), LevelUp) == [LevelUp(0.0, 2)]
    assert (game.lines, game.level) == (10, 2)


def test_a_game_started_at_level_5_reaches_level_6_at_50_lines() -> None:
    game = Game(seed=1, config=Config(start_level=5))
    for _ in range(49):
        single(game)
    assert game.level == 5
    single(game)
    assert (game.lines, game.level) == (50, 6)


def test_a_clear_is_paid_by_the_level_before_it() -> None:
    game = Game(seed=1)
    for _ in range(9):
        single(game)
    (locked,) = of(single(game), Locked)
    assert locked.clear.combo == 9
    assert locked.clear.points == 100 + 50 * 9
    assert locked.rows == (0,)


# -- pause, end, restart -------------------------------------------------------------------


def test_no_time_passes_in_a_pause() -> None:
    game = game_with("", Piece("T", 3, 10))
    assert game.update(0.6, [Action.PAUSE]) == [told.Paused(0.6)]
    assert game.update(100.0, [Action.LEFT]) == [Blocked(100.0, Action.LEFT)]
    assert game.update(100.0, [Action.PAUSE]) == [told.Resumed(100.0)]
    game.update(100.399)
    assert game.piece == Piece("T", 3, 10)
    (moved,) = of(game.update(100.401), Moved)
    assert moved.time_s == pytest.approx(100.4)
    assert game.time_s == pytest.approx(1.001)


def test_blocks_where_a_piece_enters_end_the_game() -> None:
    tower = "\n".join(["...JJJJ..."] * 20)
    game = game_with(tower, Piece("O", 0, 5))
    events = game.update(0.0, [Action.HARD_DROP])
    assert game.phase is Phase.RUNNING
    assert {y for _, y in game.piece.cells} <= {20, 21}  # no room to move down
    events = game.update(0.0, [Action.HARD_DROP])
    assert of(events, ToppedOut)[0].reason is TopOut.LOCK_OUT

    taller = "\n".join(["...JJJJ..."] * 21)
    game = game_with(taller, Piece("O", 0, 5))
    events = game.update(0.0, [Action.HARD_DROP])
    assert of(events, ToppedOut)[0].reason is TopOut.BLOCK_OUT
    assert game.phase is Phase.OVER


def test_after_the_end_only_a_restart_counts() -> None:
    game = game_with("\n".join(["...JJJJ..."] * 21), Piece("O", 0, 5))
    game.update(0.0, [Action.HARD_DROP])
    events = game.update(1.0, [Action.LEFT, Action.PAUSE])
    assert events == [Blocked(1.0, Action.LEFT), Blocked(1.0, Action.PAUSE)]
    events = game.update(2.0, [Action.RESTART])
    assert events[0] == told.Restarted(2.0)
    assert events[1] == Spawned(2.0, game.piece)
    assert game.phase is Phase.RUNNING


def test_a_restart_carries_nothing_over() -> None:
    game = Game(seed=4)
    game.update(0.0, [Action.HOLD, Action.HARD_DROP, Action.HARD_DROP])
    game.update(0.5, [Action.RESTART])
    assert (game.score, game.lines, game.pieces_placed, game.hold) == (0, 0, 0, None)
    assert game.board.is_empty
    assert game.time_s == 0.0
    first_bag = [game.piece.kind, *game.next]
    assert len(set(first_bag)) == 6  # a whole new bag


def test_a_restart_ends_a_pause() -> None:
    game = Game(seed=4)
    game.update(0.0, [Action.PAUSE])
    game.update(9.0, [Action.RESTART])
    assert game.phase is Phase.RUNNING
    game.update(10.0)
    assert game.time_s == pytest.approx(1.0)


def test_time_never_goes_back() -> None:
    game = Game(seed=1)
    game.update(2.0)
    with pytest.raises(ValueError, match="time went back"):
        game.update(1.9)


# -- replays -------------------------------------------------------------------------------


@given(st.integers(0, 99), configs, scripts, st.integers(1, 700))
@settings(max_examples=80, deadline=None)
def test_slices_play_the_same(seed: int, config: Config, script: list[Step], slice_ms: int) -> None:
    coarse, fine = Game(seed, config), Game(seed, config)
    coarse_events, fine_events = coarse.update(0.0), fine.update(0.0)
    now_ms, soft, held = 0, False, list[Action]()
    for wait_ms, inputs, soft_next, held_next in [*script, (3000, [], False, [])]:
        for between_ms in range(now_ms, now_ms + wait_ms, slice_ms):
            fine_events += fine.update(between_ms / 1000, soft_drop=soft, initial=held)
        now_ms, soft, held = now_ms + wait_ms, soft_next, held_next
        for one in inputs:
            fine_events += fine.update(now_ms / 1000, [one], soft_drop=soft, initial=held)
        fine_events += fine.update(now_ms / 1000, soft_drop=soft, initial=held)
        coarse_events += coarse.update(now_ms / 1000, inputs, soft_drop=soft, initial=held)
    assert fine_events == coarse_events
    assert fine.snapshot() == coarse.snapshot()
