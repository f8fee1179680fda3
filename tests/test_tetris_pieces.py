"""Shapes, entrances and kicks, against numbers typed from the rule book."""

import pytest

from tetris.board import Board
from tetris.kicks import KICKS as TABLES
from tetris.pieces import KINDS, SHAPES, Kind, Piece

KICKS = TABLES["srs"]
JLSTZ_KICKS = """
0>R  ( 0, 0) (-1, 0) (-1, 1) ( 0,-2) (-1,-2)
R>0  ( 0, 0) ( 1, 0) ( 1,-1) ( 0, 2) ( 1, 2)
R>2  ( 0, 0) ( 1, 0) ( 1,-1) ( 0, 2) ( 1, 2)
2>R  ( 0, 0) (-1, 0) (-1, 1) ( 0,-2) (-1,-2)
2>L  ( 0, 0) ( 1, 0) ( 1, 1) ( 0,-2) ( 1,-2)
L>2  ( 0, 0) (-1, 0) (-1,-1) ( 0, 2) (-1, 2)
L>0  ( 0, 0) (-1, 0) (-1,-1) ( 0, 2) (-1, 2)
0>L  ( 0, 0) ( 1, 0) ( 1, 1) ( 0,-2) ( 1,-2)
"""
I_KICKS = """
0>R  ( 0, 0) (-2, 0) ( 1, 0) (-2,-1) ( 1, 2)
R>0  ( 0, 0) ( 2, 0) (-1, 0) ( 2, 1) (-1,-2)
R>2  ( 0, 0) (-1, 0) ( 2, 0) (-1, 2) ( 2,-1)
2>R  ( 0, 0) ( 1, 0) (-2, 0) ( 1,-2) (-2, 1)
2>L  ( 0, 0) ( 2, 0) (-1, 0) ( 2, 1) (-1,-2)
L>2  ( 0, 0) (-2, 0) ( 1, 0) (-2,-1) ( 1, 2)
L>0  ( 0, 0) ( 1, 0) (-2, 0) ( 1,-2) (-2, 1)
0>L  ( 0, 0) (-1, 0) ( 2, 0) (-1, 2) ( 2,-1)
"""


def read_kicks(table: str) -> dict[tuple[int, int], tuple[tuple[int, int], ...]]:
    kicks = {}
    for line in table.strip().splitlines():
        numbers = [
            int(word)
            for word in line[3:].replace("(", " ").replace(")", " ").replace(",", " ").split()
        ]
        pairs = tuple(zip(numbers[::2], numbers[1::2], strict=True))
        kicks["0R2L".index(line[0]), "0R2L".index(line[2])] = pairs
    return kicks


@pytest.mark.parametrize("kind", "JLSTZ")
def test_five_pieces_share_one_kick_table(kind: Kind) -> None:
    assert KICKS[kind] == read_kicks(JLSTZ_KICKS)


def test_i_has_kicks_of_its_own_and_o_never_moves() -> None:
    assert KICKS["I"] == read_kicks(I_KICKS)
    assert all(tests == ((0, 0),) for tests in KICKS["O"].values())


def test_a_turn_and_the_turn_back_try_opposite_kicks() -> None:
    for kicks in KICKS.values():
        for (start, end), tests in kicks.items():
            assert kicks[end, start] == tuple((-x, -y) for x, y in tests)


def drawn(kind: Kind, turn: int, size: int) -> list[str]:
    cells = SHAPES[kind][turn]
    return [
        "".join("#" if (x, y) in cells else "." for x in range(size)) for y in reversed(range(size))
    ]


def test_t_turns_clockwise_in_its_box() -> None:
    assert [drawn("T", turn, 3) for turn in range(4)] == [
        [".#.", "###", "..."],
        [".#.", ".##", ".#."],
        ["...", "###", ".#."],
        [".#.", "##.", ".#."],
    ]


def test_i_turns_clockwise_about_the_middle_of_its_box() -> None:
    assert [drawn("I", turn, 4) for turn in range(4)] == [
        ["....", "####", "....", "...."],
        ["..#.", "..#.", "..#.", "..#."],
        ["....", "....", "####", "...."],
        [".#..", ".#..", ".#..", ".#.."],
    ]


def test_o_fills_the_same_cells_in_every_turn() -> None:
    assert len(set(SHAPES["O"])) == 1


@pytest.mark.parametrize(
    ("kind", "cells"),
    [
        ("I", {(3, 20), (4, 20), (5, 20), (6, 20)}),
        ("O", {(4, 20), (5, 20), (4, 21), (5, 21)}),
        ("T", {(3, 20), (4, 20), (5, 20), (4, 21)}),
        ("S", {(3, 20), (4, 20), (4, 21), (5, 21)}),
        ("Z", {(3, 21), (4, 21), (4, 20), (5, 20)}),
        ("J", {(3, 21), (3, 20), (4, 20), (5, 20)}),
        ("L", {(5, 21), (3, 20), (4, 20), (5, 20)}),
    ],
)
def test_pieces_enter_in_rows_20_and_21(kind: Kind, cells: set[tuple[int, int]]) -> None:
    assert set(Piece.entering(kind).cells) == cells


@pytest.mark.parametrize("kind", KINDS)
def test_bits_and_cells_agree_on_what_collides_everywhere_near_the_walls(kind: Kind) -> None:
    board = Board()
    for turn in range(4):
        for x in range(-4, 12):
            for y in range(-4, 40):
                piece = Piece(kind, x, y, turn)
                inside = all(0 <= cx < 10 and 0 <= cy < 40 for cx, cy in piece.cells)
                touching = any(-1 <= cx <= 10 and -5 <= cy < 44 for cx, cy in piece.cells)
                if inside or touching:
                    assert board.fits(piece) == inside, piece
