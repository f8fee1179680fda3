"""The command line."""

import json
import os
import shlex
import subprocess
import sys
from dataclasses import replace
from importlib import metadata
from pathlib import Path

import pygame
import pytest

from tests.support.pytest_types import Capture, Patch
from tetris import cli
from tetris.__main__ import main
from tetris.engine.game import Action
from tetris.history.replay import Outcome, Recorder
from tetris.history.replay_file import save


def test_a_headless_bot_prints_one_json_object(capsys: Capture) -> None:
    command = ["--headless", "--bot", "--seed", "3", "--pieces", "80", "--json"]
    assert main(command) == 0
    first = capsys.readouterr().out
    result = json.loads(first)
    assert result["seed"] == 3
    assert result["pieces"] == 80
    assert result["lines"] > 20
    assert main(command) == 0
    assert capsys.readouterr().out == first


def test_one_of_a_kind_is_not_many(capsys: Capture) -> None:
    main(["--headless", "--bot", "dellacherie", "--seed", "3", "--pieces", "1"])
    assert capsys.readouterr().out == "38 points, 0 lines, level 1, 1 piece (seed 3)\n"
    assert [cli._count(n, "line") for n in (0, 1, 1000)] == ["0 lines", "1 line", "1,000 lines"]


def test_the_version_is_that_of_the_whole_project(capsys: Capture) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"tetris {metadata.version('orbtouch')}\n"


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["--headless"], "add --bot"),
        (["--replay", "one.tetris", "--bot"], "leave --bot and --mode out"),
        (["--bot", "--record", "one.tetris"], "for --headless"),
        (["--mode", "golf"], "invalid choice: 'golf'"),
        (["--bot", "hal"], "invalid choice: 'hal'"),
        (["--levl", "3"], "unrecognized arguments: --levl 3; did you mean --level?"),
        (["--replay", "one.tetris", "--seed", "0"], "leave --seed and --level out"),
        (["--level", "0"], "from 1 to 20"),
        (["--mode", "sprint", "--level", "5"], "sprint has no levels; leave --level out, or play"),
        (["--mode", "zen", "--level", "1"], "zen has no levels"),
        (["--seed", "9" * 5000], "999 must be a whole number from 0"),
        (["\x1b]0;title\x07"], "arguments: \\x1b]0;title\\x07"),
        (["--seed", "x"], "x must be a whole number from 0 to 4294967295"),
        (["--headless", "--bot", "--pieces", "many"], "whole number"),
    ],
)
def test_wrong_usage_is_answered_in_a_sentence(argv: list[str], says: str, capsys: Capture) -> None:
    with pytest.raises(SystemExit) as stop:
        main(argv)
    assert stop.value.code == 2
    printed = capsys.readouterr().err
    assert says in printed
    assert printed.startswith("tetris: ")
    assert printed.count("\n") == 1


def test_a_mode_with_levels_begins_at_the_level(capsys: Capture) -> None:
    bot = ["--headless", "--bot", "dellacherie", "--pieces", "1", "--json", "--level", "5"]
    for mode in ([], ["--mode", "marathon"], ["--mode", "endless"]):
        assert main([*bot, *mode]) == 0
        assert json.loads(capsys.readouterr().out)["level"] == 5


