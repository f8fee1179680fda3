"""A game in the window: beginning, pausing, ending, watching, and playing on."""

from dataclasses import replace
from pathlib import Path

import pygame
import pytest

from tests.support.pytest_types import Patch
from tests.support.tetris_player import FRAME_S, Player, open_app
from tetris.engine.board import Board
from tetris.engine.game import Action, Finish, Phase
from tetris.engine.modes import MODES, pace_of
from tetris.engine.rules import Config
from tetris.history.replay import Player as ReplayPlayer
from tetris.history.replay import Recorder
from tetris.kit import theme
from tetris.kit.settings import CHOICES, Settings
from tetris.kit.sounds import Sounds
from tetris.window.app import App, Start
from tetris.window.game_session import Session
from tetris.window.play_screen import ASK_S, LONGEST_S, READY_S, RESUME_S, PlayScreen
from tetris.window.replay_screen import ReplayScreen


@pytest.fixture
def heard(monkeypatch: Patch) -> list[str]:
    """The names of the sounds that are played."""
    names: list[str] = []
    monkeypatch.setattr(Sounds, "play", lambda _, name, kind: names.append(name))
    return names


def test_nothing_falls_before_the_player_is_ready(player: Player) -> None:
    player.choose("Play", "Start")
    player.wait(READY_S / 2)
    assert player.game.session.game.time_s == 0
    player.wait(READY_S)
    assert player.game.session.game.time_s > 0


def test_no_time_passes_in_a_pause(player: Player) -> None:
    game = player.play().session.game
    player.key(pygame.K_p)
    before_s = game.time_s
    player.now_s += 3600
    player.key(pygame.K_RETURN)
    assert (
        not game.in_play or game.phase is not Phase.RUNNING
    )  # the board is seen, and the player finds the keys
    player.wait(RESUME_S)
    assert game.phase is Phase.RUNNING
    assert game.time_s - before_s < 0.3


def test_a_frame_that_comes_seconds_late_passes_a_quarter_of_a_second(player: Player) -> None:
    session = player.play().session
    before_s, placed = session.game.time_s, session.game.pieces_placed
    player.now_s += 60.0
    player.wait(FRAME_S)
    assert session.game.time_s - before_s <= LONGEST_S + 2 * FRAME_S
    assert session.game.pieces_placed == placed
    player.key(pygame.K_SPACE)
    assert session.game.pieces_placed == placed + 1


def test_a_count_down_and_a_high_stack_are_heard(window: pygame.Surface, heard: list[str]) -> None:
    player = open_app(window, Start(mode="orb_ultra", seed=3))
    player.wait(READY_S + 0.1)
    player.key(pygame.K_p)
    player.key(pygame.K_RETURN)
    player.wait(RESUME_S)
    assert heard.count("count") == 3
    game = player.game.session.game
    game.board = Board.parse("J.........\n" * 17)
    player.wait(0.3)
    assert heard.count("danger") == 1
    game.board = Board.parse("")
    while game.phase is Phase.RUNNING:
        player.now_s += LONGEST_S
        player.app.advance(player.now_s, [])
        game.board = Board.parse("")
    assert game.result is Finish.TIME
    assert heard.count("count") == 3 + 5


def test_a_game_goes_on_after_three_two_one(player: Player, monkeypatch: Patch) -> None:
    player.play()
    player.key(pygame.K_p)
    accent, said, write = player.app.stage.look.palette.accent, [], theme.fitted

    def fitted(words: str, size: int, colour: theme.Colour, widest: int) -> pygame.Surface:
        if colour == accent:
            said.append(words)
        return write(words, size, colour, widest)

    monkeypatch.setattr(theme, "fitted", fitted)
    player.key(pygame.K_RETURN)
    player.wait(RESUME_S)
    assert list(dict.fromkeys(said)) == ["3", "2", "1"]


@pytest.mark.parametrize("button", [pygame.BUTTON_LEFT, pygame.BUTTON_RIGHT])
def test_the_mouse_alone_pauses_goes_on_and_leaves(player: Player, button: int) -> None:
    screen = player.play()
    at = screen.button.center
    assert min(screen.button.size) >= 24
    player.wait(FRAME_S, pygame.event.Event(pygame.MOUSEMOTION, pos=at, buttons=(0, 0, 0)))
    assert screen.pointer
    player.wait(FRAME_S, pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=button, pos=at))
    assert player.menu.menu.title == "Paused"
    player.wait(FRAME_S, pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=3, pos=(1, 1)))
    player.wait(2.1)
    assert player.screen is screen
    assert not screen.pointer


