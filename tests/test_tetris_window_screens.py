"""The whole window on a clock of the test's own: what leads where, by which hands."""

from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from tetris.engine import Action, Phase
from tetris.window.app import App, Start
from tetris.window.display import open_window
from tetris.window.screens.binding_screen import WAIT_S, BindingScreen
from tetris.window.screens.menu_screen import MenuScreen
from tetris.window.screens.play_screen import READY_S, PlayScreen
from tetris.window.screens.replay_screen import ReplayScreen
from tetris.window.settings import Settings

FRAME_S = 1 / 60
DOWN, UP, DROP = Action.ROTATE_CW, Action.ROTATE_CCW, Action.HARD_DROP


class Player:
    """Somebody at the window."""

    def __init__(self, app: App) -> None:
        self.app = app
        self.now_s = 0.0
        self.open = True
        self.wait(FRAME_S)

    def wait(self, seconds: float, *events: pygame.event.Event) -> None:
        until_s, due = self.now_s + seconds, list(events)
        while self.now_s < until_s:
            self.now_s += FRAME_S
            self.open = self.app.step(self.now_s, due)
            due = []

    def key(self, *keys: int) -> None:
        for key in keys:
            self.wait(FRAME_S, pygame.event.Event(pygame.KEYDOWN, key=key))
            self.wait(FRAME_S, pygame.event.Event(pygame.KEYUP, key=key))

    def click(self, at: tuple[int, int]) -> None:
        self.wait(FRAME_S, pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=1, pos=at))

    def orb(self, *actions: Action) -> None:
        for action in actions:
            self.app.act(action)
            self.wait(FRAME_S)

    @property
    def screen(self) -> object:
        return self.app.stage.screen

    @property
    def menu(self) -> MenuScreen:
        assert isinstance(self.screen, MenuScreen)
        return self.screen

    @property
    def game(self) -> PlayScreen:
        assert isinstance(self.screen, PlayScreen)
        return self.screen

    def choose(self, label: str) -> None:
        labels = [item.label for item in self.menu.menu.items]
        while self.menu.selected != labels.index(label):
            self.key(pygame.K_DOWN)
        self.key(pygame.K_RETURN)

    def lose(self) -> None:
        while isinstance(self.screen, PlayScreen):
            self.key(pygame.K_SPACE)
            self.wait(0.02)
        self.wait(0.7)


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Iterator[pygame.Surface]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("SDL_AUDIODRIVER", "dummy")
    monkeypatch.setenv("LC_ALL", "C")
    yield open_window((1120, 720), "test")
    pygame.quit()


def open_app(surface: pygame.Surface, start: Start | None = None, **folders: Path) -> Player:
    return Player(App(surface, start or Start(), sound=False, **folders))


@pytest.fixture
def player(window: pygame.Surface, tmp_path: Path) -> Player:
    return open_app(window, config=tmp_path / "config", data=tmp_path / "data")


# -- menus ---------------------------------------------------------------------------------


def test_the_orbs_six_commands_reach_every_item_of_every_menu_and_come_back(
    player: Player,
) -> None:
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
            if item.do is None or item.label in {"Quit", "Play", "Back"}:
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
    player.orb(DROP)
    player.wait(READY_S + 0.1)
    x = player.game.session.game.piece.x
    player.orb(Action.LEFT)
    assert player.game.session.game.piece.x == x - 1
    player.orb(Action.PAUSE)
    assert player.menu.menu.title == "Paused"
    player.orb(UP, DROP)
    assert player.menu.menu.items[0].label == "Play"


def test_a_held_key_walks_through_a_menu(player: Player) -> None:
    player.wait(0.6, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_DOWN))
    assert player.menu.selected >= 3


def test_the_mouse_chooses_takes_and_turns(player: Player) -> None:
    spots = player.menu._view.spots
    at = spots[1].place.right - 4, spots[1].place.centery
    player.wait(FRAME_S, pygame.event.Event(pygame.MOUSEMOTION, pos=at, buttons=(0, 0, 0)))
    assert player.menu.selected == 1
    player.click(at)
    assert player.app.stage.settings.mode == "endless"
    player.click(spots[0].place.center)
    assert isinstance(player.screen, PlayScreen)


