"""Tetris as a target: what comes over the link, and what becomes of it in the game."""

import os
from collections.abc import Sequence
from dataclasses import replace
from itertools import count

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import pygame
import pytest

from controller.protocol import messages
from controller.protocol.messages import (
    COMMANDS,
    Command,
    Contacts,
    State,
    Telemetry,
    Welcome,
)
from host import targets
from host import window_loop as loop
from host.connection.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from host.connection.transport import LinkError
from host.targets.tetris import AGAIN_S, TetrisTarget
from tetris.engine.game import Action, Phase
from tetris.window.settings import Settings

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
WELCOME = Welcome(1, 7, "virtual-1", "OrbTouch", True, 5, 5, 10.0, 10.0, 100, 300, LABELS, COMMANDS)
FELT = Delivered(Telemetry(1, bytes([128] * 25), (1.0, 0, 0, 0, 0), None, "", True, 10.0), 0)


def said(name: str) -> Delivered:
    return Delivered(Command(name, "press", 0.99, None, 1), 0)


def playing() -> TetrisTarget:
    target = TetrisTarget(seed=1)
    target.tick(0.0, [Connected(WELCOME)])
    return target


def test_each_command_of_the_orb_acts_on_the_piece() -> None:
    target = playing()
    x = target.game.piece.x
    target.tick(0.01, [said("left")])
    assert target.game.piece.x == x - 1
    target.tick(0.02, [said("right"), said("right")])
    assert target.game.piece.x == x + 1
    y = target.game.piece.y
    target.tick(0.03, [said("down")])
    assert target.game.piece.y == y - 1
    target.tick(0.04, [said("drop")])
    assert target.game.pieces_placed == 1
    target.tick(0.05, [said("hold")])
    assert target.game.hold is not None


def held(*names: str) -> Delivered:
    return Delivered(State(names), 0)


def columns(target: TetrisTarget, until_s: float, from_s: float) -> list[int]:
    """Columns of the piece at each of sixty ticks a second."""
    found = []
    for tick in range(round(from_s * 60), round(until_s * 60)):
        target.tick(tick / 60)
        found.append(target.game.piece.x)
    return found


def test_a_held_gesture_repeats_as_a_held_key_until_it_ends() -> None:
    target = playing()
    x = target.game.piece.x
    target.tick(0.0, [said("left"), held("left")])
    # At 10 Hz ten frames are waited beside the game's own 167 ms, then every 33 ms.
    assert set(columns(target, 1.15, 0.02)) == {x - 1}
    assert columns(target, 1.25, 1.16)[-1] == x - 3
    target.tick(1.26, [held()])
    assert len(set(columns(target, 2.0, 1.27))) == 1


@pytest.mark.parametrize("end", [Stale(), Lost("gone"), held()])
def test_nothing_repeats_after_the_orb_has_gone(end: Received) -> None:
    target = playing()
    target.tick(0.0, [said("right"), held("right")])
    target.tick(0.1, [end])
    x = target.game.piece.x
    target.tick(2.0, [Connected(WELCOME)])
    assert set(columns(target, 3.0, 2.1)) == {x}


def test_a_held_down_lowers_the_piece_fast() -> None:
    target = playing()
    target.tick(0.0, [said("down"), held("down")])
    y = target.game.piece.y
    columns(target, 1.15, 0.02)
    assert y - target.game.piece.y <= 1
    columns(target, 1.5, 1.16)
    assert y - target.game.piece.y > 3


def test_tick_tells_which_command_became_which_action() -> None:
    target = playing()
    ticked = target.tick(0.01, [FELT, said("left"), said("unheard_of"), said("rotate_cw")])
    assert [action for _, action in ticked.acted] == [Action.LEFT, Action.ROTATE_CW]
    assert [command.name for command, _ in ticked.acted] == ["left", "rotate_cw"]


