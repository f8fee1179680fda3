"""Screens: what leads where, by which hands; and that each is drawn in every size."""

import random
from pathlib import Path

import pygame
import pytest

from tests.support.tetris_player import FRAME_S, Player, open_app
from tetris.engine.game import Action
from tetris.kit.menu_view import Spot
from tetris.kit.settings import Settings
from tetris.window.menu_screen import MenuScreen
from tetris.window.pages import WAIT_S, BindingScreen
from tetris.window.play_screen import READY_S, PlayScreen

DOWN, UP, DROP = Action.ROTATE_CW, Action.ROTATE_CCW, Action.HARD_DROP


# -- menus ---------------------------------------------------------------------------------


def test_the_orbs_six_commands_reach_every_item_of_every_menu_and_come_back(player: Player) -> None:
    title = player.menu
    opened = []

    def visit(screen: MenuScreen) -> None:
        for number, item in enumerate(screen.menu.items):
            while screen.selected != number:
                player.orb(DOWN)
            if item.step:
                player.orb(Action.RIGHT, Action.LEFT)
                if screen.selected != number:
                    continue
            if item.do is None or item.label in {"Quit", "Start", "Back"}:
                continue
            player.orb(DROP)
            if isinstance(screen, BindingScreen):
                player.orb(DOWN)  # whoever has no keyboard just goes on
            elif player.screen is not screen:
                opened.append(item.label)
                visit(player.menu)
        player.orb(UP)
        while screen.menu.items[screen.selected].label not in {"Back", "Quit"}:
            player.orb(UP)
        if screen is not title:
            player.orb(DROP)

    visit(title)
    assert player.screen is title
    assert {"Best games", "Replays", "Settings", "Handling", "Keys", "Game pad"} <= set(opened)
    assert {"Screen", "Sound"} <= set(opened)
    player.orb(DROP)
    assert not player.open


def test_the_orb_starts_plays_pauses_and_leaves_a_game(player: Player) -> None:
    player.orb(DROP, DROP)
    player.wait(READY_S + 0.1)
    x = player.game.session.game.piece.x
    player.orb(Action.LEFT)
    assert player.game.session.game.piece.x == x - 1
    player.orb(Action.PAUSE)
    assert player.menu.menu.title == "Paused"
    player.orb(UP, DROP)
    assert player.menu.menu.items[0].label == "Play"


def test_a_held_key_walks_through_a_menu(player: Player) -> None:
    player.choose("Play")
    player.wait(0.6, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_DOWN))
    assert player.menu.selected >= 3
    player.wait(0.1, pygame.event.Event(pygame.KEYUP, key=pygame.K_DOWN))
    selected = player.menu.selected
    player.wait(0.6)
    assert player.menu.selected == selected


def test_the_mouse_chooses_takes_and_turns(player: Player) -> None:
    player.choose("Play")
    player.wait(FRAME_S)
    spots = player.menu._view.spots
    at = spots[1].place.right - 4, spots[1].place.centery
    player.wait(FRAME_S, pygame.event.Event(pygame.MOUSEMOTION, pos=at, buttons=(0, 0, 0)))
    assert player.menu.selected == 1
    player.click(at)
    assert player.app.stage.settings.mode == "endless"
    player.click(spots[0].place.center)
    assert isinstance(player.screen, PlayScreen)


def test_the_wheel_goes_on_from_the_chosen_item_wherever_the_pointer_is(player: Player) -> None:
    player.choose("Play")
    at = player.menu.spots[0].place.center
    for _ in range(3):  # SDL reports each notch as a button, too
        button = pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=5, pos=at)
        player.wait(FRAME_S, button, pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=-1, pos=at))
    assert player.menu.selected == 3


def test_a_click_on_an_arrow_turns_a_value_back_and_on(player: Player) -> None:
    player.choose("Play")
    player.wait(FRAME_S)
    for number, mode in ((1, "endless"), (1, "sprint"), (0, "endless")):
        arrows = player.menu._view.spots[1].arrows
        assert min(arrow.width for arrow in arrows) >= 24
        player.click(arrows[number].center)
        assert player.app.stage.settings.mode == mode


def test_what_can_be_changed_stands_between_arrows_and_actions_do_not(player: Player) -> None:
    player.choose("Play")
    player.wait(FRAME_S)
    arrows = {
        player.menu.menu.items[spot.number].label: len(spot.arrows)
        for spot in player.menu._view.spots
    }
    assert arrows["Mode"] == arrows["Start level"] == 2
    assert arrows["Start"] == arrows["Back"] == 0