def test_a_step_back_on_the_title_closes_nothing(player: Player) -> None:
    player.key(pygame.K_ESCAPE)
    assert player.open
    player.choose("Quit")
    assert not player.open


def test_what_is_changed_is_kept_for_the_next_time(
    window: pygame.Surface, player: Player, tmp_path: Path
) -> None:
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
    assert page.waiting
    player.key(pygame.K_j)
    assert not page.waiting
    assert player.app.stage.settings.keys["left"] == ("left", "j")
    player.key(pygame.K_ESCAPE, pygame.K_ESCAPE)
    player.choose("Play")
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
    assert page.waiting
    player.wait(WAIT_S + 0.1)
    assert not page.waiting
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


# -- play ----------------------------------------------------------------------------------


def playing(player: Player) -> PlayScreen:
    player.choose("Play")
    player.wait(READY_S + 0.1)
    return player.game


def test_nothing_falls_before_the_player_is_ready(player: Player) -> None:
    player.choose("Play")
    player.wait(READY_S / 2)
    assert player.game.session.game.time_s == 0
    player.wait(READY_S)
    assert player.game.session.game.time_s > 0


def test_no_time_passes_in_a_pause(player: Player) -> None:
    game = playing(player).session.game
    player.key(pygame.K_p)
    before_s = game.time_s
    player.now_s += 3600
    player.key(pygame.K_RETURN)
    player.wait(0.1)
    assert game.phase is Phase.RUNNING
    assert game.time_s - before_s < 0.3


def test_a_window_that_loses_the_focus_pauses_and_says_why(player: Player) -> None:
    playing(player)
    player.wait(FRAME_S, pygame.event.Event(pygame.WINDOWFOCUSLOST))
    assert "focus" in player.menu.menu.notice


def test_a_pad_that_is_pulled_out_pauses_the_game(player: Player) -> None:
    playing(player)
    pads = player.app.stage.pads
    pads._open[3] = pygame.joystick.Joystick  # type: ignore[assignment]
    player.wait(FRAME_S, pygame.event.Event(pygame.JOYDEVICEREMOVED, instance_id=3))
    assert "pad" in player.menu.menu.notice


def test_a_key_held_through_a_pause_is_not_held_after_it(player: Player) -> None:
    screen = playing(player)
    player.wait(FRAME_S, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_LEFT))
    player.wait(FRAME_S, pygame.event.Event(pygame.WINDOWFOCUSLOST))
    player.key(pygame.K_RETURN)
    x = screen.session.game.piece.x
    player.wait(0.5)
    assert screen.session.game.piece.x == x


def test_the_end_has_a_menu_and_drumming_on_the_keys_does_not_pass_it(player: Player) -> None:
    playing(player)
    while isinstance(player.screen, PlayScreen):
        player.key(pygame.K_SPACE)
    ended = player.screen
    player.key(pygame.K_SPACE, pygame.K_SPACE)
    assert player.screen is ended
    player.wait(0.7)
    player.choose("Play again")
    assert player.game.session.game.pieces_placed == 0


def test_a_finished_game_is_kept_watched_and_played_on_from(player: Player, tmp_path: Path) -> None:
    playing(player)
    player.lose()
    player.choose("Leave the game")
    player.choose("Replays")
    assert len(player.menu.menu.items) == 2
    player.key(pygame.K_RETURN)
    replay = player.screen
    assert isinstance(replay, ReplayScreen)
    player.wait(1.0)
    player.key(pygame.K_DOWN, pygame.K_LEFT)
    assert replay._player.time_s - replay._player.start_s < 0.5
    player.wait(0.3)
    placed = replay._player.game.pieces_placed
    player.choose("Play on from here")
    assert player.game.session.game.pieces_placed == placed
    player.wait(READY_S + 0.2)
    player.key(pygame.K_SPACE)
    assert player.game.session.game.pieces_placed >= placed + 1
    player.lose()
    assert len(list((tmp_path / "data").rglob("*.tetris"))) == 2