def test_lost_link_pauses_the_game_and_says_why() -> None:
    target = playing()
    target.tick(0.1, [Stale()])
    assert target.game.phase is Phase.PAUSED
    assert target.reason == "the orb is silent"
    target.tick(0.8, [Lost("port: nothing came for 1 s")])
    assert target.game.phase is Phase.PAUSED
    assert target.reason == "the link to the orb is lost"
    assert target.orb.reason == "port: nothing came for 1 s"


def test_link_back_goes_on_and_nothing_is_repeated_or_invented() -> None:
    target = playing()
    target.tick(0.1, [said("left")])
    x, y = target.game.piece.x, target.game.piece.y
    target.tick(0.2, [Stale()])
    target.tick(1.0, [Lost("gone")])
    target.tick(60.0, [Refused("still gone")])
    ticked = target.tick(90.0, [Connected(WELCOME)])
    assert target.game.phase is Phase.RUNNING
    assert ticked.acted == ()
    assert (target.game.piece.x, target.game.piece.y) == (x, y)
    assert target.reason == ""


def test_first_word_after_a_short_silence_goes_on() -> None:
    target = playing()
    target.tick(0.1, [Stale()])
    target.tick(0.5, [FELT])
    assert target.game.phase is Phase.RUNNING


def test_pause_of_the_player_outlasts_the_loss_of_the_link() -> None:
    target = playing()
    target.tick(0.1, [said("pause")])
    target.tick(0.2, [Stale(), Lost("gone")])
    assert target.reason == ""
    target.tick(0.3, [Connected(WELCOME)])
    assert target.game.phase is Phase.PAUSED


def test_player_may_go_on_by_keyboard_without_the_orb() -> None:
    target = playing()
    target.tick(0.1, [Stale()])
    target.tick(0.2, [], [Action.PAUSE])
    assert target.game.phase is Phase.RUNNING
    target.tick(1.0, [Lost("gone"), Refused("still gone")])
    assert target.game.phase is Phase.RUNNING
    target.tick(2.0, [Connected(WELCOME)])
    assert target.game.phase is Phase.RUNNING


def test_game_is_played_by_keyboard_before_any_orb_is_there() -> None:
    target = TetrisTarget(seed=1)
    x = target.game.piece.x
    target.tick(0.0, [])
    target.handle(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_LEFT), 0.0)
    target.tick(0.01, [Refused("no orb yet")])
    assert target.game.piece.x == x - 1
    assert target.game.phase is Phase.RUNNING


def test_drop_starts_another_game_but_not_right_after_the_last() -> None:
    target = playing()
    now_s = 0.0
    while target.game.phase is not Phase.OVER:
        now_s += 0.01
        target.tick(now_s, [said("drop")])
    placed = target.game.pieces_placed
    target.tick(now_s + AGAIN_S / 2, [said("drop")])
    assert target.game.pieces_placed == placed
    ticked = target.tick(now_s + AGAIN_S * 1.1, [said("drop")])
    assert [action for _, action in ticked.acted] == [Action.RESTART]
    assert target.game.pieces_placed == 0


def test_mouse_in_the_window_presses_the_virtual_orb() -> None:
    pygame.display.init()
    surface = pygame.display.set_mode((1280, 720))
    target = playing()
    target.tick(0.1, [FELT])
    target.draw(surface)
    on_dome = on_screen(target, 0.5, 2.0)
    target.handle(pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=1, pos=on_dome), 0.1)
    (contacts,) = target.outgoing(0.1)
    assert isinstance(contacts, Contacts)
    (contact,) = contacts.contacts
    assert (contact.x, contact.y) == pytest.approx((0.5, 2.0), abs=0.03)
    target.handle(pygame.event.Event(pygame.MOUSEBUTTONUP, button=1, pos=on_dome), 0.2)
    assert target.outgoing(0.2) == [Contacts(())]


