"""Turns with kicks, and the T-spins that come of them, drawn as boards."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tetris_games import rotated, set_up
from tetris.engine import moves
from tetris.engine.board import Board
from tetris.engine.events import Blocked, Locked, Rotated
from tetris.engine.game import Action, Config, Game
from tetris.engine.moves import Spin
from tetris.engine.pieces import KICKS, KINDS, Kicks, Kind, Piece
from tetris.engine.scoring import Clear


def played(picture: str, piece: Piece, *actions: Action) -> tuple[Clear, int]:
    """Return what the lock was worth, and the kick of the last turn."""
    game = Game(seed=1)
    set_up(game, Board.parse(picture), piece)
    events = game.update(0.0, actions)
    kicks = [event.kick for event in events if isinstance(event, Rotated)]
    (clear,) = [event.clear for event in events if isinstance(event, Locked)]
    return clear, kicks[-1] if kicks else -1


RIGHT, CW, DROP = Action.RIGHT, Action.ROTATE_CW, Action.HARD_DROP
TRIPLE = "J......... .......... .JJJJJJJJJ"  # its upper rows


@pytest.mark.parametrize(
    ("picture", "piece", "actions", "name", "points", "kick"),
    [
        # under an overhang, and without one
        ("...J...... JJJ...JJJJ JJJJ.JJJJJ", (3, 0, 1), [CW], "t-spin double", 1200, 0),
        ("JJJ...JJJJ JJJJ.JJJJJ", (3, 0, 1), [CW], "double", 1500, 0),
        # it clears nothing
        ("...J...... JJJ...JJJ. JJJJ.JJJJ.", (3, 0, 1), [CW], "t-spin", 400, 0),
        # in its place without a turn, and shifted after one
        ("........J. JJJJJJJ... JJJJJJJJ.J", (7, 0, 2), [], "double", 300, -1),
        ("......J... .......... ....J.J...", (2, 0, 3), [CW, RIGHT, RIGHT], "", 0, 0),
        # with one front corner only
        (".JJJJJJJJJ", (0, 0, 0), [CW], "mini t-spin single", 200, 1),
        # the fifth kick, which is a full spin with one front corner too
        (f"{TRIPLE} ..JJJJJJJJ .JJJJJJJJJ", (0, 2, 0), [CW], "t-spin triple", 1600, 4),
        (f"{TRIPLE} ..JJJJJJJJ ..JJJJJJJJ", (0, 2, 0), [CW], "t-spin double", 1200, 4),
    ],
)
def test_a_t_spin_is_judged_by_corners_and_kick(
    picture: str,
    piece: tuple[int, int, int],
    actions: list[Action],
    name: str,
    points: int,
    kick: int,
) -> None:
    x, y, turn = piece
    clear, last = played(picture, Piece("T", x, y, turn), *actions, DROP)
    assert (clear.name, clear.points, last) == (name, points, kick)


@pytest.mark.parametrize("after", [[Action.HARD_DROP], [Action.DOWN] * 4, []])  # []: gravity
def test_a_fall_after_the_turn_takes_the_spin_away(after: list[Action]) -> None:
    game = Game(seed=1)
    picture = """
        ..JJJJJJJJ
        ..JJJJJJJJ
        J.JJJJJJJJ
    """
    set_up(game, Board.parse(picture), Piece("T", x=0, y=4, turn=0))
    events = game.update(0.0, [Action.ROTATE_CCW, *after]) + game.update(5.0)
    locked = [event.clear.name for event in events if isinstance(event, Locked)]
    assert locked[0] == "double"  # with a spin's three corners, but it fell there


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


def test_a_drop_stops_on_the_first_block_below() -> None:
    board = Board.parse("""
        JJJ.......
        ..........
        JJJJJ.....
    """)
    assert moves.landed(board.bits, Piece("O", x=2, y=15)).y == 3
    assert moves.landed(board.bits, Piece("O", x=3, y=15)).y == 1
    assert moves.landed(board.bits, Piece("O", x=5, y=15)).y == 0


@given(
    st.sampled_from(KINDS),
    st.integers(0, 3),
    st.sampled_from(["srs", "srs+"]),
    st.sampled_from([CW, Action.ROTATE_CCW]),
    st.lists(st.text("..T", min_size=6, max_size=6), max_size=8),
)
@settings(max_examples=300)
def test_a_turn_takes_the_first_free_place_of_its_tests(
    kind: Kind, turn: int, kicks: Kicks, action: Action, rows: list[str]
) -> None:
    board, piece = Board.parse("\n".join(rows), 6), Piece(kind, 1, 3, turn)
    game = Game(1, Config(columns=6, kicks=kicks, gravity=False))
    set_up(game, board, piece)
    to = (turn + (1 if action is CW else 3)) % 4
    places = [Piece(kind, 1 + x, 3 + y, to) for x, y in KICKS[kicks][kind][turn, to]]
    free = [kick for kick, place in enumerate(places) if not board.bits & place.mask]
    game.update(0.0)
    (event,) = game.update(0.0, [action])
    if free:
        assert event == Rotated(0.0, places[free[0]], free[0], action)
    else:
        assert event == Blocked(0.0, action)