def test_f1_pauses_and_shows_the_keys(player: Player) -> None:
    player.app.stage.change(Settings(keys={**Settings().keys, "hold": ("q",)}))
    screen = player.play()
    player.key(pygame.K_F1)
    assert player.menu.menu.title == "Keys"
    caps = {item.label: item.caps for item in player.menu.menu.items}
    assert caps["Hold"] == ("Q",)
    player.key(pygame.K_F1)
    assert player.menu.menu.title == "Paused"
    player.key(pygame.K_ESCAPE)
    assert player.screen is screen


def test_a_window_that_loses_the_focus_pauses_and_says_why(player: Player) -> None:
    player.play()
    player.wait(FRAME_S, pygame.event.Event(pygame.WINDOWFOCUSLOST))
    assert "focus" in player.menu.menu.notice


def test_a_pad_that_is_pulled_out_pauses_the_game(player: Player) -> None:
    player.play()
    pads = player.app.stage.pads
    pads._open[3] = pygame.joystick.Joystick  # type: ignore[assignment]
    player.wait(FRAME_S, pygame.event.Event(pygame.JOYDEVICEREMOVED, instance_id=3))
    assert "pad" in player.menu.menu.notice


def test_a_key_held_through_a_pause_is_not_held_after_it(player: Player) -> None:
    screen = player.play()
    player.wait(FRAME_S, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_LEFT))
    player.wait(FRAME_S, pygame.event.Event(pygame.WINDOWFOCUSLOST))
    player.key(pygame.K_RETURN)
    x = screen.session.game.piece.x
    player.wait(RESUME_S + 0.5)
    assert screen.session.game.piece.x == x


def test_the_end_has_a_menu_and_drumming_on_the_keys_does_not_pass_it(player: Player) -> None:
    player.play()
    while isinstance(player.screen, PlayScreen):
        player.key(pygame.K_SPACE)
    ended = player.screen
    for _ in range(9):  # for longer than any input is ignored
        player.key(pygame.K_SPACE)
        player.wait(0.3)
    assert player.screen is ended
    player.wait(0.7)
    player.choose("Play again")
    assert player.game.session.game.pieces_placed == 0


def test_a_finished_game_is_kept_watched_and_played_on_from(player: Player, tmp_path: Path) -> None:
    player.play()
    player.lose()
    player.choose("Leave the game")
    player.choose("Play", "Replays")
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


def test_a_list_of_replays_says_what_is_in_them(player: Player, tmp_path: Path) -> None:
    before = player.play().session.game.score
    player.lose()
    player.choose("Leave the game")
    player.choose("Play", "Replays")
    (game, _) = player.menu.menu.items
    assert game.late
    score, length, _ = game.late().split(" · ")
    assert int(score.replace(",", "")) > before
    assert length.startswith("0:")
    (path,) = (tmp_path / "data").rglob("*.tetris")
    path.write_text("damaged")
    player.key(pygame.K_ESCAPE)
    player.choose("Replays")
    assert " · " not in (player.menu.menu.items[0].late or str)()


def watching(player: Player) -> ReplayScreen:
    player.play()
    player.lose()
    player.choose("Watch it")
    assert isinstance(player.screen, ReplayScreen)
    return player.screen


def test_a_file_that_is_no_replay_is_one_sentence(window: pygame.Surface, tmp_path: Path) -> None:
    path = tmp_path / "foreign.tetris"
    path.write_bytes(b"no replay")
    player = open_app(window, Start(replay=path))
    assert "no replay" in player.menu.menu.notice


@pytest.mark.parametrize(
    "mode", ["marathon", "endless", "sprint", "ultra_2", "ultra_3", "zen", "dig", "orb_marathon"]
)
def test_the_bot_plays_every_mode_to_be_watched(window: pygame.Surface, mode: str) -> None:
    player = open_app(window, Start(mode=mode, seed=3, level=2, bot="dellacherie"))
    player.wait(6.0)
    assert player.game.session.mode.name == mode
    assert player.game.session.game.pieces_placed >= 5


def test_a_level_without_a_mode_chooses_a_mode_with_levels(window: pygame.Surface) -> None:
    app = App(window, Start(), sound=False)
    app.stage.change(Settings(mode="sprint"))
    app.flow.begin(Start(level=7))
    screen = app.stage.screen
    assert isinstance(screen, PlayScreen)
    assert (screen.session.mode.name, screen.session.game.level) == ("marathon", 7)


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


