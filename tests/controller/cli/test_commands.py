"""All commands of the device: their list, signals, output and statuses."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from controller import __version__
from controller.__main__ import main
from controller.cli import COMMANDS, load

DEMO = "assets/demo.npz"
PRINTING = ("doctor", f"recordings {DEMO}", "install")
posix = pytest.mark.skipif(os.name != "posix", reason="no such signals, devices and permissions")


def started(*words: str, **how: object) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    return subprocess.run(  # type: ignore[call-overload,no-any-return]
        [sys.executable, "-m", "controller", *words],
        **{"text": True, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **how},
    )


def test_help_lists_every_command_with_its_purpose(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    lines = capsys.readouterr().out.splitlines()
    for name, (_, purpose) in COMMANDS.items():
        assert not name or f"  {name:12}  {purpose}" in lines
        assert callable(load(name))


def test_the_version_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == f"controller {__version__}\n"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("instal x.orb", "there is no command 'instal'; did you mean `controller install`?"),
        ("techa", "there is no command 'techa'; did you mean `controller teach`?"),
        ("zzz", f"there is no command 'zzz'; there are {', '.join(filter(None, COMMANDS))}"),
    ],
)
def test_a_misspelt_command(words: str, sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 2
    assert capsys.readouterr().err == f"controller: {sentence}\n"


@pytest.mark.parametrize(
    ("words", "near"),
    [
        ("doctor --jsno", "--json"),
        ("install --othr-sensor", "--other-sensor"),
        ("doctor --sensr virtual", "--sensor"),
    ],
)
def test_a_misspelt_option(words: str, near: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(words.split())
    assert capsys.readouterr().err.endswith(f"; did you mean {near}?\n")


@pytest.mark.parametrize("address", ["127.0.0.1:4000", "orb.local:4000", "[::1]:4000"])
def test_an_address_without_its_scheme(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--sensor", "virtual", "--link", address]) == 1
    assert f"is written socket://{address}; name another" in capsys.readouterr().err


def test_exit_statuses(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["--link", "hid:?keys=absent.toml"]) == 2
    assert main(["--link", "socket://127.0.0.1:1"]) == 1
    monkeypatch.setitem(sys.modules, "lgpio", None)
    assert main(["calibrate", "--sensor", "orb"]) == 1
    assert all(line.startswith("controller: ") for line in capsys.readouterr().err.splitlines())


INTERRUPTED_AT = """
import signal, sys
from controller.__main__ import main

class Finder:
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Finder())
sys.exit(main({words!r}))
"""


@posix
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("module", ["controller.shared.errors", ""])
def test_ctrl_c_while_modules_are_imported_ends_it_silently(command: str, module: str) -> None:
    own = "controller.cli." + COMMANDS[command][0].partition(":")[0]
    program = INTERRUPTED_AT.format(module=module or own, words=command.split())
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@posix
@pytest.mark.parametrize("words", PRINTING)
def test_commands_print_on_ascii_a_full_disk_and_a_closed_pipe(words: str) -> None:
    def printed(**how: object) -> subprocess.CompletedProcess[str]:
        return started(*words.split(), **how)

    done = printed(env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout
    reading, writing = os.pipe()
    os.close(reading)
    done = printed(stdout=writing)
    os.close(writing)
    assert (done.returncode, done.stderr) == (1, "")
    if sys.platform == "linux":
        with Path("/dev/full").open("w", encoding="utf-8") as full:
            done = printed(stdout=full)
        told = "controller: cannot write the output: no space left on device\n"
        assert (done.returncode, done.stderr) == (1, told)


def test_a_seed_out_of_range_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["--seed", str(2**32)])
    assert "must be a whole number from 0 to 4294967295" in capsys.readouterr().err
    assert main(["teach", "--sensor", f"virtual:seed={2**32}"]) == 2
    assert "must be from 0 to 4294967295" in capsys.readouterr().err
