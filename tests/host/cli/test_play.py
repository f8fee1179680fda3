"""The command line of the host."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from controller import __version__
from host.__main__ import main
from tests.support import special_files
from tests.support.pytest_types import Capture, Patch

UNSEEN = {
    name: value
    for name, value in os.environ.items()
    if not name.startswith("SDL_") and name not in ("DISPLAY", "WAYLAND_DISPLAY")
}


def test_help_ends_with_a_first_thing_to_try(capsys: Capture) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert "commands:\n  find     list the orbs" in told
    assert "--mapping" in told
    assert told.rstrip().endswith("host --demo")


def test_version_is_that_of_the_program(capsys: Capture) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"host {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["fnid"], "there is no command 'fnid'; did you mean `host find`?"),
        (["Install"], "there is no command 'Install'; did you mean `host install`?"),
        (["/dev/ttyA"], "there is no command '/dev/ttyA'; a port is named with --link /dev/ttyA"),
        (["--target", "chess"], "there is no target 'chess'; there are: gamepad, keyboard, tetris"),
        (["--tap", "midi"], "there is no tap 'midi'; there are: lsl, osc (orbtouch docs taps)"),
    ],
)
def test_unknown_name_is_a_sentence(arguments: list[str], sentence: str, capsys: Capture) -> None:
    assert main(arguments) == 2
    assert capsys.readouterr().err == f"host: {sentence}\n"


@pytest.mark.parametrize("words", [[], ["0.0.0.0"], ["203.0.113.9"], ["lan"]])
def test_phone_needs_an_address_of_this_machine(
    words: list[str], capsys: Capture, monkeypatch: Patch
) -> None:
    monkeypatch.setattr("host.phone.own_addresses", lambda: ["192.168.1.4", "10.0.0.2"])
    assert main(["--target", "keyboard", "--backend=print", "--headless", "--phone", *words]) == 2
    sentence = capsys.readouterr().err.splitlines()[-1]
    assert sentence.endswith("expected an address of this machine: 192.168.1.4 or 10.0.0.2")


def test_phone_of_a_target_without_a_menu_prints_its_code(capsys: Capture) -> None:
    options = ["--target", "keyboard", "--backend=print", "--headless", "--seconds", "0.1"]
    assert main([*options, "--phone", "127.0.0.1:0"]) == 0
    assert "█ ▄▄▄▄▄ █" in capsys.readouterr().err.replace("\xa0", " ")  # a corner


@pytest.mark.parametrize(
    ("arguments", "advice"),
    [
        (["--json"], "add --demo"),
        (["--seconds", "nan", "--demo"], "must be a number"),
        (["--seed", "-3"], "whole number"),
        (["--headless"], "add --demo or --seconds"),
        (["--demo", "--device", "orb-1"], "leave out --link, --demo"),
        (["--device", "orb-1", "--link", "COM7"], "leave out --link, --demo"),
        (["--demo", "--tap", "osc"], "leave out --demo"),
        (["--profile", "slides"], "need --target keyboard or gamepad"),
        (["--target", "tetris", "/dev/ttyACM0"], "named with --link /dev/ttyACM0"),
        (["--ke", "orb.key"], "unrecognized arguments: --ke"),
        (["--target", "keyboard", "presets"], "follow two dashes: host -- --preset"),
        (["--link", ""], "leave it out to play with a virtual orb"),
        (["--backend=print"], "need --target keyboard or gamepad"),
        (["--mapping", "mine.toml"], "need --target keyboard or gamepad"),
    ],
)
def test_wrong_usage_says_what_is_right(arguments: list[str], advice: str, capsys: Capture) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert advice in capsys.readouterr().err


def test_device_that_nobody_knows_is_one_sentence(capsys: Capture) -> None:
    assert main(["--device", "orb-of-nobody"]) == 1
    told = capsys.readouterr().err
    assert "'orb-of-nobody' is not there" in told
    assert told.count("\n") == 1


def test_absent_port_is_one_sentence(capsys: Capture, tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    port = tmp_path / "no-such-port"
    assert main(["--link", str(port), "--headless", "--seconds", "20"]) == 1
    told = capsys.readouterr().err
    assert told.startswith("host: ")
    assert str(port) in told
    assert told.count("\n") == 1


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a display")
def test_without_a_display_one_sentence_names_headless() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "host"], env=UNSEEN, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert "--headless" in done.stderr
    assert done.stderr.count("\n") == 1


# -- files that are none ----------------------------------------------------------------------

NO_ORB = ("--link", "/dev/null/no-port")
SOON = ("--headless", "--seconds", "1")
FILES = {  # what names a file
    "--mapping": ("--target", "keyboard", "--headless", "--backend=print", "--mapping"),
    "--key": (*NO_ORB, *SOON, "--key"),
    "--link": (*SOON, "--link"),
    "find --key": ("find", *NO_ORB[1:], "--key"),
    "find PORT": ("find",),
    "install FILE": ("install", *NO_ORB),
    "install --key": ("install", __file__, *NO_ORB, "--key"),
}
PORTS = ("--link", "find PORT")  # are no files of the user's: they cannot be opened now
# Whether a file is a bundle is for the orb to judge.
BUNDLES = [kind for kind in special_files.KINDS if kind not in special_files.TEXTS]
SPECIAL = {
    **dict.fromkeys(FILES, special_files.KINDS),
    "install FILE": BUNDLES,
    **dict.fromkeys(PORTS, ("missing", "folder", "pipe", "socket", "sparse", "endless")),
}


@pytest.mark.skipif(sys.platform != "linux", reason="special files of Linux")
@pytest.mark.parametrize(("opt", "kind"), [(opt, kind) for opt in FILES for kind in SPECIAL[opt]])
def test_special_file_is_told(opt: str, kind: str, tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    path = special_files.make(kind, tmp_path)
    told = special_files.answer(main, [*FILES[opt], str(path)])
    assert told.refused_by("host"), told
    assert told.status == (1 if opt in PORTS else 2)
    assert told.output == ""


def test_a_demo_that_prints_json_needs_no_screen() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "host", "--demo", "--json", "--seconds", "1"],
        env=UNSEEN, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("{")
