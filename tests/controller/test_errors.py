"""Output of commands: readable on any terminal, and one sentence when something is wrong."""

import subprocess
import sys

import pytest

from controller import errors
from controller.errors import UserError

PROGRAM = "import sys; from controller import errors; sys.exit(errors.run('orb', lambda: {}))"


def test_a_reader_that_has_gone_ends_the_command_silently() -> None:
    command = [sys.executable, "-c", PROGRAM.format("print('x\\n' * 100_000) or 0")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 1


def test_errors_become_sentences(capsys: pytest.CaptureFixture[str]) -> None:
    def wrong() -> int:
        raise UserError("the file \x1b[31m is no bundle")

    def full() -> int:
        raise OSError(28, "No space left on device", "rest.json")

    def stopped() -> int:
        raise KeyboardInterrupt

    assert [errors.run("orb", command) for command in (wrong, full, stopped)] == [2, 1, 130]
    assert capsys.readouterr().err == (
        "orb: the file \\x1b[31m is no bundle\norb: rest.json: no space left on device\n"
    )


def test_one_thing_is_no_plural() -> None:
    assert [errors.count(n, "false alarm") for n in (0, 1, 2)] == [
        *("0 false alarms", "1 false alarm", "2 false alarms"),
    ]


def test_what_a_terminal_would_obey_is_printed_as_an_escape() -> None:
    assert errors.printable("a\nb \x1b]0;title\x07 \u202e é 漢") == (
        "a\nb \\x1b]0;title\\x07 \\u202e é 漢"
    )
    assert errors.one_line("a\nb\x07") == "a\\nb\\x07"
