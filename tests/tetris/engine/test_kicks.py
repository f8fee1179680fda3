"""Turns drawn: before on the left, after on the right, the piece in small letters.

A quarter turn tries five places in order and takes the first that is free. Each drawing has the
fewest blocks that make it the place in its title.
"""

import pytest

from tests.support.tetris_games import rotated
from tetris.engine.board import Board
from tetris.engine.pieces import KINDS, Kind, Piece

COLUMNS = 6

DRAWINGS = {
    "t, clockwise, first place: where it is": """
        ......    ......
        ...t..    ...t..
        ..ttt.    ...tt.
        ......    ...t..
        ......    ......
    """,
    "t, clockwise, second place: a column to the left": """
        ......    ......
        ...t..    ..t...
        ..ttt.    ..tt..
        ...#..    ..t#..
        ......    ......
    """,
    "t, clockwise, third place: and a row up": """
        ......    ..t...
        ...t..    ..tt..
        ..ttt.    ..t...
        ..##..    ..##..
        ......    ......
    """,
    "l, clockwise, fourth place: two rows down": """
        ......    ......
        ..#.l.    ..#...
        ..lll.    ......
        ....#.    ...l#.
        ......    ...l..
        ......    ...ll.
    """,
    "t, clockwise, fifth place: two rows down, and a column to the left": """
        ......    ......
        ..#t..    ..#...
        ..ttt.    ......
        ...#..    ..t#..
        ......    ..tt..
        ......    ..t...
    """,
    "i, clockwise, first place: where it is": """
        ......    ......
        ......    ...i..
        .iiii.    ...i..
        ......    ...i..
        ......    ...i..
        ......    ......
    """,
    "i, clockwise, second place: two columns to the left": """
        ......    ......
        ......    .i....
        .iiii.    .i....
        ...#..    .i.#..
        ......    .i....
        ......    ......
    """,
    "i, clockwise, third place: a column to the right": """
        ......    ......
        ......    ....i.
        .iiii.    ....i.
        ...#..    ...#i.
        .#....    .#..i.
        ......    ......
    """,
    "i, clockwise, fourth place: two columns to the left, a row down": """
        ......    ......
        .#....    .#....
        .iiii.    .i....
        ....#.    .i..#.
        ...#..    .i.#..
        ......    .i....
    """,
    "i, clockwise, fifth place: a column to the right, two rows up": """
        ......    ....i.
        ......    ....i.
        ......    ....i.
        .iiii.    ....i.
        ...##.    ...##.
        .#....    .#....
    """,
}


def halves(drawing: str) -> tuple[list[str], list[str]]:
    words = drawing.split()
    return words[::2], words[1::2]


def blocks(rows: list[str]) -> Board:
    free = str.maketrans("iotszjl", ".......")
    return Board.parse("\n".join(rows).translate(free), COLUMNS)


def cells(rows: list[str]) -> set[tuple[int, int]]:
    drawn = enumerate(reversed(rows))
    return {(x, y) for y, row in drawn for x, mark in enumerate(row) if mark.islower()}


def entered(rows: list[str]) -> Piece:
    """Return the piece as it entered, turned by nothing, at the drawn cells."""
    (letter,) = {mark.upper() for row in rows for mark in row if mark.islower()}
    kind: Kind = next(kind for kind in KINDS if kind == letter)
    places = (Piece(kind, x, y) for x in range(-2, COLUMNS) for y in range(-2, len(rows)))
    return next(piece for piece in places if set(piece.cells) == cells(rows))


@pytest.mark.parametrize("title", DRAWINGS)
def test_a_turn_takes_the_first_free_place_of_five(title: str) -> None:
    before, after = halves(DRAWINGS[title])
    turned = rotated(blocks(before).bits, entered(before))
    assert turned is not None
    piece, kick = turned
    assert set(piece.cells) == cells(after)
    assert kick == ("first", "second", "third", "fourth", "fifth").index(title.split()[2])


def test_where_all_five_are_taken_there_is_no_turn() -> None:
    shaft = blocks(["#.####"] * 6)
    assert rotated(shaft.bits, Piece("I", -1, 0, turn=1)) is None