def test_window_that_loses_the_focus_lifts_the_finger_and_the_keys() -> None:
    pygame.display.init()
    surface = pygame.display.set_mode((1280, 720))
    target = playing()
    target.draw(surface)
    target.handle(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_DOWN), 0.0)
    at = on_screen(target, 2.0, 2.0)
    target.handle(pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=3, pos=at), 0.0)
    assert len(target.outgoing(0.0)) == 1
    target.handle(pygame.event.Event(pygame.WINDOWFOCUSLOST), 0.1)
    assert target.outgoing(0.1) == [Contacts(())]
    assert not target.keys.soft_drop


def key(target: TetrisTarget, code: int, *, down: bool = True) -> None:
    kind = pygame.KEYDOWN if down else pygame.KEYUP
    target.handle(pygame.event.Event(kind, key=code, mod=pygame.KMOD_LCTRL), 0.0)


def test_control_turns_the_piece_when_it_comes_up() -> None:
    target = playing()
    key(target, pygame.K_LCTRL)
    target.tick(0.1)
    assert target.game.piece.turn == 0
    key(target, pygame.K_LCTRL, down=False)
    target.tick(0.2)
    assert target.game.piece.turn == 3
    assert Action.ROTATE_CCW not in target.keys.held


def test_a_correction_with_control_turns_nothing() -> None:
    target = playing()
    for code in (pygame.K_1, pygame.K_9, pygame.K_0, pygame.K_BACKSPACE):
        key(target, pygame.K_LCTRL)
        key(target, code)
        key(target, code, down=False)
        key(target, pygame.K_LCTRL, down=False)
        target.tick(0.1)
        assert target.game.piece.turn == 0
    assert target.outgoing(0.1) == [messages.Correction("")]  # the newest counts


def test_control_turns_before_the_key_that_follows_it_acts() -> None:
    target = playing()
    key(target, pygame.K_LCTRL)
    key(target, pygame.K_c)
    assert target.keys.poll(0.0) == [Action.ROTATE_CCW, Action.HOLD]


def test_control_that_moves_the_piece_moves_it_at_once() -> None:
    keys = {"left": ("lctrl",)}
    target = TetrisTarget(seed=1, settings=Settings(keys=keys))
    target.tick(0.0, [Connected(WELCOME)])
    key(target, pygame.K_LCTRL)
    assert target.keys.poll(0.0) == [Action.LEFT]


def test_fingers_are_lifted_for_good_when_the_link_goes() -> None:
    target = playing()
    target.touch.press(2.0, 2.0, 0.0)
    assert len(target.outgoing(0.0)) == 1
    target.tick(0.1, [Stale()])
    assert target.outgoing(0.1) == []
    target.tick(0.2, [FELT])
    assert target.outgoing(0.2) == [Contacts(())]
    assert target.outgoing(0.3) == []


def test_real_orb_takes_no_contacts_from_the_mouse() -> None:
    target = TetrisTarget(seed=1)
    target.tick(0.0, [Connected(replace(WELCOME, virtual=False))])
    target.touch.press(2.0, 2.0, 0.0)
    assert target.outgoing(0.0) == []


@pytest.mark.parametrize("size", [(1280, 720), (640, 360), (500, 900), (2560, 1080), (1, 1)])
def test_window_of_any_size_is_painted_all_over_in_every_phase(size: tuple[int, int]) -> None:
    pygame.display.init()
    pygame.display.set_mode(size)
    target = TetrisTarget(seed=1)
    story: list[list[Received]] = [[], [Connected(WELCOME)], [FELT], [said("left")]]
    story += [[Stale()], [Lost("gone")]]
    for number, news in enumerate(story):
        target.tick(number / 10, news)
        first, second = pygame.Surface(size), pygame.Surface(size)
        second.fill("magenta")  # of what was there before, nothing is left
        target.draw(first)
        target.draw(second)
        assert pygame.image.tobytes(first, "RGB") == pygame.image.tobytes(second, "RGB")


