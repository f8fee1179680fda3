"""The command line."""

import json
import os
import subprocess
import sys

import pygame
import pytest

import tetris.__main__
from tetris.__main__ import main


def test_a_headless_bot_prints_one_json_object(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["--headless", "--bot", "--seed", "3", "--pieces", "80", "--json"]
    assert main(command) == 0
    first = capsys.readouterr().out
    result = json.loads(first)
    assert result["seed"] == 3
    assert result["pieces"] == 80
    assert result["lines"] > 20
    assert main(command) == 0
    assert capsys.readouterr().out == first


def test_without_json_the_result_is_a_line_to_read(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--headless", "--bot", "--seed", "3", "--pieces", "5"]) == 0
    assert "5 pieces (seed 3)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["--headless"], "add --bot"),
        (["--level", "0"], "from 1 to 20"),
        (["--seed", "x"], "x must be a whole number from 0 to 4294967295"),
        (["--headless", "--bot", "--pieces", "many"], "whole number"),
    ],
)
def test_wrong_usage_is_answered_in_a_sentence(
    argv: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        main(argv)
    assert stop.value.code == 2
    assert says in capsys.readouterr().err


def test_ctrl_c_ends_a_game_without_a_word(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(tetris.__main__, "_play_unseen", interrupt)
    assert main(["--headless", "--bot"]) == 130
    assert capsys.readouterr() == ("", "")


def test_a_result_that_nobody_reads_is_one_sentence() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "tetris", "--headless", "--bot", "--pieces", "3"]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(writing)
    assert done.returncode == 1
    assert done.stderr == "tetris: cannot print the result: Broken pipe\n"


def test_help_ends_with_a_first_thing_to_try(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    assert capsys.readouterr().out.rstrip().endswith("Try it: tetris --bot")


def test_without_a_display_one_sentence_names_headless(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    monkeypatch.delenv("SDL_VIDEO_DRIVER", raising=False)
    monkeypatch.setattr(pygame.display, "init", lambda: None)
    assert main([]) == 2
    message = capsys.readouterr().err
    assert "--headless" in message
    assert message.count("\n") == 1


def test_a_window_game_runs_until_it_is_closed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    flips = iter(range(3))

    def flip() -> None:
        if next(flips, None) is None:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    monkeypatch.setattr(pygame.display, "flip", flip)
    assert main(["--bot", "--seed", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["seed"] == 1
