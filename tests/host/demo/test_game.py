"""The demo's game: what becomes of commands."""

from controller.shared.protocol.messages import State
from host.connection.receiver import Connected, Delivered
from host.demo.demo import AGAIN_S, DemoGame
from tests.support.app_window import FELT, WELCOME, said
from tetris.engine.game import Phase


def playing() -> DemoGame:
    demo = DemoGame(seed=1)
    demo.tick(0.0, [Connected(WELCOME)])
    return demo


def test_commands_act_on_the_piece() -> None:
    demo = playing()
    x = demo.game.piece.x
    demo.tick(0.01, [FELT, said("left"), said("unheard_of")])
    assert demo.game.piece.x == x - 1
    demo.tick(0.02, [said("drop")])
    assert demo.game.pieces_placed == 1


def test_a_held_gesture_repeats_as_a_held_key_until_it_ends() -> None:
    demo = playing()
    x = demo.game.piece.x
    demo.tick(0.1, [said("right"), Delivered(State(("right",)), 0)])
    demo.tick(0.2, [])
    assert demo.game.piece.x == x + 1
    demo.tick(0.6, [])
    assert (wall := demo.game.piece.x) > x + 1
    demo.tick(0.7, [Delivered(State(()), 0)])
    demo.tick(0.8, [said("left")])
    demo.tick(2.0, [])
    assert demo.game.piece.x == wall - 1


def test_drop_starts_another_game_but_not_right_after_the_last() -> None:
    demo = playing()
    now_s = 0.0
    while demo.game.phase is not Phase.OVER:
        now_s += 0.01
        demo.tick(now_s, [said("drop")])
    demo.tick(now_s + AGAIN_S / 2, [said("drop")])
    assert demo.game.phase is Phase.OVER
    demo.tick(now_s + AGAIN_S * 1.1, [said("drop")])
    assert (demo.game.phase, demo.game.pieces_placed) == (Phase.RUNNING, 0)
