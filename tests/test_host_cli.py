"""The command line of the host."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from host.__main__ import main

UNSEEN = {
    name: value
    for name, value in os.environ.items()
    if not name.startswith("SDL_") and name not in ("DISPLAY", "WAYLAND_DISPLAY")
}


def test_help_ends_with_a_first_thing_to_try(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    assert capsys.readouterr().out.rstrip().endswith("host --demo")


@pytest.mark.parametrize(
    ("arguments", "advice"),
    [
        (["--json"], "add --demo"),
        (["--speed", "0"], "add --demo"),
        (["--speed", "-1", "--demo"], "0 or more"),
        (["--seconds", "nan", "--demo"], "must be a number"),
        (["--seed", "-3"], "whole number"),
        (["--headless"], "add --demo or --seconds"),
        (["--demo", "--device", "orb-1"], "leave out --link, --demo"),
        (["--device", "orb-1", "--link", "COM7"], "leave out --link, --demo"),
        (["--demo", "--tap", "osc"], "leave out --demo"),
        (["--profile", "slides"], "need --target keyboard or gamepad"),
        (["find", "--seconds", "0"], "a number from 0.5 to 600"),
        (["/dev/ttyACM0"], "named with --link /dev/ttyACM0"),
        (["--target", "keyboard", "presets"], "follow two dashes: host -- --preset"),
        (["--link", ""], "leave it out to play with a virtual orb"),
        (["--dry-run"], "need --target keyboard or gamepad"),
        (["--keys", "mine.toml"], "need --target keyboard or gamepad"),
        (["--target", "keyboard", "--headless", "--screenshot", "a.png"], "needs a window"),
        (["--screenshot", "play.txt"], "must end in .png"),
        (["--screenshot", "no/such/folder/play.png"], "a folder that exists"),
    ],
)
def test_wrong_usage_is_answered_with_what_would_be_right(
    arguments: list[str], advice: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert advice in capsys.readouterr().err


def test_unknown_target_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--target", "chess"]) == 2
    told = capsys.readouterr().err
    assert told == "host: there is no target 'chess'; there are: gamepad, keyboard, tetris\n"


def test_unknown_tap_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--tap", "midi"]) == 2
    told = capsys.readouterr().err
    assert told == "host: there is no tap 'midi'; there are: lsl, osc (docs/taps.md)\n"


def test_device_that_nobody_knows_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--device", "orb-of-nobody"]) == 2
    told = capsys.readouterr().err
    assert "'orb-of-nobody' is not there" in told
    assert told.count("\n") == 1


def test_port_that_is_not_there_is_one_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    port = tmp_path / "no-such-port"
    assert main(["--link", str(port), "--headless", "--seconds", "20"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("host: ")
    assert str(port) in told
    assert told.count("\n") == 1


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a display")
def test_without_a_display_one_sentence_names_headless() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "host"], env=UNSEEN, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert "--headless" in done.stderr
    assert done.stderr.count("\n") == 1
