"""The application: the game's screens steered by an orb, and the dome docked beside them."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pygame
import pytest

from controller.shared.protocol.messages import Contacts, State
from host.app.screens.orbs import OrbsScreen
from host.connection.receiver import Connected, Delivered, Lost
from host.targets import SIZE
from host.ui.panel.panel_layout import Dock
from tests.support.app_window import FELT, READY_S, WELCOME, Window, said
from tetris.engine.game import Phase
from tetris.window.app import Start
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import PlayScreen


def test_the_orb_steers_the_menu_and_begins_a_game() -> None:
    window = Window()
    assert not window.playing
    window.pass_s(0.1, said("drop"))  # "Play" is chosen first, and then "Start"
    window.pass_s(0.1, said("drop"))
    assert window.playing


@pytest.mark.parametrize("size", [(640, 360), (1024, 640), (1920, 1080), (720, 1280)])
@pytest.mark.parametrize("scale", [100, 160])
def test_home_has_six_items_that_are_seen_at_once_and_quit_in_the_corner(
    size: tuple[int, int], scale: int
) -> None:
    window = Window(size=size)
    window.app.stage.change(replace(window.app.stage.settings, scale=scale))
    window.app.orbs = SimpleNamespace(tick=list)  # type: ignore[assignment]
    window.pass_s(0.1)
    home = window.app.stage.screen
    assert isinstance(home, MenuScreen)
    *names, corner = [item.label for item in home.menu.items]
    assert names == ["Play", "Learn", "Teach", "Watch", "Orb", "Settings"]
    assert (home.menu.title, corner) == ("OrbTouch", "Quit")
    assert home.menu.items[0].hint.startswith("A falling-block game, played by touching a dome.")
    assert len(home.spots) == 7
    assert home.spots[-1].place.bottom <= home.spots[0].place.top  # beside the title


def test_pages_stand_in_one_place() -> None:
    window = Window()
    places, titles = [], []
    for keys in (
        (),
        (pygame.K_RETURN,),
        (pygame.K_ESCAPE, pygame.K_UP, pygame.K_UP, pygame.K_RETURN),
    ):
        window.key(*keys)
        screen = window.app.stage.screen
        assert isinstance(screen, MenuScreen)
        places.append(screen.spots[0].place.topleft)
        titles.append(screen.menu.title)
    assert titles == ["OrbTouch", "Play", "Settings"]
    assert len(set(places)) == 1


@pytest.mark.parametrize("size", [(1024, 640), (1280, 720), (720, 1280)])
def test_the_card_of_a_pause_is_centred_on_the_board_and_leaves_the_next_pieces_free(
    size: tuple[int, int],
) -> None:
    window = Window(Start("zen", 1), size=size)
    window.pass_s(READY_S)
    play = window.app.stage.screen
    assert isinstance(play, PlayScreen)
    window.key(pygame.K_p)
    pause, layout = window.app.stage.screen, play._view.layout
    assert isinstance(pause, MenuScreen)
    for spot in pause.spots:
        assert abs(spot.place.centerx - layout.board.centerx) <= layout.cell // 2
        assert not spot.place.colliderect(layout.next)


def test_commands_move_the_piece_at_once() -> None:
    window = Window(Start("zen", 1))
    window.pass_s(READY_S)
    x = window.game.piece.x
    window.pass_s(0.0, said("left"))
    assert window.game.piece.x == x - 1
    window.pass_s(0.0, said("drop"))
    assert window.game.pieces_placed == 1


def test_a_gesture_that_is_held_repeats_until_it_is_released() -> None:
    window = Window(Start("zen", 1))
    window.pass_s(READY_S)
    window.pass_s(0.1, said("right"), Delivered(State(("right",)), 0))
    once = window.game.piece.x
    window.pass_s(1.0)
    wall = window.game.piece.x
    assert wall > once + 1
    window.pass_s(0.0, Delivered(State(()), 0), said("left"))
    window.pass_s(1.0)
    assert window.game.piece.x == wall - 1


def test_the_pause_leads_to_the_orbs_and_ends_when_the_player_is_back_from_there() -> None:
    window = Window(Start("zen", 1))
    orbs = SimpleNamespace(tick=list, scan=list, entries=list, scanning=False, notice="")
    window.app.orbs = orbs  # type: ignore[assignment]
    window.pass_s(READY_S)
    window.pass_s(0.1, Lost("the cable is out"))
    window.key(pygame.K_DOWN, pygame.K_RETURN)
    assert isinstance(window.app.stage.screen, OrbsScreen)
    window.pass_s(2.0, Connected(WELCOME))
    assert isinstance(window.app.stage.screen, OrbsScreen)
    window.key(pygame.K_ESCAPE)
    assert window.phase() is Phase.PAUSED
    window.pass_s(2.0, FELT)
    assert window.phase() is Phase.RUNNING


def test_a_pause_of_the_players_own_outlasts_the_links() -> None:
    window = Window(Start("zen", 1))
    window.pass_s(READY_S)
    window.pass_s(0.1, said("pause"))
    window.pass_s(0.1, Lost("the cable is out"))
    window.pass_s(2.0, Connected(WELCOME), FELT)
    assert window.phase() is Phase.PAUSED


def test_the_mouse_touches_the_dome_and_clicks_the_menu_beside_it() -> None:
    window = Window()
    window.pass_s(0.1, FELT)
    centre = window.app.panel.projection.centre
    for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
        window.app.handle(pygame.event.Event(kind, pos=centre, button=1), window.now_s)
        if kind == pygame.MOUSEBUTTONDOWN:
            sent = window.app.outgoing(window.now_s)
            assert any(isinstance(one, Contacts) and one.contacts for one in sent)
    assert not window.playing
    menu = window.app.stage.screen
    assert isinstance(menu, MenuScreen)
    place = menu.spots[0].place.move(Dock.of(SIZE).game.topleft).center
    click = pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=place, button=1)
    window.app.handle(click, window.now_s)
    window.pass_s(0.1)
    assert window.app.stage.screen is not menu


def test_quit_in_the_menu_closes_the_window() -> None:
    window = Window()
    window.pass_s(0.1, said("rotate_ccw"))  # up from the first item: the last one
    window.pass_s(0.1, said("drop"))
    assert window.app.closed


@pytest.mark.parametrize("size", [(1280, 720), (640, 360), (960, 720), (720, 1280), (3840, 2160)])
def test_game_and_panel_share_any_window(size: tuple[int, int]) -> None:
    dock = Dock.of(size)
    window = pygame.Rect((0, 0), size)
    assert window.contains(dock.game)
    assert window.contains(dock.panel)
    assert not dock.game.colliderect(dock.panel)


def test_the_mode_played_with_an_orb_is_kept_apart(tmp_path: Path) -> None:
    window = Window(config=tmp_path)
    window.key(pygame.K_ESCAPE)  # no introduction
    assert window.app.stage.settings.orb_mode == "orb_marathon"
    window.pass_s(0.1, said("drop"))
    window.pass_s(0.1, said("down"), said("right"))  # to "Mode", and the next one
    assert window.app.stage.settings.orb_mode == "orb_sprint"
    assert "orb_mode" in (tmp_path / "tetris.toml").read_text()


@pytest.mark.parametrize("motion", [True, False])
def test_the_dome_answers_a_lock_unless_nothing_is_to_move(motion: bool) -> None:
    window = Window(Start("zen", 1))
    window.app.stage.change(replace(window.app.stage.settings, motion=motion))
    window.pass_s(READY_S)
    assert window.app.orb.rim.level(window.now_s) == 0.0
    window.pass_s(0.1, said("drop"))
    assert (window.app.orb.rim.level(window.now_s) > 0.0) is motion


def test_zones_are_shown_while_the_pointer_is_over_the_dome_of_a_game() -> None:
    window = Window(Start("zen", 1))
    window.pass_s(READY_S, FELT)
    centre = window.app.panel.projection.centre
    for place, shown in ((centre, True), (window.app.dock.game.center, False)):
        moved = pygame.event.Event(pygame.MOUSEMOTION, pos=place, rel=(0, 0), buttons=(0, 0, 0))
        window.app.handle(moved, window.now_s)
        window.pass_s(0.1)
        assert window.app.orb.zones is shown


def test_a_menu_that_nobody_uses_is_drawn_less_often_than_a_game() -> None:
    window = Window()
    window.pass_s(0.1, FELT)
    idle = window.app.frames_hz
    window.pass_s(10.0)
    assert window.app.frames_hz < idle
    window.key(pygame.K_DOWN)
    assert window.app.frames_hz >= idle
    window.key(pygame.K_UP)
    for _ in range(2):
        window.pass_s(0.1, said("drop"))
    assert window.playing
    assert idle < window.app.frames_hz
