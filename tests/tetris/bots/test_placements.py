"""Every reachable placement: spins under overhangs, places to tuck into, and the inputs to each."""

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tetris_games import set_up
from tetris.bots.placements import find, path, paths
from tetris.engine.board import Board
from tetris.engine.events import Locked
from tetris.engine.game import Action, Config, Game
from tetris.engine.moves import Spin
from tetris.engine.pieces import KINDS, Kicks, Kind, Piece

L, R, D, DROP = Action.LEFT, Action.RIGHT, Action.DOWN, Action.HARD_DROP
CW, CCW = Action.ROTATE_CW, Action.ROTATE_CCW

T_SLOT = """
    ...J......
    JJJ...JJJJ
    JJJJ.JJJJJ
"""


def test_under_an_overhang_only_a_turn_reaches_the_slot() -> None:
    found = paths(Board.parse(T_SLOT).bits, Piece.entering("T"))
    slot = Piece("T", 3, 0, turn=2)
    assert [spin for piece, spin, _ in found if piece == slot] == [Spin.FULL]


def test_one_place_with_and_without_a_spin_is_two_placements() -> None:
    found = paths(Board.parse(".JJJJJJJJJ").bits, Piece.entering("T"))
    upright = Piece("T", -1, 0, turn=1)
    assert {spin for piece, spin, _ in found if piece == upright} == {Spin.NONE, Spin.MINI}


def test_a_piece_slides_under_a_roof_from_the_side() -> None:
    board = Board.parse("""
        JJJJJJJ...
        ..........
    """)
    lying = {(0, 0), (1, 0), (2, 0), (3, 0)}
    assert lying in [set(p.cells) for p in find(board.bits, Piece.entering("I"))]


def test_a_closed_hole_is_out_of_reach() -> None:
    board = Board.parse("""
        JJJJJJJJ..
        JJ....JJ.J
        JJJJJJJJ.J
    """)
    hole = {(2, 1), (3, 1), (4, 1), (5, 1)}
    assert hole not in [set(p.cells) for p in find(board.bits, Piece.entering("I"))]
    assert hole in [set(p.cells) for p in find(board.bits, Piece("I", 2, -1))]  # from inside


def test_the_fewest_inputs_to_a_spin_end_with_the_turn_and_a_drop() -> None:
    board = Board.parse(T_SLOT)
    start, slot = Piece("T", 3, 5), Piece("T", 3, 0, turn=2)
    way = path(board.bits, start, slot)
    assert way is not None
    assert way[-2:] in ((CW, DROP), (CCW, DROP))
    game = Game(seed=1)
    set_up(game, board, start)
    (locked,) = [event for event in game.update(0.0, way) if isinstance(event, Locked)]
    assert (locked.clear.name, set(locked.piece.cells)) == ("t-spin double", set(slot.cells))


def test_a_straight_drop_is_the_shortest_way_there_is() -> None:
    assert path(Board().bits, Piece("O", 4, 18), Piece("O", 4, 0)) == (DROP,)
    assert path(Board().bits, Piece("O", 4, 18), Piece("O", 7, 0)) == (R, R, R, DROP)


def test_there_is_no_way_to_a_place_out_of_reach() -> None:
    assert path(Board().bits, Piece("O", 4, 18), Piece("O", 4, 5)) is None


boards = st.integers(4, 10).flatmap(
    lambda columns: st.lists(st.text("..#", min_size=columns, max_size=columns), max_size=9).map(
        lambda rows: Board.parse("\n".join(rows), columns)
    )
)
tables = st.sampled_from(("srs", "srs+"))


def check(bits: int, start: Piece, kicks: Kicks) -> None:
    """Compare flooding with what is found a step at a time."""
    filled = [piece.mask for piece in find(bits, start, kicks)]
    walked = [(piece.mask, spin) for piece, spin, _ in paths(bits, start, kicks)]
    assert len(filled) == len(set(filled))
    assert len(walked) == len(set(walked))
    assert set(filled) == {mask for mask, _ in walked}


@given(boards, st.sampled_from(KINDS), tables)
@settings(max_examples=100, deadline=None)
def test_flooding_finds_what_walking_finds(board: Board, kind: Kind, kicks: Kicks) -> None:
    check(board.bits, Piece.entering(kind, board.columns), kicks)


@given(boards, st.sampled_from(KINDS), tables, st.integers(-2, 8), st.integers(-2, 9), st.data())
@settings(max_examples=100, deadline=None)
def test_a_piece_deep_in_the_stack_finds_its_way_too(
    board: Board, kind: Kind, kicks: Kicks, x: int, y: int, data: st.DataObject
) -> None:
    start = Piece(kind, x, y, data.draw(st.integers(0, 3)))
    if not board.bits & start.mask:
        check(board.bits, start, kicks)


@given(boards, st.sampled_from(KINDS), tables, st.data())
@settings(max_examples=60, deadline=None)
def test_inputs_lead_to_places(board: Board, kind: Kind, kicks: Kicks, data: st.DataObject) -> None:
    start = Piece.entering(kind, board.columns)
    place, spin, way = data.draw(st.sampled_from([*paths(board.bits, start, kicks)]))
    ways = [w for piece, _, w in paths(board.bits, start, kicks) if piece.mask == place.mask]
    assert path(board.bits, start, place, kicks) == ways[0]
    game = Game(1, Config(columns=board.columns, kicks=kicks))
    set_up(game, Board.parse(str(board), board.columns), start)
    (locked,) = [e for e in game.update(0.0, way) if isinstance(e, Locked)]
    assert (set(locked.piece.cells), locked.clear.spin) == (set(place.cells), spin)