def test_a_file_that_is_no_replay_is_refused_with_a_sentence(
    window: pygame.Surface, tmp_path: Path
) -> None:
    path = tmp_path / "foreign.tetris"
    path.write_bytes(b"no replay")
    player = open_app(window, Start(replay=path))
    assert "no replay" in player.menu.menu.notice


@pytest.mark.parametrize(
    "mode", ["marathon", "endless", "sprint", "ultra_2", "ultra_3", "zen", "dig", "orb"]
)
def test_the_bot_plays_every_mode_to_be_watched(window: pygame.Surface, mode: str) -> None:
    player = open_app(window, Start(mode=mode, seed=3, level=2, bot="dellacherie"))
    player.wait(6.0)
    assert player.game.session.mode.name == mode
    assert player.game.session.game.pieces_placed >= 5


def test_zen_takes_a_piece_back(window: pygame.Surface) -> None:
    player = open_app(window, Start(mode="zen", seed=3))
    player.wait(READY_S + 0.1)
    player.key(pygame.K_SPACE, pygame.K_SPACE, pygame.K_u)
    assert player.game.session.game.pieces_placed == 1


def test_a_hint_is_shown_until_the_piece_is_placed(window: pygame.Surface) -> None:
    player = open_app(window, Start(mode="zen", seed=3))
    player.wait(READY_S + 0.1)
    player.key(pygame.K_h)
    assert player.game._hint is not None
    player.key(pygame.K_SPACE)
    assert player.game._hint is None


def test_a_turn_that_is_held_turns_the_next_piece_as_it_enters(window: pygame.Surface) -> None:
    player = open_app(window, Start(mode="marathon", seed=3))
    player.wait(READY_S + 0.1)
    player.wait(FRAME_S, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_z))
    player.key(pygame.K_SPACE)
    assert player.game.session.game.piece.turn == 3


def test_at_an_instant_repeat_a_held_direction_goes_to_the_wall(player: Player) -> None:
    player.app.stage.change(Settings(das_ms=50, arr_ms=0))
    screen = playing(player)
    player.wait(0.1, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_LEFT))
    assert min(x for x, _ in screen.session.game.piece.cells) == 0


def test_orb_pace_gives_a_quick_hand_more_gravity(window: pygame.Surface) -> None:
    player = open_app(window, Start(mode="orb", seed=3, level=9))
    player.wait(READY_S + 0.1)
    assert player.game.session.game.gravity_cap == 3
    for _ in range(4):
        player.key(pygame.K_LEFT, pygame.K_RIGHT, pygame.K_LEFT)
        player.wait(0.7)
        player.key(pygame.K_SPACE)
    assert player.game.session.game.gravity_cap > 3


# -- sizes ---------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(640, 480), (300, 900), (1920, 1080), (3840, 2160), (64, 48)])
@pytest.mark.parametrize("theme", ["dark", "light", "contrast", "safe"])
def test_every_screen_is_drawn_in_every_size(
    window: pygame.Surface, size: tuple[int, int], theme: str
) -> None:
    player = open_app(window)
    player.app.stage.change(Settings(theme=theme, patterns=theme == "safe"))
    pygame.display.set_mode(size, pygame.RESIZABLE)
    player.wait(FRAME_S, pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
    assert player.app.stage.area.size == size
    player.choose("Settings")
    player.choose("Keys")
    player.key(pygame.K_ESCAPE, pygame.K_ESCAPE)
    player.choose("Play")
    player.wait(0.1)
    player.key(pygame.K_p)
    player.wait(0.05)


def test_full_screen_and_back(player: Player) -> None:
    player.key(pygame.K_F11)
    player.wait(FRAME_S)
    assert player.app.stage.settings.fullscreen
    assert player.app.stage.area.size == pygame.display.get_desktop_sizes()[0]
    player.key(pygame.K_F11)
    player.wait(FRAME_S)
    assert player.app.stage.area.size == (1120, 720)