def test_a_hint_that_begins_with_a_hold_lights_the_hold_until_it_is_done(
    window: pygame.Surface,
) -> None:
    """Hints of thirty pieces, each followed; the frame of the card is looked at in the picture."""
    player, told = open_app(window, Start(mode="zen", seed=3)), []
    player.wait(READY_S + 0.1)
    frame = theme.DARK.accent
    for _ in range(30):
        player.key(pygame.K_h)
        hint = player.game._hint
        assert hint is not None
        holds = hint.actions[0] is Action.HOLD
        card = player.game._view.layout.hold
        told.append((holds, window.get_at(card.midtop)[:3] == frame))
        if holds:
            player.key(pygame.K_c)
            landing, hint = hint.landing, player.game._hint
            assert hint is not None
            assert hint.landing == landing
            assert window.get_at(card.midtop)[:3] != frame
        player.orb(*hint.actions)
    assert {holds for holds, _ in told} == {False, True}
    assert all(holds is lit for holds, lit in told)


def test_a_restart_is_asked_for_once_a_game_is_worth_something(player: Player) -> None:
    first = player.play().session
    player.key(pygame.K_r)
    second = player.game.session
    assert second is not first
    while second.game.time_s <= ASK_S:
        player.wait(0.2)
    player.key(pygame.K_r)
    assert player.menu.menu.title == "Paused"
    assert "Restart" in player.menu.menu.notice
    player.key(pygame.K_RETURN)
    assert player.game.session is second


def test_a_turn_that_is_held_turns_the_next_piece_as_it_enters(window: pygame.Surface) -> None:
    """If the player chose so. By default it must be pressed while no piece is in play."""
    turns = {}
    for kind in CHOICES["initial"]:
        player = open_app(window, Start(mode="marathon", seed=3))
        player.app.stage.change(Settings(initial=kind))
        player.wait(READY_S + 0.1)
        player.wait(FRAME_S, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_z))
        player.key(pygame.K_SPACE)
        turns[kind] = player.game.session.game.piece.turn
    assert turns == {"off": 0, "tap": 0, "hold": 3}
    assert Settings().initial == "tap"


@pytest.mark.parametrize(("kind", "turn"), [("off", 0), ("tap", 1), ("hold", 0)])
def test_a_turn_tapped_before_a_piece_enters_turns_it(
    window: pygame.Surface, kind: str, turn: int
) -> None:
    player = open_app(window, Start(mode="zen"))
    player.app.stage.change(Settings(initial=kind))
    player.app.flow.go_on(Recorder(3, Config(generation_delay_s=0.3), "zen"))
    player.wait(READY_S + 0.5)
    player.key(pygame.K_SPACE)
    assert not player.game.session.game.in_play
    player.key(pygame.K_UP)
    player.wait(0.3)
    assert player.game.session.game.piece.turn == turn


SPACE, UP, Z, C = pygame.K_SPACE, pygame.K_UP, pygame.K_z, pygame.K_c
LEFT, RIGHT = pygame.K_LEFT, pygame.K_RIGHT


def pressed(
    window: pygame.Surface, *frames: tuple[int, ...], hz: int, settings: Settings | None = None
) -> PlayScreen:
    """Play frames of keys, each in its order; a negative key comes up."""
    app = App(window, Start(mode="endless", seed=3), sound=False)
    app.stage.change(settings or Settings())
    app.step(0.0, [])
    screen = app.stage.screen
    assert isinstance(screen, PlayScreen)
    screen.resume()  # with these settings
    for number, keys in enumerate([(), (), *frames]):
        now_s = RESUME_S + number / hz
        kinds = [(pygame.KEYDOWN if key > 0 else pygame.KEYUP, abs(key)) for key in keys]
        app.step(now_s, [pygame.event.Event(kind, key=key) for kind, key in kinds])
    return screen


@pytest.mark.parametrize("hz", [30, 60])
@pytest.mark.parametrize(
    ("keys", "turn", "placed"),
    [
        ((SPACE, UP), 1, 1),  # the turn is for the next piece, and once
        ((SPACE, Z), 3, 1),
        ((SPACE, UP, Z), 0, 1),  # there and back
        ((C, UP), 1, 0),
        ((C, UP, SPACE), 1, 1),  # the turn is still down as the piece after it enters
        ((SPACE, C, UP), 1, 1),
        ((UP, SPACE), 1, 1),  # roll-over: held as the next piece enters
        ((UP, SPACE, -UP), 1, 1),
        ((UP, -UP, SPACE), 0, 1),
        ((UP, Z, SPACE), 0, 1),  # both held: neither
        ((UP, SPACE, -UP, UP), 2, 1),  # held, and then pressed again
    ],
)
def test_keys_pressed_in_one_frame_act_as_in_frames_of_their_own(
    window: pygame.Surface, keys: tuple[int, ...], turn: int, placed: int, hz: int
) -> None:
    hands = Settings(initial="hold")
    together = pressed(window, keys, hz=hz, settings=hands).session
    apart = pressed(window, *((key,) for key in keys), hz=hz, settings=hands).session
    for session in (together, apart):
        assert (session.game.piece.turn, session.game.pieces_placed) == (turn, placed)
        again = ReplayPlayer(session.recorder.replay())
        again.advance(again.end_s)
        assert again.game.piece == session.game.piece
    assert together.game.piece.kind == apart.game.piece.kind
    assert together.game.hold == apart.game.hold


