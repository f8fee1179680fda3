"""The board as bits and as a drawing."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tetris.engine.board import Board
from tetris.engine.pieces import TOTAL_ROWS, Piece


def test_full_rows_are_cleared_and_rows_above_fall() -> None:
    board = Board.parse("""
        .T........
        IIIIIIIIII
        O..O......
        SSSSZZZZLL
    """)
    assert board.clear_full_rows() == (0, 2)
    assert str(board) == ".T........\nO..O......"


def test_the_highest_row_is_cleared_as_all_others_are() -> None:
    board = Board.parse("IIIIIIIIII\n" + "I.........\n" * (TOTAL_ROWS - 1))
    assert board.clear_full_rows() == (TOTAL_ROWS - 1,)


def test_placing_a_piece_leaves_its_colour() -> None:
    board = Board.parse("JJJJ..JJJJ")
    board.place(Piece("O", 4, 0))
    assert str(board) == "....OO....\nJJJJOOJJJJ"
    assert board.clear_full_rows() == (0,)
    assert str(board) == "....OO...."


def test_an_emptied_board_says_so() -> None:
    board = Board.parse("IIIIIIIIII")
    assert not board.is_empty
    board.clear_full_rows()
    assert board.is_empty
    assert str(board) == ""
    assert board.bits == Board().bits


@pytest.mark.parametrize("picture", ["TTT", "..........T", "....X....."])
def test_a_wrong_drawing_is_refused(picture: str) -> None:
    with pytest.raises(ValueError, match=r"10 characters of \.#IOTSZJL"):
        Board.parse(picture)


def test_too_many_rows_are_refused() -> None:
    with pytest.raises(ValueError, match="41 rows were drawn"):
        Board.parse("T.........\n" * 41)


rows = st.one_of(st.text("..TJ", min_size=10, max_size=10), st.just("IIIIIIIIII"))


@given(st.lists(rows, max_size=40))
def test_clearing_bits_and_clearing_the_drawing_agree(lines: list[str]) -> None:
    board = Board.parse("\n".join(lines))
    board.clear_full_rows()
    kept = [line for line in lines if "." in line]
    assert board.bits == Board.parse("\n".join(kept)).bits
    assert board.planes == Board.parse("\n".join(kept)).planes
    assert board.rows == Board.parse("\n".join(kept)).rows