def test_a_bot_plays_a_mode_to_its_goal(capsys: Capture) -> None:
    assert main(["--headless", "--bot", "dellacherie", "--mode", "sprint", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["lines"] >= 40
    assert result["result"] == "goal reached"


def test_where_the_clock_counts_a_bot_plays_as_quickly_as_a_quick_hand(capsys: Capture) -> None:
    assert main(["--headless", "--bot", "dellacherie", "--mode", "ultra_2", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["time_s"] == 120
    assert 150 < result["pieces"] < 800


def test_a_recorded_game_is_checked_without_a_window(tmp_path: Path, capsys: Capture) -> None:
    path = str(tmp_path / "one.tetris")
    command = ["--headless", "--bot", "dellacherie", "--pieces", "20", "--seed", "5"]
    assert main([*command, "--record", path]) == 0
    played = capsys.readouterr().out
    assert main(["--headless", "--replay", path]) == 0
    assert capsys.readouterr().out == played


def test_a_replay_that_claims_more_than_it_plays_is_told(tmp_path: Path, capsys: Capture) -> None:
    recorder = Recorder(5)
    recorder.update(0.0, [Action.HARD_DROP])
    boast = replace(recorder.replay(), outcome=Outcome(1_000_000, 99, 250, True))
    path = tmp_path / "boast.tetris"
    save(path, boast)
    assert main(["--headless", "--replay", str(path)]) == 1
    assert "ends otherwise than it was recorded" in capsys.readouterr().err


@pytest.mark.parametrize("options", [["--headless"], []])
def test_no_replay_is_a_sentence(options: list[str], tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "letter.txt"
    path.write_text("Dear player,")
    assert main(["--replay", str(path), *options]) == 2
    printed = capsys.readouterr().err
    assert printed == f"tetris: {path}: this is no replay of this game\n"


def test_a_record_that_cannot_be_written_is_a_sentence(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "one.tetris"
    command = ["--headless", "--bot", "dellacherie", "--pieces", "2", "--record", str(path)]
    assert main(command) == 1
    assert capsys.readouterr().err.startswith(f"tetris: cannot write {path}: ")


def test_ctrl_c_ends_a_game_without_a_word(monkeypatch: Patch, capsys: Capture) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_play_unseen", interrupt)
    assert main(["--headless", "--bot"]) == 130
    assert capsys.readouterr() == ("", "")


PRESS = """
import os, signal, sys
class Press:
    def find_spec(self, name, path, target=None):
        if name == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Press())
from tetris.__main__ import main
sys.exit(main(["--bot"]))
"""


@pytest.mark.parametrize("name", ["tetris.cli", "tetris.engine.game", "argparse", "tetris.window"])
def test_ctrl_c_in_the_middle_of_the_imports_ends_without_a_word(name: str) -> None:
    command = [sys.executable, "-c", PRESS, name]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


MADE_ANOTHER_ERROR = PRESS.replace(
    "os.kill(os.getpid(), signal.SIGINT)",
    """
            try:
                os.kill(os.getpid(), signal.SIGINT)
            except KeyboardInterrupt:
                raise ImportError""",
)


def test_ctrl_c_that_pygame_makes_another_error_of_ends_without_a_word() -> None:
    command = [sys.executable, "-c", MADE_ANOTHER_ERROR, "pygame.imageext"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full is Linux's")
@pytest.mark.parametrize(
    ("redirection", "why"),
    [("> /dev/full", "No space left on device"), (">&-", "standard output is closed")],
)
def test_a_result_that_cannot_be_printed_is_one_sentence(redirection: str, why: str) -> None:
    for options in ("--headless --bot dellacherie --pieces 1", "--version", "--help"):
        command = f"{shlex.quote(sys.executable)} -m tetris {options} {redirection}"
        done = subprocess.run(command, shell=True, stderr=subprocess.PIPE, text=True, timeout=60)
        assert done.returncode == 1
        assert done.stderr == f"tetris: cannot print the result: {why}\n"


def test_a_terminal_that_knows_ascii_only_gets_escapes(tmp_path: Path) -> None:
    path = tmp_path / "ö\x1b[31m.tetris"
    command = [sys.executable, "-m", "tetris", "--replay", str(path)]
    ascii_only = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=ascii_only)
    assert done.returncode == 2
    assert done.stderr == (
        f"tetris: cannot read {tmp_path}/\\xf6\\x1b[31m.tetris: No such file or directory\n"
    )


def test_a_result_that_nobody_reads_is_one_sentence() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "tetris", "--headless", "--bot", "--pieces", "3"]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(writing)
    assert done.returncode == 1
    assert done.stderr == "tetris: cannot print the result: Broken pipe\n"


def test_help_ends_with_a_first_thing_to_try(capsys: Capture) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    assert capsys.readouterr().out.rstrip().endswith("Try it: tetris --bot")


def test_without_a_display_one_sentence_names_headless(monkeypatch: Patch, capsys: Capture) -> None:
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    monkeypatch.delenv("SDL_VIDEO_DRIVER", raising=False)
    monkeypatch.setattr(pygame.display, "init", lambda: None)
    assert main([]) == 1
    message = capsys.readouterr().err
    assert "--headless" in message
    assert message.count("\n") == 1


def test_a_window_runs_until_closed(monkeypatch: Patch, capsys: Capture, tmp_path: Path) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("SDL_AUDIODRIVER", "dummy")
    monkeypatch.setattr("platformdirs.user_data_path", lambda *_, **__: tmp_path / "data")
    monkeypatch.setattr("platformdirs.user_config_path", lambda *_, **__: tmp_path / "config")
    pictures = iter(range(3))

    def update(changed: list[pygame.Rect]) -> None:
        if next(pictures, None) is None:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    monkeypatch.setattr(pygame.display, "update", update)
    assert main(["--bot", "--seed", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["seed"] == 1