def test_a_hold_that_stays_down_holds_once(window: pygame.Surface) -> None:
    hands, keys = Settings(initial="hold"), ((C,), (SPACE,), (-SPACE,))
    held = pressed(window, *keys, (SPACE,), hz=60, settings=hands).session.game
    assert held.can_hold
    again = pressed(window, *keys, (-C,), (C,), hz=60, settings=hands).session.game
    assert not again.can_hold


@pytest.mark.parametrize("hz", [30, 60])
@pytest.mark.parametrize("arr_ms", [0, 10, 33, 100])
def test_shift_held_at_the_wall_is_one_input(window: pygame.Surface, arr_ms: int, hz: int) -> None:
    hands, run = Settings(arr_ms=arr_ms), [()] * hz
    held = pressed(window, (LEFT,), *run, (-LEFT, SPACE), hz=hz, settings=hands)
    back = (-LEFT, RIGHT, -RIGHT, SPACE)  # the standard two inputs for the second column
    tapped = pressed(window, (LEFT,), *run, back, hz=hz, settings=hands)
    for screen, x, commands in ((held, 0, 2), (tapped, 1, 3)):
        locked = screen.session.game.board.rows[0]
        assert len(locked) - len(locked.lstrip(".")) == x
        assert screen.session.commands == commands


def test_an_orb_marathon_falls_at_the_pace_of_a_quick_hand(window: pygame.Surface) -> None:
    player = open_app(window, Start(mode="orb_marathon", seed=3))
    player.wait(READY_S + 0.1)
    game, pace = player.game.session.game, player.game.session.pace
    assert pace_of(game.row_us) == pytest.approx(0.65)
    for _ in range(9):
        player.key(pygame.K_LEFT)
        player.wait(0.3)
        player.key(pygame.K_SPACE)
        player.wait(0.7)  # in the first .6 s no drop is taken
    assert pace is not None
    assert pace_of(game.row_us) == pytest.approx(pace.rate_hz, rel=0.02)


def test_an_orb_marathon_that_is_taken_over_keeps_its_pace() -> None:
    session = Session.new(MODES["orb_marathon"], 3, Settings())
    for step in range(20):
        session.update(0.5 * step, [Action.HARD_DROP], commands=1)
    player = ReplayPlayer(session.recorder.replay())
    player.seek(9.0)
    again = Session(session.mode, player.take_over())
    row_us = again.game.row_us
    again.update(9.1, [Action.RIGHT], commands=1)
    assert again.game.row_us == row_us
    assert pace_of(row_us) == pytest.approx(2.0)


def test_the_end_says_how_it_went_and_the_best_list_remembers(player: Player) -> None:
    player.play()
    player.lose()
    rows = [row.cells for row in player.menu.menu.table]
    assert rows[0] == ("Your best game so far!",)
    assert "Commands per piece" in {cells[0] for cells in rows}
    assert len(rows) == 9
    player.choose("Leave the game")
    player.choose("Play", "Best games")
    heading, first = player.menu.menu.table
    assert heading.cells[:2] == ("#", "Points")
    assert first.cells[0] == "1"
    player.key(pygame.K_RIGHT)
    assert "No game" in player.menu.menu.table[0].cells[0]


def test_a_lost_sprint_is_counted_among_the_best_games(player: Player) -> None:
    player.app.stage.change(replace(Settings(), mode="sprint"))
    player.play()
    player.lose()
    player.choose("Leave the game")
    player.choose("Play", "Best games")
    assert "No game" in player.menu.menu.table[0].cells[0]
    assert player.menu.menu.notice == "Games played: 1, won: 0."


def test_repeats_of_a_held_key_are_no_commands(player: Player) -> None:
    screen = player.play()
    player.wait(0.5, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_LEFT))
    player.key(pygame.K_SPACE)
    assert screen.session.commands == 2
