"""Sounds: what is heard when, and that silence is no trouble."""

from pathlib import Path

import numpy as np
import pygame
import pytest

from tetris.engine.board import Board
from tetris.engine.game import Action, Game
from tetris.engine.pieces import KINDS, Piece
from tetris.window import synth
from tetris.window.settings import Settings
from tetris.window.sounds import Sounds, device_likely, sound_of


@pytest.mark.parametrize("name", sorted(synth.SOUNDS))
def test_every_sound_is_heard_and_begins_and_ends_softly(name: str) -> None:
    wave = synth.wave(synth.SOUNDS[name])
    assert np.isfinite(wave).all()
    assert 0.05 < np.abs(wave).max() <= 0.81
    assert abs(wave[0]) < 0.01
    assert abs(wave[-1]) < 0.01
    assert len(wave) < 2 * synth.RATE_HZ


def test_a_sound_is_the_same_every_time_and_stereo() -> None:
    notes = synth.SOUNDS["drop"]
    assert synth.pcm(notes) == synth.pcm(notes)
    assert len(synth.pcm(notes)) == 4 * len(synth.wave(notes))


def test_each_piece_has_a_tone_of_its_own() -> None:
    tones = {synth.SOUNDS[f"tone_{kind}"][0].hz for kind in KINDS}
    assert len(tones) == len(KINDS)


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
    game.set_up(Board.parse(board), piece)
    game.update(0.0)
    heard = [sound_of(event) for event in game.update(0.0, [Action.HARD_DROP])]
    assert sound in heard


def test_moves_are_heard_but_not_the_fall() -> None:
    game = Game(seed=1)
    game.update(0.0)
    heard = [sound_of(e) for e in game.update(5.0, [Action.LEFT, Action.ROTATE_CW, Action.HOLD])]
    assert [name for name in heard if name] == ["shift", "rotate", "hold"]


def test_without_an_audio_device_all_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, **__: object) -> None:
        raise pygame.error("no audio device")

    monkeypatch.setenv("SDL_AUDIODRIVER", "dummy")
    monkeypatch.setattr(pygame.mixer, "init", none)
    sounds = Sounds()
    sounds.set_volumes(Settings())
    sounds.start()
    sounds.effect("drop")
    sounds.stop()
    sounds.effect("drop")


def test_a_linux_without_sound_card_and_sound_server_is_not_asked(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("SDL_AUDIODRIVER", "PULSE_SERVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/7")
    assert not device_likely("linux", tmp_path)
    assert device_likely("darwin", tmp_path)
    server = tmp_path / "run/user/7/pulse/native"
    server.parent.mkdir(parents=True)
    server.touch()
    assert device_likely("linux", tmp_path)


def test_sounds_are_played_once_the_device_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_AUDIODRIVER", "dummy")
    sounds = Sounds()
    sounds.set_volumes(Settings(effects=100))
    sounds.start()
    assert sounds._opening
    sounds._opening.join(timeout=10)
    try:
        sounds.effect("over")
        assert pygame.mixer.get_busy()
    finally:
        sounds.stop()
        pygame.mixer.quit()


def test_a_volume_of_nothing_plays_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_AUDIODRIVER", "dummy")
    sounds = Sounds()
    sounds.set_volumes(Settings(effects=0, clicks=0, tones=0))
    sounds.start()
    assert sounds._opening
    sounds._opening.join(timeout=10)
    try:
        sounds.effect("over")
        sounds.click("move")
        assert not pygame.mixer.get_busy()
    finally:
        sounds.stop()
        pygame.mixer.quit()