def pad(player: Player, *buttons: int) -> None:
    for button in buttons:
        for kind in (pygame.CONTROLLERBUTTONDOWN, pygame.CONTROLLERBUTTONUP):
            player.wait(FRAME_S, pygame.event.Event(kind, instance_id=0, button=button))


def test_a_pad_alone_plays_pauses_goes_back_and_leaves(player: Player) -> None:
    take, back = pygame.CONTROLLER_BUTTON_A, pygame.CONTROLLER_BUTTON_B
    down, start = pygame.CONTROLLER_BUTTON_DPAD_DOWN, pygame.CONTROLLER_BUTTON_START
    title = player.screen
    pad(player, take, *[down] * 3, take)
    assert player.menu.menu.title == "Best games"
    pad(player, back, back)
    assert player.screen is title
    pad(player, take, take)
    player.wait(READY_S + 0.1)
    pad(player, start)
    assert player.menu.menu.title == "Paused"
    pad(player, *[down] * 3, take)
    assert player.screen is title


def test_the_mouse_alone_goes_back_from_every_page(player: Player) -> None:
    title = player.screen
    for way in (("Play", "Best games"), ("Play", "Replays"), ("Settings",)):
        player.choose(*way)
        for _ in way:
            spots = player.menu._view.spots
            player.click(next(s for s in spots if _is_back(player, s)).place.center)
        assert player.screen is title


def _is_back(player: Player, spot: Spot) -> bool:
    return player.menu.menu.items[spot.number].label == "Back"


def test_a_menu_is_drawn_less_often_than_a_game(player: Player) -> None:
    menus = player.app.frames_hz
    player.choose("Play", "Start")
    assert menus <= 30 < player.app.frames_hz == 60
    player.wait(READY_S + 0.1)
    player.key(pygame.K_p)
    assert player.app.frames_hz <= 20


def test_a_step_back_on_the_title_closes_nothing(player: Player) -> None:
    player.key(pygame.K_ESCAPE)
    assert player.open
    player.choose("Quit")
    assert not player.open


def test_what_is_changed_is_kept(window: pygame.Surface, player: Player, tmp_path: Path) -> None:
    player.choose("Settings")
    player.choose("Screen")
    player.key(pygame.K_RIGHT)
    assert player.app.stage.look.palette.name == "light"
    again = open_app(window, config=tmp_path / "config")
    assert again.app.stage.look.palette.name == "light"


def test_another_language_is_spoken_at_once(player: Player) -> None:
    player.choose("Settings")
    while player.menu.menu.items[player.menu.selected].label != "Language":
        player.key(pygame.K_DOWN)
    player.key(pygame.K_RIGHT, pygame.K_RIGHT)
    assert player.menu.menu.title == "Einstellungen"


def test_damaged_settings_are_told_of(window: pygame.Surface, tmp_path: Path) -> None:
    (tmp_path / "tetris.toml").write_text("= damaged")
    player = open_app(window, config=tmp_path)
    assert "put aside" in player.menu.menu.notice


# -- binding -------------------------------------------------------------------------------


def binding(player: Player, page: str) -> BindingScreen:
    player.choose("Settings")
    player.choose(page)
    assert isinstance(player.screen, BindingScreen)
    return player.screen


def test_a_key_is_bound_by_pressing_it_and_plays(player: Player) -> None:
    page = binding(player, "Keys")
    player.key(pygame.K_RETURN)
    assert page._waiting
    player.key(pygame.K_j)
    assert not page._waiting
    assert player.app.stage.settings.keys["left"] == ("left", "j")
    player.key(pygame.K_ESCAPE, pygame.K_ESCAPE)
    player.choose("Play", "Start")
    player.wait(READY_S + 0.1)
    x = player.game.session.game.piece.x
    player.key(pygame.K_j)
    assert player.game.session.game.piece.x == x - 1


def test_bindings_are_taken_away_and_set_back(player: Player) -> None:
    binding(player, "Keys")
    player.key(pygame.K_LEFT)
    assert player.app.stage.settings.keys["left"] == ()
    player.choose(player.app.stage.look.words("settings.reset"))
    assert player.app.stage.settings.keys == Settings().keys


