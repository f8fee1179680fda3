"""A game played by Aim in the application."""

from pathlib import Path

import pygame
import pytest

from controller.shared.protocol.messages import Command, ContactState, Telemetry
from host.connection.latency import EndToEndLatency
from host.connection.receiver import Delivered, Lost
from tests.support.app_window import FELT, FRAME_S, READY_S, Finger, Window, playing
from tetris.engine.game import Phase
from tetris.kit.settings import Settings, save
from tetris.window.menu_screen import MenuScreen


def press_command(name: str) -> Delivered:
    return Delivered(Command(name, "press", 0.99, (0.5, 2.7), 1), 0)


def columns(window: Window) -> list[int]:
    return sorted({x for x, _ in window.game.piece.cells})


def test_a_touched_column_a_deeper_press_and_the_upper_edge() -> None:
    window = playing()
    finger = Finger(window)
    finger.hold(0.4, 0.0, 8.0)
    assert columns(window)[0] == 0
    finger.hold(0.2, 0.0, 13.0)
    finger.lift()
    assert window.game.pieces_placed == 1
    assert window.game.board.rows[0][0] != "."
    finger.hold(0.4, 2.0, 8.0, y=4.3)
    finger.lift()
    assert window.game.hold is not None


def test_contacts_that_come_together_move_the_piece_once() -> None:
    window = playing()
    finger = Finger(window)
    finger.see(*[ContactState(1, 2.0, 2.0, 0.02, 8.0, 0.3, 1, 0.99)] * 5)
    one = columns(window)
    finger.hold(0.1, 2.0, 8.0)
    assert columns(window) == one


def test_all_steps_of_a_touch_are_one_command() -> None:
    window = playing()
    screen = window.app.stage.screen
    Finger(window).hold(0.4, 0.0, 8.0)
    assert window.app.game.game is not None
    assert screen.session.commands == 1  # type: ignore[union-attr]


def test_a_press_gives_no_command_where_the_orb_gives_contacts() -> None:
    window = playing()
    x = window.game.piece.x
    window.pass_s(0.1, press_command("left"))
    assert window.game.piece.x == x - 1  # this orb has given none: its buttons play
    assert window.app.orb.hint == window.app.words("aim.lacks")
    finger = Finger(window)
    finger.hold(0.1, 2.0, 8.0)
    finger.lift()
    window.pass_s(0.1, press_command("left"))
    assert window.app.orb.hint == window.app.words("aim.mouse")
    aimed = columns(window)
    window.pass_s(0.1, press_command("left"))
    assert columns(window) == aimed
    window.pass_s(1.0, Delivered(Command("drop", "pinch", 0.99, (2.0, 2.0), 1), 0))
    assert window.game.pieces_placed == 1  # a pinch has a place, too


@pytest.mark.parametrize(("age_ms", "key"), [(400, "aim.late"), (40, "aim.lacks")])
def test_contacts_that_a_busy_computer_drops_are_no_missing_estimate(age_ms: int, key: str) -> None:
    window = playing()
    ages = window.app.orb.latency = EndToEndLatency(lambda: 0, clock_ns=lambda: 10**9)
    ages.on_received([Delivered(FELT.message, 1000 - age_ms)] * 20)
    window.pass_s(0.1, press_command("left"))
    assert window.app.orb.hint == window.app.words(key)
    if key == "aim.late":
        ages.on_received([Delivered(FELT.message, 1000)] * 20)
        window.pass_s(0.1)
        assert window.app.orb.hint == ""  # known by the next touch


def test_the_player_may_choose_buttons_and_the_choice_is_kept(tmp_path: Path) -> None:
    save(tmp_path / "tetris.toml", Settings(control="buttons", mode="zen", orb_mode="zen",
                                            introduced=True))  # fmt: skip
    window = Window(config=tmp_path)
    window.key(pygame.K_RETURN, pygame.K_RETURN)
    window.pass_s(READY_S, FELT)
    x = window.game.piece.x
    Finger(window).hold(0.4, 0.0, 8.0)
    assert window.game.piece.x == x
    window.pass_s(0.1, press_command("left"))
    assert window.game.piece.x == x - 1


@pytest.mark.parametrize("lost", [True, False])
def test_a_finger_that_was_there_when_the_link_went_does_not_drop(lost: bool) -> None:
    window = playing()
    finger = Finger(window)
    finger.hold(0.4, 1.0, 8.0)
    if lost:
        window.pass_s(0.1, Lost("gone"))
    finger.hold(0.2, 1.0, 13.0)
    assert window.phase() is (Phase.PAUSED if lost else Phase.RUNNING)
    assert window.game.pieces_placed == (0 if lost else 1)


def test_in_a_menu_a_touch_chooses_the_item_that_lies_there() -> None:
    window = Window()
    window.pass_s(0.1, FELT)
    menu = window.app.stage.screen
    assert isinstance(menu, MenuScreen)
    finger = Finger(window)
    for y, item in ((4.0, 0), (-0.3, len(menu.menu.items) - 1), (2.0, len(menu.menu.items) // 2)):
        finger.hold(0.1, 2.0, 8.0, y)
        assert abs(menu.selected - item) <= 1
    finger.lift()
    chosen, values = menu.selected, [item.value for item in menu.menu.items]
    window.pass_s(0.1, press_command("left"))
    assert (menu.selected, [item.value for item in menu.menu.items]) == (chosen, values)


@pytest.mark.parametrize(("fingers", "key"), [(1, None), (2, "unclear")])
def test_a_touch_that_steered_is_no_unclear_press(fingers: int, key: str | None) -> None:
    """One of two fingers does nothing in the game without a gesture, and is explained."""
    window = playing()
    finger = Finger(window)
    pressed = Telemetry(1, bytes([160] * 25), (0.2, 0.7, 0, 0, 0), None, "", True, 40.0)
    contact = ContactState(1, 0.0, 2.0, 0.02, 8.0, 0.3, fingers, 0.99)
    for _ in range(20):
        window.pass_s(0.0, Delivered(pressed, 0))
        finger.see(contact)
        window.pass_s(FRAME_S)
    finger.lift()
    for _ in range(20):
        window.pass_s(0.025, FELT)
    reason = window.app.orb.reason_unanswered(window.now_s)
    assert (reason and reason.key) == key
