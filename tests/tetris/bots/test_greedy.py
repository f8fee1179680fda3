"""The bot: what it values, what it can reach, and that it keeps playing."""

import pytest

from tests.support.tetris_games import set_up
from tetris.bots import greedy
from tetris.bots.greedy import BCTS, DELLACHERIE, Weights, loses, middle, settled, surface
from tetris.bots.placements import paths
from tetris.engine.board import Board
from tetris.engine.events import Locked
from tetris.engine.game import Action, Config, Game, Phase
from tetris.engine.pieces import Piece


def test_an_upright_i_goes_into_a_well_and_clears_four_rows() -> None:
    game = Game(seed=1)
    set_up(game, Board.parse("JJJJJJJJJ.\n" * 4), Piece("I", 3, 17))
    plan = greedy.plan(game)
    assert set(plan.landing.cells) == {(9, y) for y in range(4)}
    game.update(0.0, plan.actions)
    assert game.lines == 4


def test_every_landing_is_reached_by_its_actions() -> None:
    board = Board.parse("""
        J.........
        JJ....LLSS
        ZZOO..LLSS
    """)
    for kind in "IOTSZJL":
        entering = Piece.entering(kind)  # type: ignore[arg-type]
        found = [*paths(board.bits, entering, lowers=False)]
        for landing, _, actions in found:
            game = Game(seed=1)
            set_up(game, Board.parse(str(board)), entering)
            (locked,) = [event for event in game.update(0.0, actions) if isinstance(event, Locked)]
            assert set(locked.piece.cells) == set(landing.cells)
        assert len(found) == {"I": 17, "O": 9, "S": 17, "Z": 17}.get(kind, 34)


def test_a_dear_command_makes_a_near_landing_win() -> None:
    game = Game(seed=1)
    set_up(game, Board(), Piece("O", 4, 18))
    assert len(greedy.plan(game).actions) > 2
    assert greedy.plan(game, command_cost=50.0).actions == (Action.HARD_DROP,)


def test_an_earlier_target_is_kept_while_it_can_be_reached() -> None:
    game = Game(seed=1)
    set_up(game, Board(), Piece("O", 4, 18))
    target = Piece("O", 7, 0)
    plan = greedy.plan(game, target=target)
    assert plan.landing == target
    assert plan.actions == (Action.RIGHT,) * 3 + (Action.HARD_DROP,)


def test_a_target_out_of_reach_is_given_up() -> None:
    game = Game(seed=1)
    set_up(game, Board(), Piece("O", 4, 18))
    assert greedy.plan(game, target=Piece("O", 7, 5)).landing.y == 0


@pytest.mark.parametrize("command_cost", [0.0, 1.0])
def test_asked_again_after_every_command_it_keeps_its_mind(command_cost: float) -> None:
    game = Game(seed=11, config=Config(start_level=3, gravity_cap=3))
    now_s, earlier = 0.0, None
    while game.pieces_placed < 30:
        plan = greedy.plan(game, command_cost=command_cost)
        assert earlier is None or set(plan.landing.cells) == set(earlier.cells)
        now_s += 1.2  # a gesture; the piece has fallen meanwhile
        events = game.update(now_s, plan.actions[:1])
        locked = any(isinstance(event, Locked) for event in events)
        earlier = None if locked else plan.landing


def test_it_plays_on_without_end_in_sight() -> None:
    game = Game(seed=1)
    while game.pieces_placed < 300:
        game.update(0.0, greedy.plan(game).actions)
    assert game.phase is Phase.RUNNING
    assert game.lines > 110
    assert game.board.height < 10


# -- features --------------------------------------------------------------------------------


NONE = Weights(0, 0, 0, 0, 0, 0)


def count(feature: str, picture: str, columns: int = 10, rows: int = 4) -> float:
    only = NONE._replace(**{feature: 1.0})
    return surface(only, columns, rows)(Board.parse(picture, columns).bits)


STACK = """
    ....
    O...
    O.OO
    .OO.
"""


@pytest.mark.parametrize(
    ("feature", "number"),
    [
        ("row_transitions", 2 + 2 + 2 + 4),  # from the top; walls are filled
        ("column_transitions", 3 + 1 + 1 + 3),  # column by column; the floor is filled
        ("holes", 2),  # in the lowest row, left and right
        ("wells", 3),  # one cell each: both corners, and the gap in the second row
        ("hole_depth", 2 + 1),  # two blocks above the left hole, one above the right
        ("rows_with_holes", 1),
    ],
)
def test_a_feature_is_counted_by_hand(feature: str, number: int) -> None:
    assert count(feature, STACK, columns=4) == number


def test_a_well_of_three_counts_one_two_three() -> None:
    assert count("wells", "OOOO.OOOOO\n" * 3) == 6


def test_a_gap_below_a_well_is_no_part_of_it() -> None:
    picture = """
        OOOO.OOOOO
        OOO..OOOOO
    """
    assert count("wells", picture) == 1


def test_the_highest_row_has_no_neighbour_above() -> None:
    assert count("column_transitions", "OOOOOOOOO.", rows=1) == 1  # only the floor's gap
    assert count("column_transitions", "OOOOOOOOO.", rows=2) == 1 + 9


def test_every_row_with_a_hole_counts_once_wherever_the_hole_is() -> None:
    for x in range(10):
        row = "O" * x + "." + "O" * (9 - x)
        assert count("rows_with_holes", f"OOOOOOOOOO\n{row}\n.OOOOOOOOO") == 2


def test_the_two_sets_of_weights_agree_that_holes_are_bad() -> None:
    clean, holed = Board.parse("OOOO......").bits, Board.parse("OOOO......\nOO.O......").bits
    for weights in (DELLACHERIE, BCTS):
        worth = surface(weights)
        assert worth(clean) > worth(holed)


def test_a_piece_settles_and_its_cleared_cells_are_counted_by_row() -> None:
    board = Board.parse("""
        OO.OOOOOOO
        OO.OOOOOOO
        OO.OOOOOO.
    """)
    after, eroded = settled(board.bits, Piece("I", 0, 0, 1))
    assert eroded == 2 * 2  # two rows, with one cell of the piece in each
    expected = Board.parse("""
        ..I.......
        OOIOOOOOO.
    """)
    assert after == expected.bits


def test_a_landing_above_the_visible_rows_loses() -> None:
    config = Config(rows=8)
    assert not loses(Piece("O", 0, 7), config)
    assert loses(Piece("O", 0, 8), config)
    assert loses(Piece("O", 0, 7), Config(rows=8, partial_lock_out=True))
    assert middle(Piece("O", 0, 7)) == 7.5
