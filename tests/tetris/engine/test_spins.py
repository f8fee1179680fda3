"""Turns with kicks, and the T-spins that come of them, drawn as boards."""

import pytest

from tests.support.tetris_games import rotated
from tetris.engine import moves
from tetris.engine.board import Board
from tetris.engine.events import Locked, Rotated
from tetris.engine.game import Action, Game
from tetris.engine.moves import Spin
from tetris.engine.pieces import Piece
from tetris.engine.scoring import Clear


def played(picture: str, piece: Piece, *actions: Action) -> tuple[Clear, int]:
    """Return what the lock was worth, and the kick of the last turn."""
    game = Game(seed=1)
    game.set_up(Board.parse(picture), piece)
    events = game.update(0.0, actions)
    kicks = [event.kick for event in events if isinstance(event, Rotated)]
    (clear,) = [event.clear for event in events if isinstance(event, Locked)]
    return clear, kicks[-1] if kicks else -1


def test_a_t_turned_under_an_overhang_is_a_t_spin_double() -> None:
    clear, kick = played(
        """
        ...J......
        JJJ...JJJJ
        JJJJ.JJJJJ
        """,
        Piece("T", x=3, y=0, turn=1),
        Action.ROTATE_CW,
        Action.HARD_DROP,
    )
    assert (clear.name, clear.points, kick) == ("t-spin double", 1200, 0)


def test_without_the_overhang_the_same_turn_is_an_ordinary_double() -> None:
    clear, _ = played(
        """
        JJJ...JJJJ
        JJJJ.JJJJJ
        """,
        Piece("T", x=3, y=0, turn=1),
        Action.ROTATE_CW,
        Action.HARD_DROP,
    )
    assert clear.name == "double"


def test_a_t_that_was_shifted_into_its_place_is_no_t_spin() -> None:
    clear, _ = played(
        """
        ........J.
        JJJJJJJ...
        JJJJJJJJ.J
        """,
        Piece("T", x=7, y=0, turn=2),
        Action.HARD_DROP,
    )
    assert clear.name == "double"


@pytest.mark.parametrize("after", [[Action.HARD_DROP], [Action.DOWN] * 4, []])  # []: gravity
def test_a_fall_after_the_turn_takes_the_spin_away(after: list[Action]) -> None:
    game = Game(seed=1)
    picture = """
        ..JJJJJJJJ
        ..JJJJJJJJ
        J.JJJJJJJJ
    """
    game.set_up(Board.parse(picture), Piece("T", x=0, y=4, turn=0))
    events = game.update(0.0, [Action.ROTATE_CCW, *after]) + game.update(5.0)
    locked = [event.clear.name for event in events if isinstance(event, Locked)]
    assert locked[0] == "double"  # with a spin's three corners, but it fell there


def test_a_shift_after_the_turn_takes_the_spin_away() -> None:
    clear, _ = played(
        """
        ......J...
        ..........
        ....J.J...
        """,
        Piece("T", x=2, y=0, turn=3),
        Action.ROTATE_CW,
        Action.RIGHT,
        Action.RIGHT,
        Action.HARD_DROP,
    )
    assert (clear.name, clear.points) == ("", 0)


def test_with_one_front_corner_only_it_is_a_mini() -> None:
    clear, kick = played(
        ".JJJJJJJJJ",
        Piece("T", x=0, y=0, turn=0),
        Action.ROTATE_CW,
        Action.HARD_DROP,
    )
    assert (clear.name, clear.points, kick) == ("mini t-spin single", 200, 1)


def test_the_fifth_kick_reaches_a_t_spin_triple() -> None:
    clear, kick = played(
        """
        J.........
        ..........
        .JJJJJJJJJ
        ..JJJJJJJJ
        .JJJJJJJJJ
        """,
        Piece("T", x=0, y=2, turn=0),
        Action.ROTATE_CW,
        Action.HARD_DROP,
    )
    assert (clear.name, clear.points, kick) == ("t-spin triple", 1600, 4)


def test_a_fifth_kick_is_a_full_spin_with_one_front_corner_too() -> None:
    clear, kick = played(
        """
        J.........
        ..........
        .JJJJJJJJJ
        ..JJJJJJJJ
        ..JJJJJJJJ
        """,
        Piece("T", x=0, y=2, turn=0),
        Action.ROTATE_CW,
        Action.HARD_DROP,
    )
    assert (clear.name, clear.points, kick) == ("t-spin double", 1200, 4)


def test_a_t_spin_that_clears_nothing_pays_400() -> None:
    clear, _ = played(
        """
        ...J......
        JJJ...JJJ.
        JJJJ.JJJJ.
        """,
        Piece("T", x=3, y=0, turn=1),
        Action.ROTATE_CW,
        Action.HARD_DROP,
    )
    assert (clear.name, clear.points) == ("t-spin", 400)


def test_only_t_spins_count() -> None:
    board = Board.parse("""
        ...J......
        JJJ...JJJJ
        JJJJ.JJJJJ
    """)
    assert moves.spin(board.bits, Piece("S", 3, 0, 2), 0) is Spin.NONE


def test_an_upright_i_at_the_wall_kicks_away_from_it() -> None:
    turned = rotated(Board().bits, Piece("I", x=-2, y=5, turn=1))
    assert turned == (Piece("I", x=0, y=5, turn=2), 2)


def test_a_turn_with_no_room_for_any_kick_is_refused() -> None:
    board = Board.parse("""
        JJJJ.JJJJJ
        JJJJ.JJJJJ
        JJJJ.JJJJJ
        JJJJ.JJJJJ
        JJJJ.JJJJJ
        JJJJ.JJJJJ
        JJJJ.JJJJJ
    """)
    assert rotated(board.bits, Piece("I", x=2, y=0, turn=1)) is None


@pytest.mark.parametrize(("dx", "free"), [(-1, False), (1, True)])
def test_a_shift_stops_at_the_wall(dx: int, free: bool) -> None:
    piece = Piece("O", x=0, y=0)
    assert (moves.shifted(Board().bits, piece, dx) is not None) == free


def test_a_drop_stops_on_the_first_block_below() -> None:
    board = Board.parse("""
        JJJ.......
        ..........
        JJJJJ.....
    """)
    assert moves.landed(board.bits, Piece("O", x=2, y=15)).y == 3
    assert moves.landed(board.bits, Piece("O", x=3, y=15)).y == 1
    assert moves.landed(board.bits, Piece("O", x=5, y=15)).y == 0
