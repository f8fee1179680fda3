"""A game in the application: by the orb, by keys, and while the orb is away."""

from dataclasses import replace

import pygame
import pytest

from controller.shared.protocol.messages import Contacts, Correction, State
from host.actions import ACTIONS
from host.connection.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from tests.support.app_window import FELT, WELCOME, Window, playing, said
from tetris.engine.game import Phase
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import RESUME_S


def held(*names: str) -> Delivered:
    return Delivered(State(names), 0)


@pytest.mark.parametrize("command", ACTIONS)
def test_each_command_acts(command: str) -> None:
    window = playing()

    def seen() -> tuple[object, ...]:
        game = window.game
        return game.piece, game.pieces_placed, game.hold, game.phase

    before = seen()
    window.pass_s(0.0, said(command))
    assert seen() != before


@pytest.mark.parametrize("end", [Stale(), Lost("gone"), held()])
def test_nothing_repeats_after_a_gesture_has_ended_or_the_orb_has_gone(end: Received) -> None:
    window = playing()
    window.pass_s(0.1, said("left"), held("left"))
    window.pass_s(0.1, end)
    x = window.game.piece.x
    window.pass_s(RESUME_S + 2.0, Connected(WELCOME))
    assert window.game.piece.x == x


def test_a_held_down_lowers_the_piece_fast() -> None:
    window = playing()
    y = window.game.piece.y
    window.pass_s(0.3, said("down"), held("down"))
    assert y - window.game.piece.y == 1
    window.pass_s(0.4)
    assert y - window.game.piece.y > 3


def pages(window: Window) -> str:
    """Return the title and the sentence of the menu that is seen; "" for none."""
    screen = window.app.stage.screen
    return f"{screen.menu.title} {screen.menu.notice}" if isinstance(screen, MenuScreen) else ""


@pytest.mark.parametrize(("end", "reason"), [(Stale(), "orb.silent"), (Lost("x"), "orb.lost")])
def test_a_pause_that_the_link_made_says_why(end: Received, reason: str) -> None:
    window = playing()
    window.pass_s(0.1, end)
    assert window.app.stage.look.words(reason) in pages(window)


@pytest.mark.parametrize(
    ("end", "back"), [(Stale(), FELT), (Lost("the cable is out"), Connected(WELCOME))]
)
def test_the_first_word_after_a_silence_goes_on_and_invents_nothing(
    end: Received, back: Received
) -> None:
    window = playing()
    piece = window.game.piece
    window.pass_s(0.1, end)
    assert (window.phase(), window.playing) == (Phase.PAUSED, False)
    window.pass_s(RESUME_S + 0.1, back)
    assert window.phase() is Phase.RUNNING
    assert window.game.piece == piece


def test_the_player_may_go_on_by_keyboard_without_the_orb() -> None:
    window = playing()
    window.pass_s(0.1, Lost("gone"))
    window.key(pygame.K_ESCAPE)
    window.pass_s(RESUME_S, Refused("still gone"))
    assert window.phase() is Phase.RUNNING
    window.pass_s(0.1, Connected(WELCOME))
    assert window.phase() is Phase.RUNNING


def test_a_game_is_played_by_keyboard_before_any_orb_is_there() -> None:
    window = playing(welcome=None)
    x = window.game.piece.x
    window.key(pygame.K_LEFT)
    assert window.game.piece.x == x - 1


def test_a_drop_meant_for_the_last_piece_does_not_start_another_game() -> None:
    window = playing()
    while window.phase() is not Phase.OVER:
        window.pass_s(0.1, said("drop"))
    window.pass_s(0.5, said("drop"))
    assert window.playing
    assert window.phase() is Phase.OVER
    window.pass_s(1.5)  # a menu covers the board
    window.pass_s(0.1, said("drop"))
    assert window.phase() is Phase.RUNNING


def test_a_window_that_loses_the_focus_lifts_the_finger_and_pauses() -> None:
    window = playing()
    window.app.touch.press(2.0, 2.0, window.now_s)
    assert window.contacts() != [Contacts(())]
    window.hold_key(pygame.K_DOWN)
    window.app.handle(pygame.event.Event(pygame.WINDOWFOCUSLOST), window.now_s)
    assert window.contacts() == [Contacts(())]
    window.pass_s(0.1)
    assert window.phase() is Phase.PAUSED


def test_fingers_are_lifted_for_good_when_the_link_goes() -> None:
    window = playing()
    window.app.touch.press(2.0, 2.0, window.now_s)
    assert len(window.contacts()) == 1
    window.pass_s(0.1, Stale())
    assert window.contacts() == []
    window.pass_s(0.1, FELT)
    assert window.contacts() == [Contacts(())]
    assert window.contacts() == []


def test_a_real_orb_takes_no_contacts_from_the_mouse() -> None:
    window = playing(replace(WELCOME, virtual=False))
    window.app.touch.press(2.0, 2.0, window.now_s)
    assert window.contacts() == []


def test_a_correction_with_alt_turns_nothing_and_control_turns_at_once() -> None:
    window = playing()
    for code in (pygame.K_1, pygame.K_9, pygame.K_0, pygame.K_BACKSPACE):
        window.hold_key(pygame.K_LALT)
        window.hold_key(code, mod=pygame.KMOD_LALT)
        window.hold_key(code, down=False, mod=pygame.KMOD_LALT)
        window.hold_key(pygame.K_LALT, down=False)
        window.pass_s(0.1)
        assert window.game.piece.turn == 0
    sent = [one for one in window.app.outgoing(window.now_s) if isinstance(one, Correction)]
    assert sent == [Correction("press"), Correction("null"), Correction("")]
    window.hold_key(pygame.K_LCTRL)
    window.pass_s(0.0)
    assert window.game.piece.turn == 3


@pytest.mark.parametrize("size", [(1280, 720), (640, 360), (500, 900), (2560, 1080), (1, 1)])
def test_a_window_of_any_size_is_painted_all_over(size: tuple[int, int]) -> None:
    window = playing()
    for news in ((said("left"),), (Stale(),), (Lost("gone"),)):
        window.pass_s(0.1, *news)
        first, second = pygame.Surface(size), pygame.Surface(size)
        second.fill("magenta")  # of what was there before, nothing is left
        for surface in (first, second):
            window.app.draw(surface)
        assert pygame.image.tobytes(first, "RGB") == pygame.image.tobytes(second, "RGB")


def test_a_held_pinch_leaves_a_page_that_takes_gestures_for_itself() -> None:
    window = Window()
    window.pass_s(0.1, FELT)
    before = window.app.stage.screen
    window.app.handle(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_F2), window.now_s)
    window.pass_s(0.5, FELT)
    assert window.app.stage.screen is not before
    window.pass_s(0.1, said("drop"), Delivered(State(("drop",)), 0))
    window.pass_s(1.5, FELT)
    assert window.app.stage.screen is not before
    window.pass_s(1.0, FELT)
    assert window.app.stage.screen is before


def test_a_drag_within_one_picture_ends_where_the_mouse_let_go() -> None:
    window = Window()
    window.app.outgoing(window.now_s)
    to_screen = window.app.panel.projection.to_screen
    places = [to_screen(x, 2.0) for x in (1.0, 3.0)]
    kinds = (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP)
    for kind, place in zip(kinds, places, strict=True):
        window.now_s += 0.1
        window.app.handle(pygame.event.Event(kind, pos=place, button=1), window.now_s)
        sent = [each for each in window.app.outgoing(window.now_s) if isinstance(each, Contacts)]
    last, lifted = sent
    assert last.contacts[0].x == pytest.approx(3.0, abs=0.05)
    assert lifted.contacts == ()
