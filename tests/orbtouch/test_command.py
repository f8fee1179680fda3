"""The command `orbtouch` hands its verbs over to the programs that have them."""

import re
import subprocess
import sys

import pytest

import controller.__main__
import host.__main__
import models.__main__
import orbtouch
import tetris.__main__
from controller.cli import COMMANDS
from host.cli import VERBS
from models import cli as training
from orbtouch.__main__ import main
from orbtouch.cli import verbs

PROGRAMS = {
    "controller": controller.__main__, "host": host.__main__, "models": models.__main__,
    "tetris": tetris.__main__,
}  # fmt: skip
Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("typed", "program", "words"),
    [
        ("", "host", ""),
        ("--demo --seconds 5", "host", "--demo --seconds 5"),
        ("play --demo", "host", "--demo"),
        ("find --json", "host", "find --json"),
        ("pair --yes", "controller", "pair --yes"),
        ("run --sensor emulated", "controller", "--sensor emulated"),
        ("teach --help", "controller", "teach --help"),
        ("doctor", "controller", "doctor"),
        ("train data --out my.orb", "models", "train data --out my.orb"),
        ("tetris --bot", "tetris", "--bot"),
    ],
)
def test_a_verb_is_handed_over_with_its_words(
    typed: str, program: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    called: list[list[str]] = []

    def note(given: list[str]) -> int:
        called.append(given)
        return 7

    monkeypatch.setattr(PROGRAMS[program], "main", note)
    assert main(typed.split()) == 7  # the program's own status
    assert called == [words.split()]


def test_help_lists_every_verb_of_every_program_once_with_its_purpose(capsys: Capture) -> None:
    assert main(["--help"]) == 0
    printed = capsys.readouterr().out
    listed = [line.split()[0] for line in printed.splitlines() if line.startswith("  ")]
    names = {name for name in (*COMMANDS, *VERBS, *training.COMMANDS) if name}
    assert sorted(listed[:-2]) == sorted({*names, "play", "run", "tetris", "docs", "examples"})
    for purpose in (COMMANDS["doctor"][1], VERBS["find"][1], training.COMMANDS["paper"]):
        assert f"  {purpose}\n" in printed
    headings = ("play", "teach", "train", "look after an orb", "read")
    at = [printed.index(f"\n{name}:\n") for name in headings]
    assert at == sorted(at)


@pytest.mark.parametrize(
    ("typed", "advice"),
    [("trian", "did you mean `orbtouch train`?"), ("", "there are play, tetris, find,")],
)
def test_a_misspelt_verb_gets_one_sentence(typed: str, advice: str, capsys: Capture) -> None:
    assert main([typed]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith(f"orbtouch: there is no command {typed!r}; {advice}")
    assert printed.err.count("\n") == 1


def test_version_is_that_of_the_programs(capsys: Capture) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"orbtouch {orbtouch.__version__}\n"
    assert orbtouch.__version__ == controller.__version__


def test_playing_imports_no_training() -> None:
    program = (
        "import sys; from orbtouch.__main__ import main\n"
        "try: main(['play', '--version'])\n"
        "finally: print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    imported = set(done.stderr.split())
    assert "host.cli.play" in imported
    assert not imported & {"models", "controller.runtime", "tetris.cli"}


INTERRUPTED_AT = """
import signal, sys
from orbtouch.__main__ import main

class Finder:
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Finder())
sys.exit(main(["train"]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl+C is sent otherwise there")
@pytest.mark.parametrize("module", ["orbtouch.cli", "host.cli", "models.cli.train"])
def test_ctrl_c_while_modules_are_imported_ends_it_without_a_word(module: str) -> None:
    program = INTERRUPTED_AT.format(module=module)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 130
    assert "Traceback" not in done.stderr


def test_no_two_verbs_have_one_name() -> None:
    names = [verb.name for verb in verbs()]
    assert len(names) == len(set(names))


HELPS = [*(verb.name for verb in verbs()), "recordings import"]


@pytest.mark.parametrize("words", HELPS)
def test_file_names_in_a_help_have_a_dot_before_their_ending(words: str, capsys: Capture) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([*words.split(), "--help"])
    assert re.findall(r"\w+_(?:csv|json|npz|orb|toml)\b", capsys.readouterr().out) == []
