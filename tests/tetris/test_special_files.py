"""Special files wherever the game takes one: each is answered in a sentence, at once."""

import os
import sys
from pathlib import Path

import pygame
import pytest

from tests.support.pytest_types import Patch
from tests.support.special_files import KINDS, answer, make
from tests.support.tetris_player import open_app
from tetris import files
from tetris.__main__ import main
from tetris.engine.modes import MODES
from tetris.history.high_scores import FILE_NAME, Entry, HighScores
from tetris.history.replay import Recorder
from tetris.history.replay_file import load, save
from tetris.kit import settings
from tetris.kit.settings import Settings
from tetris.window.app import Start

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="makes special files of Linux")

NEVER_ENDING = ("pipe", "socket", "endless", "full", "null")
UNREPLACED = (*NEVER_ENDING, "folder", "loop")  # never written over
PLAY = ("--headless", "--bot", "dellacherie", "--pieces", "1")


def identity(path: Path) -> tuple[int, int]:
    now = path.lstat()
    return now.st_ino, now.st_mode


def replay(folder: Path) -> Path:
    recorder = Recorder(1)
    recorder.update(0.0)
    save(folder / "game.tetris", recorder.replay())
    return folder / "game.tetris"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("more", [(), ("--headless",)])
def test_a_replay_that_is_none_is_refused(kind: str, more: tuple[str, ...], tmp_path: Path) -> None:
    told = answer(main, ["--replay", str(make(kind, tmp_path)), *more])
    assert told.refused_by("tetris")
    assert told.status == 2


@pytest.mark.parametrize("kind", KINDS)
def test_a_recording_replaces_files_only(kind: str, tmp_path: Path) -> None:
    path = make(kind, tmp_path)
    before = identity(path) if kind in UNREPLACED else None
    told = answer(main, [*PLAY, "--record", str(path)])
    if before is None:
        assert told.status == 0
        assert load(path).outcome.pieces == 1
    else:
        assert told.refused_by("tetris")
        assert told.status == 1
        assert identity(path) == before
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("kind", KINDS)
def test_settings_that_cannot_be_read_are_as_they_come(kind: str, tmp_path: Path) -> None:
    path = make(kind, tmp_path, settings.FILE_NAME)
    chosen, sentence = settings.load(path)
    assert chosen == Settings()
    assert (sentence == "") == (kind in ("missing", "dangling", "empty", "locked"))
    assert sentence.isprintable()


@pytest.mark.parametrize("kind", KINDS)
def test_best_lists_that_cannot_be_read_begin_anew(kind: str, tmp_path: Path) -> None:
    make(kind, tmp_path, FILE_NAME)
    records = HighScores(tmp_path)
    assert (records.trouble == "") == (kind in ("missing", "dangling"))
    assert records.add(MODES["zen"], Entry(1, 0, 1, 1.0), won=False) == 1


@pytest.mark.parametrize("kind", NEVER_ENDING)
def test_special_file_in_a_list_says_so(kind: str, window: pygame.Surface, tmp_path: Path) -> None:
    folder = tmp_path / "data" / "replays"
    folder.mkdir(parents=True)
    make(kind, folder, "2026-01-01_00-00-00_zen.tetris")
    player = open_app(window, Start(), config=tmp_path / "config", data=tmp_path / "data")
    player.choose("Play", "Replays")
    player.key(pygame.K_RETURN)
    assert "cannot read" in player.menu.menu.notice


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("# " + "x" * 65_530, ""),
        ("# " + "x" * 65_536, "put aside"),
        ("x" + ".a" * 30_000 + " = 1", "put aside"),
        ("x" + " . '.'" * 10_000 + " = 1", "put aside"),
        ("x = " + "[" * 30_000, "put aside"),
    ],
)
def test_up_to_64_kb_are_read_and_more_put_aside(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / settings.FILE_NAME
    path.write_text(text)
    chosen, trouble = settings.load(path)
    assert (chosen, words in trouble) == (Settings(), True)
    assert path.exists() == (not words)


def test_a_name_with_a_zero_byte_cannot_be_read() -> None:
    with pytest.raises(OSError, match="null byte"):
        files.read_bytes(Path("a\0b"), 10)


def test_a_pipe_for_which_somebody_waits_is_refused_too(tmp_path: Path) -> None:
    path = make("pipe", tmp_path)
    writer = os.open(path, os.O_RDWR)
    try:
        with pytest.raises(OSError, match="no regular file"):
            files.read_bytes(path, 10)
    finally:
        os.close(writer)


@pytest.mark.parametrize("given", ["", "rel", "./rel", "~/rel"])
def test_relative_xdg_folders_are_ignored(given: str, tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_DATA_HOME", given)
    monkeypatch.setenv("XDG_CONFIG_HOME", given)
    assert files.data_folder() == tmp_path / ".local/share/orbtouch/tetris"
    assert files.config_folder() == tmp_path / ".config/orbtouch/tetris"
