"""Points, chains and levels."""

import pytest

from tetris.engine.moves import Spin
from tetris.engine.scoring import Clear, Streak, goal_of, judge, level_of


def worth(
    lines: int,
    spin: Spin = Spin.NONE,
    *,
    level: int = 1,
    b2b: bool = False,
    combo: int = 0,
    perfect: bool = False,
) -> Clear:
    return judge(lines, spin, level=level, streak=Streak(b2b, combo), perfect=perfect)[0]


@pytest.mark.parametrize(
    ("lines", "spin", "points", "name"),
    [
        (0, Spin.NONE, 0, ""),
        (1, Spin.NONE, 100, "single"),
        (2, Spin.NONE, 300, "double"),
        (3, Spin.NONE, 500, "triple"),
        (4, Spin.NONE, 800, "tetris"),
        (0, Spin.MINI, 100, "mini t-spin"),
        (1, Spin.MINI, 200, "mini t-spin single"),
        (2, Spin.MINI, 400, "mini t-spin double"),
        (0, Spin.FULL, 400, "t-spin"),
        (1, Spin.FULL, 800, "t-spin single"),
        (2, Spin.FULL, 1200, "t-spin double"),
        (3, Spin.FULL, 1600, "t-spin triple"),
    ],
)
def test_a_lock_scores_points_times_level(lines: int, spin: Spin, points: int, name: str) -> None:
    assert worth(lines, spin).points == points
    assert worth(lines, spin, level=7).points == 7 * points
    assert worth(lines, spin).name == name


def test_two_quads_in_a_row_pay_800_and_1200_and_a_combo_of_50() -> None:
    first, streak = judge(4, Spin.NONE, level=1, streak=Streak(), perfect=False)
    second, _ = judge(4, Spin.NONE, level=1, streak=streak, perfect=False)
    assert (first.points, second.points) == (800, 1200 + 50)
    assert (first.b2b, second.b2b) == (False, True)
    assert (first.combo, second.combo) == (0, 1)


def test_a_single_breaks_the_chain() -> None:
    _, streak = judge(1, Spin.NONE, level=1, streak=Streak(b2b=True), perfect=False)
    assert not streak.b2b


@pytest.mark.parametrize("before", [False, True])
def test_a_lock_that_clears_nothing_leaves_the_chain_and_ends_the_combo(before: bool) -> None:
    for spin in Spin:
        clear, streak = judge(0, spin, level=1, streak=Streak(before, 3), perfect=False)
        assert streak == Streak(before, 0)
        assert not clear.b2b
        assert clear.combo == -1


def test_combos_pay_50_for_each_clear_before_times_the_level_and_chains_half_more() -> None:
    assert worth(1, combo=3, level=2).points == (100 + 150) * 2
    assert worth(1, Spin.MINI, b2b=True).points == 300


@pytest.mark.parametrize(("lines", "bonus"), [(1, 800), (2, 1200), (3, 1800), (4, 2000)])
def test_a_perfect_clear_is_added(lines: int, bonus: int) -> None:
    assert worth(lines, perfect=True).points == worth(lines).points + bonus


def test_a_perfect_clear_by_a_back_to_back_quad_adds_3200() -> None:
    assert worth(4, b2b=True, perfect=True).points == 1200 + 3200


def test_a_level_is_ten_lines_and_the_first_goal_ten_times_the_start_level() -> None:
    assert [level_of(lines, 1) for lines in (0, 9, 10, 19, 20)] == [1, 1, 2, 2, 3]
    assert [level_of(lines, 5) for lines in (0, 10, 49, 50, 60)] == [5, 5, 5, 6, 7]


def test_goals_say_where_a_level_begins_and_ends() -> None:
    assert goal_of(1, 1) == (0, 10)
    assert goal_of(3, 1) == (20, 30)
    assert goal_of(5, 5) == (0, 50)
    assert goal_of(6, 5) == (50, 60)


@pytest.mark.parametrize(
    ("lines", "spin", "difficult"),
    [(4, Spin.NONE, True), (3, Spin.NONE, False), (1, Spin.MINI, True), (0, Spin.FULL, False)],
)
def test_difficult_is_a_tetris_or_a_clearing_spin(lines: int, spin: Spin, difficult: bool) -> None:
    clear, _ = judge(lines, spin, level=1, streak=Streak(), perfect=False)
    assert clear.difficult is difficult