def test_targets_are_found_by_name() -> None:
    assert targets.names() == ("gamepad", "keyboard", "tetris")
    assert isinstance(targets.load("tetris"), TetrisTarget)
    with pytest.raises(targets.TargetError, match="there is no target 'chess'"):
        targets.load("chess")


class FakeReceiver:
    """A link whose news are written down beforehand, a list for each frame of the window."""

    def __init__(self, *news: Sequence[Received]) -> None:
        self.news = list(news)
        self.sent: list[messages.Message] = []

    def poll(self) -> list[Received]:
        return list(self.news.pop(0)) if self.news else []

    def send(self, message: messages.Message) -> None:
        self.sent.append(message)

    def wait(self, timeout_s: float) -> None: ...


def test_loop_plays_until_its_time_is_up() -> None:
    surface = loop.window(headless=True)
    target = TetrisTarget(seed=1)
    clock = iter(range(100))
    receiver = FakeReceiver([Connected(WELCOME)], [FELT], [said("drop")])
    loop.play(target, receiver, surface, seconds=5, clock=lambda: float(next(clock)))
    assert target.game.pieces_placed >= 1


def test_f11_fills_the_screen_and_comes_back() -> None:
    surface, target = loop.window(headless=True), TetrisTarget(seed=1)
    for expected in (pygame.display.get_desktop_sizes()[0], loop.SIZE):
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_F11))
        loop.play(target, FakeReceiver(), surface, seconds=0.5, clock=count(0.0).__next__)
        assert pygame.display.get_window_size() == expected


def test_loop_ends_with_the_reason_when_the_first_connection_fails() -> None:
    surface = loop.window(headless=True)
    target = TetrisTarget(seed=1)
    with pytest.raises(LinkError, match="COM7 is busy"):
        loop.play(target, FakeReceiver([], [Refused("COM7 is busy")]), surface)


def on_screen(target: TetrisTarget, x: float, y: float) -> tuple[int, int]:
    assert target.projection is not None
    across, down = target.projection.to_screen(x, y)
    return round(across), round(down)


# -- the menu of a pause -------------------------------------------------------------------


def stopped() -> TetrisTarget:
    """A game that its player has stopped, and that the orb is heard in."""
    target = playing()
    target.tick(1.0, [said("pause")])
    return target


def test_in_a_pause_the_orbs_commands_move_through_a_menu() -> None:
    target = stopped()
    assert target.in_menu
    piece = target.game.piece
    target.tick(1.1, [said("rotate_cw"), said("down"), said("right")])
    assert target.game.piece == piece
    assert target.menu.selected == 2
    assert target.menu.menu.items[2].value == "on"


def test_the_first_item_goes_on_and_the_second_begins_anew() -> None:
    target = stopped()
    target.tick(1.1, [said("drop")])
    assert target.game.phase is Phase.RUNNING
    target.tick(1.2, [said("drop"), said("pause")])
    target.tick(1.3, [said("rotate_cw"), said("drop")])
    assert target.game.phase is Phase.RUNNING
    assert target.game.pieces_placed == 0


def test_the_keyboard_moves_through_the_menu_as_well() -> None:
    target = stopped()
    for key in (pygame.K_DOWN, pygame.K_UP, pygame.K_RETURN):
        target.handle(pygame.event.Event(pygame.KEYDOWN, key=key), 1.1)
    target.tick(1.2)
    assert target.game.phase is Phase.RUNNING


def test_a_pause_that_the_link_made_has_no_menu() -> None:
    target = playing()
    target.tick(1.0, [Stale()])
    assert target.reason
    assert not target.in_menu


def test_the_menu_is_drawn_over_the_game() -> None:
    target, surface = stopped(), pygame.Surface((1280, 720))
    target.draw(surface)
    before = surface.copy()
    target.tick(1.1, [said("rotate_cw")])
    target.draw(surface)
    assert pygame.image.tobytes(before, "RGB") != pygame.image.tobytes(surface, "RGB")
