"""Shapes, entrances and kicks, against numbers typed from the rule book."""

import copy
import pickle

import pytest

from tetris.engine.board import Board
from tetris.engine.pieces import KICKS as TABLES
from tetris.engine.pieces import KINDS, SHAPES, Kind, Piece

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
# TETR.IO's, as triangle.js (halp1/triangle, src/engine/utils/kicks/data.ts) has them; y points up.
I_KICKS_PLUS = """
0>R  ( 0, 0) ( 1, 0) (-2, 0) (-2,-1) ( 1, 2)
R>0  ( 0, 0) (-1, 0) ( 2, 0) (-1,-2) ( 2, 1)
R>2  ( 0, 0) (-1, 0) ( 2, 0) (-1, 2) ( 2,-1)
2>R  ( 0, 0) (-2, 0) ( 1, 0) (-2, 1) ( 1,-2)
2>L  ( 0, 0) ( 2, 0) (-1, 0) ( 2, 1) (-1,-2)
L>2  ( 0, 0) ( 1, 0) (-2, 0) ( 1, 2) (-2,-1)
L>0  ( 0, 0) ( 1, 0) (-2, 0) ( 1,-2) (-2, 1)
0>L  ( 0, 0) (-1, 0) ( 2, 0) ( 2,-1) (-1, 2)
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


def test_srs_plus_differs_from_srs_in_the_kicks_of_i_only() -> None:
    plus = TABLES["srs+"]
    assert plus["I"] == read_kicks(I_KICKS_PLUS)
    assert {kind: plus[kind] for kind in KINDS if kind != "I"} == {
        kind: KICKS[kind] for kind in KINDS if kind != "I"
    }


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
                    assert bool(board.bits & piece.mask) != inside, piece


def test_a_piece_knows_its_neighbours_and_its_turns() -> None:
    p = Piece("T", 3, 5)
    assert (p.left, p.right, p.below) == (Piece("T", 2, 5), Piece("T", 4, 5), Piece("T", 3, 4))
    clockwise, counterclockwise, *_ = p.turned
    assert clockwise[:2] == (Piece("T", 3, 5, 1), Piece("T", 2, 5, 1))
    assert counterclockwise[:2] == (Piece("T", 3, 5, 3), Piece("T", 4, 5, 3))
    assert (p.lowest_row, p.highest_row) == (6, 7)


def test_a_piece_can_be_copied_and_kept_in_a_file() -> None:
    piece = Piece("L", 2, 9, 3)
    assert piece.below.left.mask != piece.mask  # its neighbours are known by now
    for other in (copy.copy(piece), copy.deepcopy(piece), pickle.loads(pickle.dumps(piece))):
        assert (other, other.mask, hash(other)) == (piece, piece.mask, hash(piece))
    assert not hasattr(piece, "weight")


@pytest.mark.parametrize(("columns", "x"), [(10, 3), (9, 3), (8, 2), (5, 1), (4, 0)])
def test_on_narrow_boards_pieces_enter_in_the_middle_or_left_of_it(columns: int, x: int) -> None:
    assert Piece.entering("T", columns, rows=6) == Piece("T", x, 5)
