"""Features of a stack, each on a drawn board."""

import pytest

from tetris.bots.features import BCTS, DELLACHERIE, Weights, loses, middle, settled, surface
from tetris.engine.board import Board
from tetris.engine.pieces import Piece
from tetris.engine.rules import Config

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