def test_a_key_that_never_comes_is_not_waited_for(player: Player) -> None:
    page = binding(player, "Game pad")
    player.key(pygame.K_RETURN)
    assert page._waiting
    player.wait(WAIT_S + 0.1)
    assert not page._waiting
    assert player.app.stage.settings.pads == Settings().pads


def test_a_pads_button_is_bound_by_pressing_it(player: Player) -> None:
    binding(player, "Game pad")
    player.key(pygame.K_RETURN)
    button = pygame.CONTROLLER_BUTTON_Y
    pressed = pygame.event.Event(pygame.CONTROLLERBUTTONDOWN, instance_id=0, button=button)
    player.wait(FRAME_S, pressed)
    pads = player.app.stage.settings.pads
    assert "pad_y" in pads["left"]
    assert "pad_y" not in pads["rotate_cw"]


# -- sizes ---------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(640, 480), (300, 900), (1920, 1080), (3840, 2160), (64, 48)])
@pytest.mark.parametrize("theme", ["dark", "light", "contrast", "safe"])
def test_every_size_is_drawn(window: pygame.Surface, size: tuple[int, int], theme: str) -> None:
    player = open_app(window)
    player.app.stage.change(Settings(theme=theme, patterns=theme == "safe"))
    pygame.display.set_mode(size, pygame.RESIZABLE)
    player.wait(FRAME_S, pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
    assert player.app.stage.area.size == size
    player.choose("Settings")
    player.choose("Keys")
    player.key(pygame.K_ESCAPE, pygame.K_ESCAPE)
    player.choose("Play", "Start")
    player.wait(0.1)
    player.key(pygame.K_p)
    player.wait(0.05)


def test_the_attract_mode_has_equal_margins_and_begins_level_with_the_title(player: Player) -> None:
    view = player.menu._attract._view if player.menu._attract else None
    assert view
    outer, letters = view.layout.outer, player.menu._view.spots[0].place.left
    assert abs((player.app.stage.area.right - outer.right) - letters) <= 20
    assert outer.top <= 56


def test_a_window_has_its_size_again_after_full_screen(player: Player) -> None:
    pygame.display.set_mode((900, 700), pygame.RESIZABLE)
    player.wait(FRAME_S, pygame.event.Event(pygame.VIDEORESIZE, size=(900, 700), w=900, h=700))
    player.key(pygame.K_F11)
    player.wait(FRAME_S)
    assert player.app.stage.settings.fullscreen
    assert player.app.stage.area.size == pygame.display.get_desktop_sizes()[0]
    player.key(pygame.K_F11)
    player.wait(FRAME_S)
    assert player.app.stage.area.size == (900, 700)


# -- what changed ----------------------------------------------------------------------------

KEYS = [pygame.K_UP, pygame.K_DOWN, pygame.K_LEFT, pygame.K_RIGHT, pygame.K_RETURN, pygame.K_SPACE]
KEYS += [pygame.K_ESCAPE, pygame.K_p, pygame.K_h, pygame.K_c, pygame.K_z, pygame.K_F1, pygame.K_r]


@pytest.mark.parametrize("seed", range(3))
def test_the_parts_that_changed_make_up_the_whole_picture(
    window: pygame.Surface, seed: int, tmp_path: Path
) -> None:
    """A monitor that is only shown the changed parts has the picture of a window drawn anew."""
    player = open_app(window, config=tmp_path, data=tmp_path)
    shown, chance, spared = window.copy(), random.Random(seed), 0
    for step in range(600):
        if step % 60 == 0 and not isinstance(player.screen, PlayScreen):
            player.app.flow.play(player.app.flow.mode)
        key, kind = chance.choice(KEYS), chance.choice([pygame.KEYDOWN, pygame.KEYUP])
        events = [pygame.event.Event(kind, key=key)] if step % 3 == 0 else []
        player.now_s += chance.choice([FRAME_S, 0.1])
        if not player.app.step(player.now_s, events):
            player = open_app(window, config=tmp_path, data=tmp_path)
        changed = player.app.changed
        spared += changed is not None
        for place in [window.get_rect()] if changed is None else changed:
            shown.blit(window, place, place)
        if step % 5 == 0:
            player.app._take(pygame.event.Event(pygame.WINDOWEXPOSED), player.now_s)
            player.app.draw(player.now_s)
            assert pygame.image.tobytes(shown, "RGB") == pygame.image.tobytes(window, "RGB"), step
    assert spared > 300
