"""The modes: what is played, and when it ends."""

from itertools import pairwise

import pytest

from tetris.bots import greedy
from tetris.engine.events import Finished, Undone
from tetris.engine.game import Action, Config, Finish, Game, Phase
from tetris.engine.modes import MODES


def test_the_menu_has_ten_modes() -> None:
    names = "marathon endless sprint ultra_2 ultra_3 zen dig orb_marathon orb_sprint orb_ultra"
    assert list(MODES) == names.split()
    assert all(mode.name == name for name, mode in MODES.items())


def test_a_start_level_is_taken_where_it_may_be_chosen() -> None:
    assert MODES["marathon"].config(start_level=7).start_level == 7
    assert MODES["marathon"].config().start_level == 1
    sprint = MODES["sprint"].config(start_level=7)
    assert (sprint.start_level, sprint.gravity_cap) == (1, 1)  # else slow hands lose it at level 5


def play(game: Game, *, most: int = 2000, every_s: float = 0.0) -> list[Finish]:
    """Let the bot play to the end, and return how it finished."""
    now_s, reasons = 0.0, []
    for _ in range(most):
        events = game.update(now_s, greedy.plan(game).actions)
        reasons += [event.reason for event in events if isinstance(event, Finished)]
        if game.phase is Phase.OVER:
            break
        now_s += every_s
    return reasons


@pytest.mark.parametrize(("name", "lines"), [("sprint", 40), ("marathon", 150), ("orb_sprint", 20)])
def test_lines_are_the_goal(name: str, lines: int) -> None:
    game = Game(1, MODES[name].config())
    assert play(game, every_s=game.config.guard_s) == [Finish.GOAL]
    assert lines <= game.lines < lines + 4


@pytest.mark.parametrize(
    ("name", "seconds"), [("ultra_2", 120), ("ultra_3", 180), ("orb_ultra", 180)]
)
def test_ultra_ends_by_the_clock(name: str, seconds: int) -> None:
    game = Game(1, MODES[name].config())
    assert play(game, every_s=1.0) == [Finish.TIME]
    assert game.time_s == seconds


def test_endless_has_no_goal() -> None:
    assert MODES["endless"].config() == Config()


def test_in_zen_nothing_falls_and_a_piece_can_be_taken_back() -> None:
    game = Game(1, MODES["zen"].config())
    start = game.piece
    game.update(0.0)
    game.update(86_400.0)
    assert game.piece == start
    events = game.update(86_401.0, [Action.HARD_DROP, Action.UNDO])
    assert any(isinstance(event, Undone) for event in events)
    assert game.piece == start


def test_dig_begins_with_ten_rows_of_garbage_that_its_seed_draws() -> None:
    assert MODES["dig"].config() == MODES["dig"].config(seed=0)
    game = Game(4, MODES["dig"].config(seed=4))
    rows = game.board.rows
    assert len(rows) == game.garbage_rows == 10
    holes = [row.index(".") for row in rows]
    assert all(row.count("#") == 9 for row in rows)
    assert all(above != below for above, below in pairwise(holes))
    assert MODES["dig"].config(seed=4) == MODES["dig"].config(seed=4)
    assert MODES["dig"].config(seed=4) != MODES["dig"].config(seed=5)


@pytest.mark.parametrize("name", ["orb_marathon", "orb_sprint", "orb_ultra"])
def test_orb_modes_wait_for_slow_hands_and_guard_against_a_late_drop(name: str) -> None:
    config = MODES[name].config()
    assert config.gravity_cap == 1
    game = Game(1, config)
    game.update(0.0)
    game.update(1.0, [Action.HARD_DROP])
    game.update(1.5, [Action.HARD_DROP])  # meant for the piece before
    assert game.pieces_placed == 1
    game.update(1.7, [Action.HARD_DROP])
    assert game.pieces_placed == 2
