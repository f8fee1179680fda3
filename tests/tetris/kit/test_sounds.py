"""Sounds: what is heard when, and that silence is no trouble."""

from collections.abc import Iterator

import numpy as np
import pygame
import pytest

from tests.support.tetris_games import set_up
from tetris.engine import events as happened
from tetris.engine.board import Board
from tetris.engine.events import Locked
from tetris.engine.game import Action, Game
from tetris.engine.moves import Spin
from tetris.engine.pieces import Piece
from tetris.engine.scoring import Clear
from tetris.kit import sounds
from tetris.kit.settings import Settings
from tetris.kit.sounds import SOUNDS, Sounds
from tetris.window.effects import sounds_of


def channels() -> list[pygame.mixer.Channel]:
    return [pygame.mixer.Channel(number) for number in range(pygame.mixer.get_num_channels())]


@pytest.mark.parametrize("name", sorted(sounds.SOUNDS))
def test_every_sound_is_heard_and_begins_and_ends_softly(name: str) -> None:
    wave = sounds.wave(sounds.SOUNDS[name])
    assert np.isfinite(wave).all()
    assert 0.05 < np.abs(wave).max() <= 0.81
    assert abs(wave[0]) < 0.01
    assert abs(wave[-1]) < 0.01
    assert len(wave) < 2 * sounds.RATE_HZ


def test_a_sound_is_the_same_every_time_and_stereo() -> None:
    notes = sounds.SOUNDS["drop"]
    assert sounds.pcm(notes) == sounds.pcm(notes)
    assert len(sounds.pcm(notes)) == 4 * len(sounds.wave(notes))


@pytest.mark.parametrize(
    ("board", "piece", "sound"),
    [
        ("", Piece("O", 4, 10), "lock"),
        ("J.........\nJJJJJJJJ..\nJJJJJJJJ..", Piece("O", 8, 10), "double"),
        ("J.........\n" + "JJJJJJJJJ.\n" * 4, Piece("I", 7, 10, 1), "tetris"),
        ("JJJJJJJJ..", Piece("O", 8, 10), "single"),
        ("JJJJJJJJ..\nJJJJJJJJ..", Piece("O", 8, 10), "perfect"),
    ],
)
def test_a_lock_sounds_like_what_it_cleared(board: str, piece: Piece, sound: str) -> None:
    game = Game(seed=1)
    set_up(game, Board.parse(board), piece)
    game.update(0.0)
    assert sound in sounds_of(game.update(0.0, [Action.HARD_DROP]))


def test_a_combo_sounds_higher_with_each_lock_and_beside_the_clear() -> None:
    clears = [Clear(1, Spin.NONE, False, combo, False, 100) for combo in (0, 1, 2, 9)]
    heard = [[*sounds_of([Locked(0.0, Piece("O", 8, 0), (0,), clear)])] for clear in clears]
    assert heard == [
        ["single"], ["single", "combo_1"], ["single", "combo_2"], ["single", "combo_5"]
    ]  # fmt: skip
    assert {f"combo_{step}" for step in range(1, 6)} | {"danger", "count"} <= SOUNDS.keys()


@pytest.mark.parametrize("name", ["drop", "lock"])
def test_a_knock_is_heard_on_the_speakers_of_a_laptop(name: str) -> None:
    """They play little below 300 Hz: most of the energy lies above, around 400 to 900 Hz."""
    wave = sounds.wave(sounds.SOUNDS[name])
    power = np.abs(np.fft.rfft(wave, sounds.RATE_HZ)) ** 2  # one number per hertz
    assert power[400:900].sum() > 0.8 * power.sum()
    assert power[:200].sum() < 0.1 * power.sum()


def test_moves_are_heard_but_not_the_fall() -> None:
    game = Game(seed=1)
    game.update(0.0)
    heard = sounds_of(game.update(5.0, [Action.LEFT, Action.ROTATE_CW, Action.HOLD]))
    assert [*heard] == ["shift", "rotate", "hold"]


def test_without_an_audio_device_all_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, **__: object) -> None:
        raise pygame.error("no audio device")

    monkeypatch.setenv("SDL_AUDIODRIVER", "dummy")
    monkeypatch.setattr(pygame.mixer, "init", none)
    silent = Sounds()
    silent.set_volumes(Settings())
    silent.start()
    silent.play("drop", "effects")
    silent.stop()
    silent.play("drop", "effects")


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[Sounds]:
    monkeypatch.setenv("SDL_AUDIODRIVER", "dummy")
    playing = Sounds()
    playing.start()
    assert playing._opening
    playing._opening.join(timeout=10)
    yield playing
    playing.stop()
    pygame.mixer.quit()


def test_sounds_are_played_once_the_device_is_open(opened: Sounds) -> None:
    opened.set_volumes(Settings(effects=100))
    opened.play("over", "effects")
    assert pygame.mixer.get_busy()


def test_a_volume_of_nothing_plays_nothing(opened: Sounds) -> None:
    opened.set_volumes(Settings(effects=0, clicks=0))
    opened.play("over", "effects")
    opened.play("menu_move", "clicks")
    assert not pygame.mixer.get_busy()


def test_a_sound_is_played_once_a_frame(opened: Sounds) -> None:
    opened.set_volumes(Settings(effects=100))
    moved = happened.Moved(0.0, Piece("T", 3, 18), -1, 0, Action.LEFT)
    for sound in sounds_of([moved] * 9):
        opened.play(sound, "effects")
    assert sum(channel.get_busy() for channel in channels()) == 1


def test_sounds_together_are_no_louder_than_the_loudest_number(opened: Sounds) -> None:
    opened.set_volumes(Settings(effects=100, clicks=100))
    for name in sounds.SOUNDS:
        opened.play(name, "effects")
    peaks = [
        channel.get_volume() * opened._peaks[sound]
        for channel in channels()
        if (sound := channel.get_sound())
    ]
    assert len(peaks) >= 2
    assert 0.5 < sum(peaks) <= 1.01  # volumes are steps of 1/128
